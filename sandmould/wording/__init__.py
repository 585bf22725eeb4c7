"""Every sentence of an answer and of a next step: typed values in, text out."""

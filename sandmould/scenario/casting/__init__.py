"""What is cast, in which mould: shapes, solidification, flow."""

"""What the report of each kind of study says and shows of its own.

A new kind has a module here and one line of the registry.
"""

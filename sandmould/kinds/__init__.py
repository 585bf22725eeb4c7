"""Kinds of studies: what is simulated, how it is planned and how it is computed.

A new kind is a folder here with its ``kind``, ``planning`` and ``execution``, and one line of the
registry.
"""

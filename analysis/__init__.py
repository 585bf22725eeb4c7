"""What a state of the sand says: density, filling, contacts, layers, pictures, exports.

Arrays go in, small frozen results come out. The vertical axis is the last one (y in 2D, z in 3D)
and everything is SI. A *measure* is an area (m2) in 2D and a volume (m3) in 3D.
"""

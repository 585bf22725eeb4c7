"""Solidification with elements of several sizes: the adaptive resolution particle method.

Hirata and Anzai, "Heat transfer and solidification analysis using adaptive resolution particle
method", Materials Transactions 60 (2019) 33-40. Equation numbers are those of that paper.
"""

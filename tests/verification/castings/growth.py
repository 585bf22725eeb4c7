"""Explicit steps beyond which heat that elements exchange grows."""

from __future__ import annotations

import numpy as np
from scipy.sparse import csr_array, diags_array
from scipy.sparse.linalg import eigsh

from sandmould.arrays import Floats
from sandmould.casting.arpm.exchange import Exchange


def grows_beyond_s(exchange: Exchange, capacity_j_m3_k: Floats) -> float:
    """Step beyond which the fastest mode grows: 2 over the largest eigenvalue.

    Rates are symmetric up to a factor for each row and column in every form of exchange, so that
    the eigenvalues are those of a symmetric matrix.

    Parameters
    ----------
    exchange : Exchange
    capacity_j_m3_k : (n,) float64, J/m3/K
    """
    n = len(exchange.volume_m3)
    row = np.repeat(np.arange(n), np.diff(exchange.start))
    scaled = exchange.rate_w_m3_k / capacity_j_m3_k[row]
    apart = csr_array((scaled, exchange.neighbour, exchange.start), (n, n))
    # entries that mirror each other have one sign
    off = apart.sign().multiply(abs(apart.multiply(apart.T)).sqrt())
    diagonal = diags_array(np.bincount(row, scaled, n).astype(np.float64))
    largest = eigsh((diagonal - off).tocsr(), k=1, which="LA", return_eigenvectors=False)
    return 2.0 / float(largest[0])

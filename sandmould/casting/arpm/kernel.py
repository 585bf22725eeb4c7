"""The particle method's exchange: weights (3) and (4) and the Laplacian of (5).

As printed, (4) and (5) hold two slips. The second term of (4) has the factor r0_j^d, which makes a
small element's number density that of its large neighbour; with r0_i^d both terms have the same
normalisation (``corrected``). In (5) the difference of temperatures is divided by the distance
once: J/m3 need it twice, as in the Laplacian of the MPS method, and all forms here have it so.
"""

from __future__ import annotations

from typing import Literal

import numpy as np
from scipy.spatial import cKDTree

from sandmould.arrays import Floats, Ints
from sandmould.casting.arpm.elements import Elements
from sandmould.casting.arpm.exchange import Exchange, from_rows, resistances

Form = Literal["printed", "corrected", "symmetric"]
"""(4) as printed; (4) corrected; corrected with the mean of 1/n_i and 1/n_j, which conserves
enthalpy but is no more consistent at a jump of sizes."""


def weight(distance_m: Floats, reach_m: Floats) -> Floats:
    """Weight of a pair, eq. (3): reach over distance less 1, and 0 beyond the reach.

    ``distance_m``, ``reach_m``: (p,) float64, m.
    """
    return np.asarray(np.maximum(reach_m / distance_m - 1.0, 0.0))


def volume_weight(distance_m: Floats, own_m: Floats, other_m: Floats, kernel_size: float,
                  dimensions: int, form: Form = "corrected") -> Floats:  # fmt: skip
    """Weight w_ij of a pair by the elements' volumes, eq. (4), (p,) float64.

    ``distance_m``, ``own_m``, ``other_m``, (p,) float64, m: distance, size of element i and size of
    element j. ``kernel_size``: c_k.
    """
    ratio = (other_m / own_m) ** dimensions
    second = ratio if form == "printed" else 1.0
    by_own = weight(distance_m, kernel_size * own_m)
    by_other = weight(distance_m, kernel_size * other_m)
    return np.asarray(0.5 * (ratio * by_own + second * by_other))


def with_images(elements: Elements, reach_m: float) -> tuple[Floats, Ints]:
    """Places of all elements and of their mirror images behind the walls, with their numbers."""
    place, number = elements.position_m, np.arange(len(elements.size_m))
    for axis in range(elements.dimensions):
        beside = [(place, number)]
        for wall in (elements.low_m[axis], elements.high_m[axis]):
            near = np.abs(place[:, axis] - wall) < reach_m
            image = place[near].copy()
            image[:, axis] = 2.0 * wall - image[:, axis]
            beside.append((image, number[near]))
        place, number = (np.concatenate(part) for part in zip(*beside, strict=True))
    return place, number


def neighbours(elements: Elements, kernel_size: float) -> tuple[Ints, Ints, Floats]:
    """Neighbours nearer than c_k times the larger of two sizes.

    Insulated walls are mirrors: elements have their images behind them, without which those at a
    wall would count too few neighbours and conduct too well along it.

    Returns
    -------
    own, other : (p,) int64
        Every pair stands both ways; an element can be its own image's neighbour.
    distance_m : (p,) float64, m
    """
    real = len(elements.size_m)
    place, number = with_images(elements, kernel_size * float(elements.size_m.max()))
    size = elements.size_m[number]
    octave = np.round(np.log2(size / size.min())).astype(np.int64)
    pairs = []
    for level in np.unique(octave):
        own, smaller = np.flatnonzero(octave == level), np.flatnonzero(octave < level)
        reach = kernel_size * float(size[own].max())
        tree = cKDTree(place[own])
        within = tree.query_pairs(reach, output_type="ndarray")
        pairs.append(np.stack([own[within[:, 0]], own[within[:, 1]]]))
        if len(smaller):
            across = tree.sparse_distance_matrix(
                cKDTree(place[smaller]), reach, output_type="ndarray"
            )
            pairs.append(np.stack([own[across["i"]], smaller[across["j"]]]))
    first, second = np.concatenate(pairs, axis=1)
    first, second = np.concatenate([first, second]), np.concatenate([second, first])
    first, second = first[first < real], second[first < real]
    distance = np.linalg.norm(place[first] - place[second], axis=1)
    near = distance < kernel_size * np.maximum(size[first], size[second])
    return first[near], number[second[near]], distance[near]


def kernel_exchange(elements: Elements, conductivity_w_m_k: Floats,
                    resistance_m2k_w: float | Floats,
                    kernel_size: float = 2.1, form: Form = "corrected",
                    refuse_ratio: bool = True) -> Exchange:  # fmt: skip
    """Rates of eq. (5), with neighbours found once.

    Parameters
    ----------
    conductivity_w_m_k : (m,) float64, W/m/K
        Of each material.
    resistance_m2k_w : float or (m, m) float64, m2 K/W
        As of ``resistances``.
    kernel_size : float
        c_k; the paper takes 2.1 and tries 1.4 to 4.2.
    refuse_ratio : bool
        Whether elements smaller than 1/c_k of one within whose reach they lie are refused
        (section 4.3.2); the paper's cases 2-3A and small c_k break that rule.

    Raises
    ------
    ValueError
        When sizes differ too much, an element has no neighbour or c_k is out of range.
    """
    if not 1.0 < kernel_size <= 6.0:
        raise ValueError(f"the kernel size is {kernel_size}; it must be above 1 and at most 6")
    between = resistances(resistance_m2k_w, len(conductivity_w_m_k))
    own, other, distance = neighbours(elements, kernel_size)
    size, other_size, d = elements.size_m[own], elements.size_m[other], elements.dimensions
    if refuse_ratio:
        _check_ratio(size, other_size, kernel_size)
    weights = volume_weight(distance, size, other_size, kernel_size, d, form)
    density = np.bincount(own, weights, len(elements.size_m))
    if not (density > 0.0).all():
        raise ValueError(
            f"the element at {elements.position_m[density == 0.0][0].tolist()} m has no neighbour "
            f"within {kernel_size} times its size; elements must touch"
        )
    inverse = 1.0 / density[own]
    if form == "symmetric":
        inverse = 0.5 * (inverse + 1.0 / density[other])
    half = 0.5 / conductivity_w_m_k
    material, other_material = elements.material[own], elements.material[other]
    at_interface = between[material, other_material] / distance
    conductivity = 1.0 / (half[material] + half[other_material] + at_interface)
    rate = 2.0 * d * inverse * conductivity * weights / distance**2
    apart = own != other
    return from_rows(own[apart], other[apart], rate[apart], elements.volume_m3)


def check_sizes(elements: Elements, kernel_size: float) -> None:
    """Refuse elements smaller than 1/c_k of one within whose reach they lie (section 4.3.2).

    Raises ValueError.
    """
    own, other, _ = neighbours(elements, kernel_size)
    _check_ratio(elements.size_m[own], elements.size_m[other], kernel_size)


def _check_ratio(size_1: Floats, size_2: Floats, kernel_size: float) -> None:
    small, large = np.minimum(size_1, size_2), np.maximum(size_1, size_2)
    beyond = small * kernel_size < large * (1.0 - 1e-9)
    if beyond.any():
        k = int(np.argmax(beyond))
        raise ValueError(
            f"an element of {small[k]:g} m lies within the reach of one of {large[k]:g} m; the "
            f"smaller must measure at least 1/c_k = 1/{kernel_size:g} of the larger: keep more "
            "layers of middle size between them, or exchange over faces"
        )

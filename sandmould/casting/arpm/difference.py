"""Finite differences of the enthalpy method on a regular grid: the reference and competitor.

Five points in 2D and seven in 3D, conductivities in series between cell centres with the
interface's resistance on the face, explicit steps. It shares the materials with the elements but
none of their exchange.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numba import prange, set_num_threads
from scipy.sparse import coo_array, csr_array

from sandmould.arrays import Floats
from sandmould.casting.arpm.exchange import resistances
from sandmould.casting.arpm.marching import STEP_SHARE, Heat, note
from sandmould.casting.arpm.material import EnthalpyTable, temperature_of
from sandmould.casting.arpm.raster import BesideFaces, Raster
from sandmould.compiled import njit


class HeatGrid(NamedTuple):
    """Cells of a box, the rates between them and their materials; compiled code takes it."""

    through_x: Floats
    through_y: Floats
    through_z: Floats
    """(nx, ny, nz) float64, W/m3/K: between each cell and the next along an axis."""
    material: Any
    """(nx, ny, nz) int64."""
    thinner: Any
    """(nx, ny, nz) float64: a cell's volume over what it holds; (0, 0, 0) where all hold it."""
    link_start: Any
    link_cell: Any
    link_rate: Floats
    """Cells that heat joins past a drawn surface, by the cell, and their rates, W/m3/K."""
    rows: Floats
    reference: float
    """See ``EnthalpyTable``."""


class DifferenceSteps:
    """Explicit finite differences on the cells of a raster, in C order."""

    def __init__(
        self,
        raster: Raster,
        table: EnthalpyTable,
        conductivity_w_m_k: Floats,
        resistance_m2k_w: float | Floats,
        share: float = STEP_SHARE,
        threads: int = 1,
    ) -> None:
        """Compute the conductances between cells and the step.

        Parameters
        ----------
        conductivity_w_m_k : (m,) float64, W/m/K
        resistance_m2k_w : float or (m, m) float64, m2 K/W
        share : float
            Of the longest stable step.
        """
        # a plane is a box of one layer
        shape = (1,) * (3 - raster.material.ndim) + raster.material.shape
        material = raster.material.reshape(shape)
        resistance = resistances(resistance_m2k_w, len(conductivity_w_m_k))
        along_x, along_y, along_z = (
            _between(material, axis, raster, conductivity_w_m_k, resistance) for axis in range(3)
        )
        rate = np.zeros(shape)
        for axis, along in enumerate((along_x, along_y, along_z)):
            rate += along + np.roll(along, 1, axis=axis)
        self.volume_m3 = np.full(material.size, raster.cell_m**raster.material.ndim)
        thinner, links = np.zeros((0, 0, 0)), csr_array((0, 0))
        if raster.cut:
            self.volume_m3[raster.cut.cell] *= raster.cut.volume_share
            thinner = np.ones(shape)
            thinner.reshape(-1)[raster.cut.cell] = 1.0 / raster.cut.volume_share
            links = _links(raster, raster.cut.passage, conductivity_w_m_k)
            rate = (rate + links.sum(axis=1).reshape(shape)) * thinner
        self._grid = HeatGrid(along_x, along_y, along_z, material, thinner, links.indptr,
                              links.indices, links.data, table.rows, table.reference_k)  # fmt: skip
        self.step_s = share * float((table.rows[material, 0] / rate).min())
        self._threads = threads

    def advance(self, heat: Heat, duration_s: float) -> None:
        """Take equal steps over a duration, none longer than ``step_s``."""
        steps = max(1, math.ceil(duration_s / self.step_s * (1.0 - 1e-12)))
        set_num_threads(self._threads)
        shape = self._grid.material.shape
        heat.temperature_k = _difference_steps(
            steps, duration_s / steps, heat.time_s, self._grid, heat.enthalpy_j_m3.reshape(shape),
            heat.temperature_k.reshape(shape), heat.noted,
        ).reshape(-1)  # fmt: skip
        heat.time_s += duration_s
        heat.element_steps += steps * self._grid.material.size


def _between(material: Any, axis: int, raster: Raster, conductivity: Floats, resistance: Floats
             ) -> Floats:  # fmt: skip
    """Rate (W/K over a whole cell's volume) between each cell and the next; 0 behind the last."""
    rate, cell_m, n = np.zeros(material.shape), raster.cell_m, material.shape[axis]
    before, after = (np.take(material, range(k, n - 1 + k), axis=axis) for k in (0, 1))
    path = 0.5 * cell_m / conductivity[before] + 0.5 * cell_m / conductivity[after]
    path += resistance[before, after]
    inner = [slice(None)] * 3
    inner[axis] = slice(0, n - 1)
    rate[tuple(inner)] = 1.0 / (path * cell_m)
    if raster.cut:
        own = raster.cut.axis == axis - (3 - raster.material.ndim)
        area, part = raster.cut.area_share[own], raster.cut.low_part[own]
        low = np.unravel_index(raster.cut.low[own], material.shape)
        high = tuple(at + (k == axis) for k, at in enumerate(low))
        path = cell_m * part / conductivity[material[low]]
        path += cell_m * (1.0 - part) / conductivity[material[high]]
        resists = resistance[material[low], material[high]]
        area = np.where(resists > 0.0, area, 1.0)
        rate[low] = area / ((path * area + resists) * cell_m)
        passage = raster.cut.passage
        within = passage.axis == axis - (3 - raster.material.ndim)
        rate[np.unravel_index(passage.low[within], material.shape)] *= passage.share[within]
    return rate


def _links(raster: Raster, passage: BesideFaces, conductivity: Floats) -> csr_array:
    """Rates between cells that heat joins past a surface, as of ``_between``."""
    first, second = passage.link
    k = conductivity[raster.material.reshape(-1)[first]]
    rate = np.tile(k * passage.link_share / raster.cell_m**2, 2)
    pair = np.concatenate([first, second]), np.concatenate([second, first])
    return coo_array((rate, pair), (raster.material.size,) * 2).tocsr()


@njit(parallel=True)
def _difference_steps(
    steps: int, dt: float, time_s: float, grid: HeatGrid, enthalpy: Any, temperature: Any,
    noted: Any,
) -> Any:  # fmt: skip
    """Take explicit steps; enthalpy and notes change in place, temperatures come back."""
    through_x, through_y, through_z, material, thinner, start, cell, along, rows, reference = grid
    nx, ny, nz = enthalpy.shape
    now, then = temperature.copy(), np.empty_like(temperature)
    for step in range(steps):
        for line in prange(nx * ny):
            x, y = line // ny, line % ny
            for z in range(nz):
                own, taken = now[x, y, z], 0.0
                if x > 0:
                    taken += through_x[x - 1, y, z] * (now[x - 1, y, z] - own)
                if x < nx - 1:
                    taken += through_x[x, y, z] * (now[x + 1, y, z] - own)
                if y > 0:
                    taken += through_y[x, y - 1, z] * (now[x, y - 1, z] - own)
                if y < ny - 1:
                    taken += through_y[x, y, z] * (now[x, y + 1, z] - own)
                if z > 0:
                    taken += through_z[x, y, z - 1] * (now[x, y, z - 1] - own)
                if z < nz - 1:
                    taken += through_z[x, y, z] * (now[x, y, z + 1] - own)
                if thinner.size:
                    for k in range(start[line * nz + z], start[line * nz + z + 1]):
                        at = cell[k]
                        taken += along[k] * (now[at // nz // ny, at // nz % ny, at % nz] - own)
                    taken *= thinner[x, y, z]
                before, m = enthalpy[x, y, z], material[x, y, z]
                after = before + dt * taken
                enthalpy[x, y, z] = after
                then[x, y, z] = temperature_of(after, m, rows, reference)
                note(
                    line * nz + z, m, before, after, time_s + step * dt, dt, rows, reference, noted
                )
        now, then = then, now
    return now

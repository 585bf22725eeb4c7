"""The choices of a run: how elements exchange heat and how time goes forward."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from sandmould.casting.arpm.difference import DifferenceSteps
from sandmould.casting.arpm.elements import Elements
from sandmould.casting.arpm.exchange import Exchange
from sandmould.casting.arpm.faces import face_exchange
from sandmould.casting.arpm.filling import Filling
from sandmould.casting.arpm.kernel import kernel_exchange
from sandmould.casting.arpm.local_steps import LocalSteps
from sandmould.casting.arpm.marching import STEP_SHARE, ExplicitSteps, Marching, Substance
from sandmould.casting.arpm.power_diagram import power_exchange
from sandmould.casting.arpm.raster import Raster
from sandmould.casting.arpm.super_steps import SuperSteps

Exchanging = Literal["printed", "corrected", "symmetric", "faces", "power", "difference"]
Stepping = Literal["explicit", "super", "local"]
STEPS = {"explicit": ExplicitSteps, "super": SuperSteps, "local": LocalSteps}


@dataclass(frozen=True)
class HeatMethod:
    """One way to compute a casting."""

    exchange: Exchanging = "faces"
    """Three readings of eqs. (4) and (5), true faces on a grid, faces of a power diagram for free
    positions, or finite differences on a plain grid."""
    stepping: Stepping = "local"
    kernel_size: float = 2.1
    """c_k of the paper; of no use to faces."""
    refuse_ratio: bool = True
    """Whether sizes that break the paper's rule of 1/c_k are refused."""
    step_share: float = STEP_SHARE
    threads: int = 1

    def exchange_of(self, elements: Elements, filling: Filling) -> Exchange:
        """Rates between elements.

        Raises
        ------
        ValueError
            When the sizes do not suit the exchange, or it is that of a plain grid.
        """
        conductivity, resistance = filling.conductivity_w_m_k, filling.least_m2k_w
        if self.exchange == "faces":
            return face_exchange(elements, conductivity, resistance, curves=filling.curves)
        if filling.curves is not None:
            raise ValueError("conductances that vary need an exchange over faces")
        if self.exchange == "power":
            return power_exchange(elements, conductivity, resistance)
        if self.exchange == "difference":
            raise ValueError("finite differences have no exchange of elements: give their raster")
        return kernel_exchange(
            elements, conductivity, resistance, self.kernel_size, self.exchange, self.refuse_ratio
        )

    def marching(self, elements: Elements, filling: Filling, raster: Raster) -> Marching:
        """Make ready to go forward in time.

        ``elements``: placed on the raster; of one size for finite differences.

        Raises
        ------
        ValueError
            When finite differences are asked for with elements of several sizes.
        """
        if self.exchange == "difference":
            if len(elements.size_m) != raster.material.size:
                raise ValueError("finite differences need elements of one size: no layers")
            if filling.curves is not None:
                raise ValueError("conductances that vary need an exchange over faces")
            return DifferenceSteps(
                raster, filling.table, filling.conductivity_w_m_k, filling.least_m2k_w,
                self.step_share, self.threads,
            )  # fmt: skip
        return self.stepping_of(elements, filling)

    def stepping_of(self, elements: Elements, filling: Filling) -> Marching:
        """Make elements ready to go forward in time; errors as those of ``exchange_of``."""
        substance = Substance(elements.material, filling.table)
        steps = STEPS[self.stepping]
        return steps(self.exchange_of(elements, filling), substance, share=self.step_share,
                     threads=self.threads)  # fmt: skip

"""Solidification with elements of several sizes: the adaptive resolution particle method.

Hirata and Anzai, "Heat transfer and solidification analysis using adaptive resolution particle
method", Materials Transactions 60 (2019) 33-40. Equation numbers are those of that paper.
"""

from importlib.metadata import version
from pathlib import Path

from sandmould import ROOT, geometry
from sandmould.digest import code_identity

_SHARED = ("casting/shapes", "casting/solidification", "solids")


def source_files() -> list[Path]:
    """Files of the solver, and those of the scenario that compute for it."""
    shared = [ROOT / "sandmould" / "scenario" / f"{name}.py" for name in _SHARED]
    return sorted([*Path(__file__).parent.glob("[!_]*.py"), *shared])


def source_hash() -> str:
    """State of the solver, which stands in place of a version."""
    return code_identity([source_files(), geometry.source_files()], version("numba"))

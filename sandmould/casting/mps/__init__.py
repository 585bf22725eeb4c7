"""Metal flow by MPS with improved multiple relaxation, after Hirata and Anzai 2017.

Arrays of vectors have three components here; in 2D the last is zero. Equation numbers are those of
the paper (Mater. Trans. 58, 479-484).
"""

from importlib.metadata import version
from pathlib import Path

from sandmould import ROOT
from sandmould.digest import code_identity


def source_files() -> list[Path]:
    """Files of the solver, and that of the scenario which computes for it."""
    own = Path(__file__).parent.glob("[!_]*.py")
    return sorted([*own, ROOT / "sandmould" / "scenario" / "casting" / "flow.py"])


def source_hash() -> str:
    """State of the solver, which stands in place of a version."""
    return code_identity([source_files()], version("numba"))

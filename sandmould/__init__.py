"""Sand-mould making for lost-foam casting: scenarios, engines and sweeps."""

from importlib import import_module
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[1]
"""Where the packages lie: the repository, or the folder of an installed wheel."""
IS_CHECKOUT = (ROOT / "Snakefile").is_file()
SHIPPED = ROOT if IS_CHECKOUT else ROOT / "sandmould" / "shipped"
"""Where ``config/``, ``templates/``, ``workflow/`` and ``profiles/`` lie."""


def __getattr__(name: str) -> Any:
    """``run`` and ``Result`` of :mod:`sandmould.notebook`, which needs all rooms below it."""
    if name in ("run", "Result"):
        return getattr(import_module("sandmould.notebook"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")

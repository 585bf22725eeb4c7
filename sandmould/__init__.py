"""Sand-mould making for lost-foam casting: scenarios, engines and sweeps."""

from importlib import import_module
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[1]
"""Where the packages lie: the repository, or the folder of an installed wheel."""
IS_CHECKOUT = (ROOT / "Snakefile").is_file()
SHIPPED = ROOT if IS_CHECKOUT else ROOT / "sandmould" / "shipped"
"""Where ``config/``, ``templates/``, ``workflow/`` and ``profiles/`` lie."""


_PLACES = {
    "BadInputError": "sandmould.bad_input",
    **dict.fromkeys(("Result", "again", "plan", "run", "status"), "sandmould.notebook"),
}
"""Modules of what users of the package need: loaded when asked, since they take a second."""
__all__ = [*_PLACES, "__version__"]


def __getattr__(name: str) -> Any:
    """What users of the package need, from the rooms below it."""
    if name in _PLACES:
        return getattr(import_module(_PLACES[name]), name)
    if name == "__version__":
        return import_module("importlib.metadata").version("sandmould")
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})

"""Sand-mould making for lost-foam casting: scenarios, engines and sweeps."""

from pathlib import Path

PACKAGE = Path(__file__).resolve().parent
"""The package's own files."""
IS_CHECKOUT = (PACKAGE.parent / "Snakefile").is_file()
"""Whether it runs from a clone. An installation has what lies beside it in ``shipped``."""
ROOT = PACKAGE.parent if IS_CHECKOUT else PACKAGE / "shipped"
"""Where ``config/``, ``templates/``, ``workflow/`` and ``profiles/`` lie."""

"""Sand-mould making for lost-foam casting: scenarios, engines and sweeps."""

from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
"""Where the packages lie: the repository, or the folder of an installed wheel."""
IS_CHECKOUT = (ROOT / "Snakefile").is_file()
SHIPPED = ROOT if IS_CHECKOUT else ROOT / "sandmould" / "shipped"
"""Where ``config/``, ``templates/``, ``workflow/`` and ``profiles/`` lie."""

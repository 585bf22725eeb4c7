"""Sand-mould making for lost-foam casting: scenarios, engines and sweeps."""

from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
"""The repository: where ``config/`` and ``templates/`` lie."""

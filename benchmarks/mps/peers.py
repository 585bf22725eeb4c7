"""PySPH's implicit schemes on the same tank, in an environment of their own."""

from __future__ import annotations

import json
import subprocess
from pathlib import Path
from typing import Any

import numpy as np

from sandmould import ROOT
from tests.verification.castings.still_fluid import ideal_pa

PYTHON = ROOT / ".venv-peers-flow" / "bin" / "python"
PROGRAM = Path(__file__).parents[1] / "peers" / "run_pysph.py"
SCHEMES = ("iisph", "sisph")
LIMIT_S = 3600.0
"""Wall time after which a peer is stopped."""
ERROR_CHARACTERS = 300
"""Characters of an error that are kept."""


def peer_rows(duration_s: float) -> list[dict[str, Any]]:
    """Run each scheme; a row of one that fails says why."""
    rows = [_row(scheme, duration_s) for scheme in SCHEMES]
    print(rows, flush=True)
    return rows


def _row(scheme: str, duration_s: float) -> dict[str, Any]:
    name = {"scheme": f"PySPH {scheme}"}
    command = [str(PYTHON), str(PROGRAM), scheme, str(duration_s)]
    try:
        ran = subprocess.run(command, capture_output=True, text=True, timeout=LIMIT_S)
    except subprocess.TimeoutExpired:
        return name | {"stopped": f"no answer within {LIMIT_S:g} s, compiling included"}
    except OSError as error:
        return name | {"stopped": f"{error}: make flow makes its environment"}
    if ran.returncode:
        return name | {"stopped": ran.stderr.strip()[-ERROR_CHARACTERS:]}
    return name | measured(json.loads(ran.stdout), duration_s)


def measured(answer: dict[str, Any], duration_s: float) -> dict[str, Any]:
    """Take noise, speed and cost from what a peer tells, over the second half of its run."""
    time_s = np.array(answer["time_s"])
    later = time_s > 0.5 * duration_s
    pressure = np.array(answer["pressure_pa"])[later]
    return {
        "version": answer["version"],
        "stopped": "",
        "cpu_s_per_simulated_s": answer["cpu_s"] / float(time_s[-1]),
        "mean_pressure_over_ideal": float(pressure.mean() / ideal_pa()[-1]),
        "pressure_noise_pa": float(pressure.std()),
        "mean_speed_m_s": float(np.array(answer["mean_speed_m_s"])[later].mean()),
    }

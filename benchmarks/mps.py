"""Metal flow by particles: noise against cost of the schemes, the solver's share, size, peers.

``python -m benchmarks.mps`` writes mps.json beside this file, docs/metal_flow.md and its picture.
``--part`` computes one part again and keeps the others; ``--quick`` writes what 0.3 s give to
results/benchmarks/ instead; ``--page`` writes the page of mps.json again. The parts ``solvers`` and
``peers`` need an environment of its own, ``.venv-peers-flow`` (``make flow`` makes it).
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from benchmarks.mps_page import RECOMMENDED, write
from benchmarks.mps_peers import peer_rows
from benchmarks.mps_runs import SCHEMES, large_row, scheme_rows
from benchmarks.mps_solvers import solver_rows
from sandmould import ROOT
from sandmould.casting.mps.computation import source_hash
from sandmould.scenario.scenario import Scenario
from sandmould.study.simulate import provenance

OUT = Path(__file__).with_name("mps.json")
QUICK = ROOT / "results" / "benchmarks"
PARTS = ("schemes", "solvers", "large", "peers")
AGAIN = 2
"""Runs of the setting to take besides its row, for the spread of its cost."""
LONG_S, SHORT_S = 2.0, 0.3
"""The paper's duration, and one that shows that everything works: what is calm at first may not
stay so."""
PEERS_S = 0.3
"""iisph takes minutes of one core for it, and its metal leaves the tank before 0.5 s."""


def part(name: str, duration_s: float, origin: Mapping[str, Any]) -> dict[str, Any]:
    """Compute one part; it says where and with what."""
    if name == "peers":
        duration_s = min(duration_s, PEERS_S)
    found: dict[str, Any] = {
        "machine": origin["machine"], "commit": origin["commit"], "solver": source_hash(),
        "duration_s": duration_s,
    }  # fmt: skip
    if name == "large":
        return found | {"row": large_row()}
    if name == "solvers":
        return found | {"rows": solver_rows()}
    if name == "schemes":
        again = scheme_rows([RECOMMENDED] * AGAIN, duration_s)
        return found | {"rows": scheme_rows(SCHEMES, duration_s), "again": again}
    own = scheme_rows([RECOMMENDED], duration_s)[0]
    return found | {"own": own, "rows": peer_rows(duration_s)}


def main() -> None:
    """Measure, keep and draw."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--part", nargs="+", choices=PARTS, default=PARTS)
    parser.add_argument("--quick", action="store_true", help="0.3 s")
    parser.add_argument("--page", action="store_true", help="compute nothing")
    asked = parser.parse_args()
    folder = QUICK if asked.quick else OUT.parent
    folder.mkdir(parents=True, exist_ok=True)
    out = folder / OUT.name
    kept = json.loads(out.read_text(encoding="utf-8")) if out.exists() else {}
    origin = provenance(Scenario())  # before a file of the checkout changes
    for name in () if asked.page else asked.part:
        kept[name] = part(name, SHORT_S if asked.quick else LONG_S, origin)
        out.write_text(json.dumps(kept, indent=1) + "\n", encoding="utf-8")
    if set(kept) == set(PARTS):
        write(kept, QUICK if asked.quick else ROOT / "docs")


if __name__ == "__main__":
    main()

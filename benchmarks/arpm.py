"""Solidification: the paper's cases, where the ways fail, and error against cost.

``python -m benchmarks.arpm`` writes arpm.json beside this file, docs/solidification.md and its
pictures. ``--part`` computes one part again and keeps the others; ``--quick`` writes what coarse
plates give to results/benchmarks/ instead; ``--page`` writes the page of arpm.json again.
"""

from __future__ import annotations

import argparse
import json
import os
from pathlib import Path
from typing import Any

from benchmarks.arpm_contact import contact_rows
from benchmarks.arpm_fields import draw_fields
from benchmarks.arpm_limits import jump_rows, scatter_rows, step_rows
from benchmarks.arpm_page import FIELDS, write
from benchmarks.arpm_space import REFERENCE_MM, space_rows
from benchmarks.arpm_ways import way_rows
from sandmould import ROOT
from sandmould.casting.arpm.computation import source_hash
from sandmould.casting.arpm.plates_case import read_plates
from sandmould.scenario.scenario import Scenario
from sandmould.study.simulate import provenance

OUT = Path(__file__).with_name("arpm.json")
QUICK = ROOT / "results" / "benchmarks"
PARTS = ("contact", "limits", "ways", "space", "fields")
COARSE_MM, PAPER_MM = 5.0, 1.0
COARSE_SPACE_MM = 2.0


def part(name: str, quick: bool) -> dict[str, Any]:
    """Compute one part; it says where and with what."""
    origin = provenance(Scenario())
    found: dict[str, Any] = {
        "machine": origin["machine"], "commit": origin["commit"], "solver": source_hash(),
        "load_before": round(os.getloadavg()[0], 1),
    }  # fmt: skip
    if name == "contact":
        return found | {"rows": contact_rows()}
    if name == "limits":
        return found | {"steps": step_rows(), "jumps": jump_rows(), "scatter": scatter_rows()}
    plates, least_mm = read_plates(), COARSE_MM if quick else PAPER_MM
    if name == "ways":
        return found | {"rows": way_rows(plates, least_mm)}
    if name == "space":
        return found | {
            "rows": space_rows(plates.filling, COARSE_SPACE_MM if quick else REFERENCE_MM)
        }
    draw_fields(plates, 1e-3 * least_mm, QUICK / FIELDS.name if quick else FIELDS)
    return found


def main() -> None:
    """Measure, keep and draw."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--part", nargs="+", choices=PARTS, default=PARTS)
    parser.add_argument("--quick", action="store_true", help="coarse plates, no page")
    parser.add_argument("--page", action="store_true", help="compute nothing")
    asked = parser.parse_args()
    out = QUICK / OUT.name if asked.quick else OUT
    out.parent.mkdir(parents=True, exist_ok=True)
    kept = json.loads(out.read_text(encoding="utf-8")) if out.exists() else {}
    for name in () if asked.page else asked.part:
        kept[name] = part(name, asked.quick)
        out.write_text(json.dumps(kept, indent=1) + "\n", encoding="utf-8")
    if not asked.quick and set(kept) == set(PARTS):
        write(kept)


if __name__ == "__main__":
    main()

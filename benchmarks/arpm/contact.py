"""The contact test of Hirata and Anzai (2019), section 3: Figures 3 and 4 as ours."""

from __future__ import annotations

from typing import Any

from sandmould.casting.arpm.method import HeatMethod
from tests.verification.castings.contact import LAYERS, run_contact
from tests.verification.castings.plates import read_aluminium

KERNEL_SIZES = (1.4, 1.8, 2.1, 2.4, 2.8, 3.2, 3.6, 4.2)
RESISTANCES_M2K_W = (0.0, 0.001)
FORMS = ("corrected", "printed")


def contact_rows() -> list[dict[str, Any]]:
    """Error (6) of each case by each form, over the size of the kernel; faces have none."""
    aluminium = read_aluminium()
    rows = []
    ways = [(form, size) for form in FORMS for size in KERNEL_SIZES] + [("faces", 2.1)]
    for resistance in RESISTANCES_M2K_W:
        for form, size in ways:
            for case in LAYERS:
                method = HeatMethod(form, "explicit", size, refuse_ratio=False)  # type: ignore[arg-type]
                contact = run_contact(case, aluminium, resistance, method)
                rows.append({
                    "case": case, "exchange": form, "resistance_m2k_w": resistance,
                    "kernel_size": None if form == "faces" else size,
                    "error_percent": contact.error_percent, "largest_k": contact.largest_k,
                    "drift_percent": contact.drift_percent, "elements": contact.elements,
                })  # fmt: skip
            print(f"contact, R = {resistance:g} m2 K/W, {form} {size:g}", flush=True)
    return rows

"""The pictures of the README, from a study that was computed.

``python -m benchmarks.house.readme_pictures RESULTS RUN`` writes ``docs/report.png``, the first
screen of the study's report as chromium shows it, and ``docs/film.webp``, the sand of one run from
its first layer to its rest. RESULTS is the study's folder of results.
"""

from __future__ import annotations

import base64
import io
import subprocess
from pathlib import Path

from PIL import Image

from sandmould import ROOT
from sandmould.drawing.figures import draw_layers
from sandmould.kinds.sand.moments import list_moments
from sandmould.module_main import run_main
from sandmould.scenario.scenario import Scenario
from sandmould.study.plan.plan_files import read_run

WINDOW = (1200, 1150)
"""Screen of the report, pixels."""
FILM_PX = 440
FRAME_MS, LAST_MS = 110, 2000


def photograph(page: Path, out: Path) -> None:
    """Have chromium draw the first screen of a page, in 64 colours."""
    width, height = WINDOW
    command = [
        "chromium", "--headless", "--no-sandbox", "--disable-gpu", "--hide-scrollbars",
        f"--window-size={width},{height}", f"--screenshot={out.absolute()}",
        page.absolute().as_uri(),
    ]  # fmt: skip
    subprocess.run(command, check=True, capture_output=True, timeout=120)
    with Image.open(out) as drawn:
        few = drawn.convert("RGB").quantize(64)
    few.save(out, optimize=True)


def film(run: Path, out: Path) -> int:
    """Write the snapshots of a run as an animated picture.

    Returns
    -------
    int
        Number of frames.
    """
    scenario = read_run(run / "scenario.yaml").scenario
    if not isinstance(scenario, Scenario):
        raise SystemExit(f"{run} is no run of sand.")
    moments = list_moments(run)
    addresses = draw_layers([m.stored.load() for m in moments], scenario, scenario.box.height_m)
    frames = [_frame(address) for address in addresses]
    lasts = [FRAME_MS] * (len(frames) - 1) + [LAST_MS]
    frames[0].save(
        out, save_all=True, append_images=frames[1:], duration=lasts, loop=0, quality=60, method=6
    )
    return len(frames)


def _frame(address: str) -> Image.Image:
    drawn = Image.open(io.BytesIO(base64.b64decode(address.partition(",")[2]))).convert("RGB")
    return drawn.resize((FILM_PX, round(FILM_PX * drawn.height / drawn.width)))


def main(results: str, run: str) -> int:
    """Write both."""
    folder, docs = Path(results), ROOT / "docs"
    photograph(folder / "report.html", docs / "report.png")
    frames = film(folder / "runs" / run, docs / "film.webp")
    print(f"{frames} frames, {(docs / 'film.webp').stat().st_size} bytes")
    return 0


if __name__ == "__main__":
    run_main(main, "python -m benchmarks.house.readme_pictures RESULTS RUN", (2,))

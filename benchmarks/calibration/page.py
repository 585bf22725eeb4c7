"""The page docs/calibration_peers.md, written from what was measured."""

from __future__ import annotations

from typing import Any

from benchmarks.frame import table

_HOW = """\
# Calibration beside GrainLearning and coexist

Made by `make peers` (`benchmarks/calibration`); do not edit. Sliding friction and rolling arm
between grains are sought from one angle of repose, within the bounds of the study `repose_map`.
An angle leaves a ridge, so any point on it counts as found.
"""
_DRIVEN = """\
## How each method is driven

All methods speak one line of asks and guesses; the peers run in an environment of their own. A
start and the noise of its runs are shared by all methods, as far as a method takes them.

- **sandmould**: `sandmould.statistics.calibration.refine`. Six points of a Sobol sequence, then one
  run after the other where the chance is greatest that its mean lies within the tolerance. Its
  guess has the least expected squared miss and changes with every run.
- **GrainLearning**: `IterativeBayesianFilter` and `DynamicSystem`, called as
  `BayesianCalibration.run_one_iteration` calls them, less its percentage errors, which divide by
  the range of the observations and so by zero for a single angle. Ten runs a generation, target
  of the effective sample size 0.3, one component: the two-parameter example of its manual. Its
  first generation is the first ten points of the shared start. Two guesses: the most probable
  sample, as `get_most_prob_params` gives it, and the weighted mean, its `estimated_params`. Its
  search for sigma stops within 0.01, where a degree on 25 is 0.0016, so that the effective sample
  size may miss its target; that is left as it is.
- **coexist**: `Access.learn` itself with its defaults, CMA-ES of eight runs an epoch, through a
  `Scheduler` that gets each run from the benchmark. It takes one point of the shared start. The
  error is the absolute miss of the angle. Two guesses: the estimate that it prints while it
  learns, CMA-ES's mean, and the best run, which it prints at the end.
- **no method**: a control. The shared start and on along its Sobol sequence; the guess is the run
  nearest the target. It shows how much of a result is the problem's ease.

A peer's guess is stated when its generation is complete and counts all runs of that. Neither peer
ends by its own criterion in the count of runs: going on to the cap can only save it a failure.
"""
_NOT_MEASURED = """\
## Not measured

Other settings of the peers: larger generations, other targets of the effective sample size, other
first uncertainties. More than two parameters, or more than one measured value. GrainLearning's
other ways, such as a map of its own as a surrogate. Wall time: a DEM run outweighs every method's
arithmetic, but generations run side by side where there are cores, and one run after the other
does not.
"""


def _machine(found: dict[str, Any]) -> str:
    known = found["machine"]
    before = " after runs that an earlier call kept," if found.get("goes_on") else ","
    rows = [
        ["processor", f"{known['processor']}, {known['cores']} cores"],
        ["system", known["system"]],
        ["commit", found["commit"]],
        ["versions", ", ".join(f"{k} {v}" for k, v in found["versions"].items())],
        *(
            [f"environment of {name}", ", ".join(f"{k} {v}" for k, v in versions.items())]
            for name, versions in found["peers"].items()
        ),
        ["map", f"`{found['map']['file']}`, {found['map']['runs']} runs"],
        ["took", f"{found['measured_s']} s{before} load before {found['load_average']:.1f}"],
    ]
    return table(["", ""], rows)


def _noise(found: dict[str, Any]) -> str:
    noise = found["noise"]
    spread = "fitted with the emulator, since no point has two runs"
    if noise["freedom"]:
        spread = (
            f"{noise['low_deg']:.2f} to {noise['high_deg']:.2f} at 95 % from {noise['freedom']} "
            "degrees of freedom of replicates, pooled over the map"
        )
    return (
        f"One heap differs from the mean of its point by {noise['sd_deg']:.2f} degrees (standard "
        f"deviation; {spread}). The mean of three heaps is known to {found['mean_se_deg']:.2f} "
        "degrees, so a guess is good where the true mean lies within the larger of 0.5 degrees and "
        f"twice that: {found['tolerance_deg']:.2f} degrees.\n"
    )


def _quartiles(found: list[float | None], cap: int, starts: int) -> str:
    low, median, high = (f"> {cap}" if n is None else f"{n:.0f}" for n in found)
    return median if starts == 1 else f"{median} ({low} to {high})"


_MEDIANS = (
    "Medians over the starts, and quartiles in brackets; a failure counts as longer than anything."
)
_ONE = "From one start, which ranks no methods."


def _races(found: dict[str, Any]) -> str:
    cap, held = found["cap"], found["held_after"]
    rows = []
    for row in found["races"]:
        rows.append([
            f"{row['target_deg']:g}",
            row["method"],
            row["guess"],
            _quartiles(row["quartiles"], cap, row["seeds"]),
            f"{row['failures']} of {row['seeds']}",
            _quartiles(row["since_quartiles"], held, row["seeds"]),
            f"{row['not_good_after']} of {row['seeds']}",
        ])  # fmt: skip
    head = ["target, degrees", "method", "guess", "runs to the first good guess",
            f"none in {cap} runs", f"runs since which all are good, up to {held}",
            f"not good after {held}"]  # fmt: skip
    starts = _ONE if found["races"][0]["seeds"] == 1 else _MEDIANS
    words = (
        f"\n{starts} The least possible is 6 runs for sandmould, 10 for GrainLearning and 8 for "
        "coexist: their first guess. One good guess may be luck, as the control shows, so the "
        f"table also tells since when every guess was good, up to {held} runs. A guess after every "
        "run has more chances of the first and more chances to fail the second.\n"
    )
    # Methods that stop early would otherwise look as if they had gone on to the cap.
    ended = [
        f"\n{row['method']}, {row['target_deg']:g} degrees, ended before the cap: "
        f"{'; '.join(row['ended'])}.\n"
        for row in found["races"]
        if row["ended"]
    ]
    return table(head, rows) + words + "".join(dict.fromkeys(ended))


def _coverage(rows: list[dict[str, Any]]) -> str:
    cells = []
    for row in rows:
        agrees = row["low"] <= row["claimed"] <= row["high"]
        cells.append([
            row["method"],
            row["region"],
            f"{row['claimed']:.0%}",
            f"{row['held'] / row['truths']:.1%} ({row['low']:.1%} to {row['high']:.1%})",
            f"{row['truths']}",
            "yes" if agrees else "**no**",
        ])  # fmt: skip
    head = ["method", "region", "claimed", "held, 95 % interval", "truths", "claim in the interval"]
    return (
        "Truths are planted evenly over the map, measured with a standard deviation of 0.5 "
        "degrees, and calibrated. sandmould's map is simulated again with noise for each. "
        "GrainLearning runs until it ends by itself or for 80 runs; it takes no error of the "
        "measurement but chooses its own, so its region makes no claim about that error. coexist "
        "states no posterior.\n\n" + table(head, cells)
    )


def _dem_truths(rows: list[dict[str, Any]]) -> str:
    def numbers(values: dict[str, float | None]) -> str:
        return ", ".join("none" if v is None else f"{v:.4g}" for v in values.values())

    def found(by: dict[str, Any]) -> list[str]:
        if by["bits"] is None:
            return ["off the map", "–"]
        where = ", ".join(f"{m:.3f} ± {s:.3f}" for m, s in zip(by["mode"], by["sd"], strict=True))
        return [where, f"{'yes' if by['held'] else '**no**'}, {by['bits']:.1f} bits"]

    cells = [
        [
            ", ".join(f"{x:.3f}" for x in row["truth"]),
            numbers(row["measured"]),
            numbers(row["emulated"]),
            *found(row["by"]["first"]),
            *found(row["by"]["all"]),
        ]
        for row in rows
    ]
    first, *others = rows[0]["measured"]
    both = f"by both, {first} and {' and '.join(others)}"
    head = ["truth: friction, arm", "measured", "emulators there", f"found by {first} alone",
            "held, information", f"found {both}", "held, information"]  # fmt: skip
    return table(head, cells)


def page(kept: dict[str, Any]) -> str:
    """Write the page.

    Parameters
    ----------
    kept : dict
        What ``benchmarks.calibration`` measured, by oracle: ``emulator``, ``dem`` or both.
    """
    parts = [_HOW]
    first = next(iter(kept.values()))
    parts += [f"## Noise of one heap\n\n{_noise(first)}", _DRIVEN]
    if "emulator" in kept:
        found = kept["emulator"]
        parts += [
            "## Runs needed, on the emulator\n\nA run is the map's emulator with the noise of one "
            "heap. That surface is of the kind that sandmould fits, which favours sandmould; runs "
            f"by DEM (`--oracle dem`) favour nobody.\n\n{_races(found)}",
            f"## Coverage of planted truths\n\n{_coverage(found['coverage'])}",
            f"## Machine and versions\n\n{_machine(found)}",
        ]
    if "dem" in kept:
        found = kept["dem"]
        if found["races"]:
            parts.append(
                "## Runs needed, by DEM\n\nEvery run is a heap of the engine; a guess is judged by "
                f"the map's emulator.\n\n{_races(found)}"
            )
        parts += [
            "## Truths planted by DEM\n\nThe mean of three runs is the measured value of either "
            "measure; found is the most probable point with its standard deviations, held says "
            f"whether the 95 % region holds the truth.\n\n{_dem_truths(found['dem_truths'])}",
            f"## Machine and versions, DEM\n\n{_machine(found)}",
        ]
    return "\n".join([*parts, _NOT_MEASURED])

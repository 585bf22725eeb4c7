"""The reference engine as the rest of the house sees it."""

from __future__ import annotations

import importlib
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from sandmould.dem import source_files, source_hash
from sandmould.digest import SHORT
from sandmould.engines.bed_deck import step_meaning
from sandmould.engines.deck import Deck, exact
from sandmould.engines.deck_context import deck_context
from sandmould.engines.deck_lines import Lines
from sandmould.engines.program import Program
from sandmould.engines.session import Capabilities, Ranks, SandSession
from sandmould.runs.hashing import scenario_hash
from sandmould.scenario.contact import SYMBOLS
from sandmould.scenario.placement import PlannedLayer
from sandmould.scenario.scenario import Scenario
from sandmould.scenario.time_step import inertia_factor

GRAIN_STEPS_PER_S = 1.5e7
RANKS = Ranks.THREADS
RUNS_ITS_DECK = False
_LAWS = (("grain", "contact.grain_grain"), ("wall", "contact.grain_wall"))

CAPABILITIES = Capabilities(
    bends_meshes=(2, 3),
    bends_in_frames=("box", "laboratory"),
    repeats_windows=True,
    calls_movers=True,
    loads_of_every_step=True,
    moves_tables=True,
    moves_walls=True,
    changes_checks=True,
)


def installed_version() -> str:
    """Hash of the solver's sources."""
    return source_hash()


def installation_problem() -> None:
    """Find nothing missing: the solver comes with the house."""


def communicator() -> None:
    """There is none: ranks are threads of one process."""


def refuse(scenario: Scenario) -> None:
    """Refuse nothing: every term of the paper is there."""


def session_sources(scenario: Scenario) -> list[list[Path]]:
    """The solver, and how it is given a scene."""
    here = Path(__file__).parent
    session = [here / name for name in ("model.py", "moved_solver.py", "session.py")]
    return [source_files(), [*session, here.parent / "solid_surfaces.py"]]


def render_deck(program: Program, sources: Mapping[str, str], run: str, study: str) -> Deck:
    """Render the list of what the solver is given."""
    from sandmould.engines.reference.model import surfaces_of  # numba: no plan waits for it

    scenario = program.scenario
    d = scenario.dimension
    keys = [("gravity", "gravity_m_s2"), ("density", "sand.density_kg_m3")]
    keys += [("disc_thickness", "sand.disc_thickness_m")] if d == 2 else []
    keys += _damping_keys(scenario)
    keys += [
        (f"{law}_{name}", f"{key}.{last}") for law, key in _LAWS for name, last in SYMBOLS.items()
    ]
    context = deck_context(program, Lines(scenario, sources), run, study)
    context |= {
        "kernels": source_hash(),
        "keys": keys,
        "scenario_hash": scenario_hash(scenario)[:SHORT],
        "slip_normal": scenario.contact.slip_normal or "half_step",
        "inertia_factor": inertia_factor(scenario.sand, scenario.laws, scenario.time_step, d),
        "surfaces": surfaces_of(scenario).names,
        "planned_step_s": scenario.planned_step_s,
        "step_meaning": step_meaning(scenario),
    }
    return Deck.render("reference", context)


def write_deck(
    program: Program, sources: Mapping[str, str], folder: Path, run: str, study: str
) -> None:
    """Write ``deck.in``, which lists what the solver is given, and ``layers/``; the deck last."""
    (folder / "layers").mkdir(parents=True, exist_ok=True)
    for number, layer in enumerate(program.layers, start=1):
        path = folder / "layers" / f"layer_{number}.tsv"
        _write_layer(layer, path, program.scenario.dimension)
    render_deck(program, sources, run, study).write(folder)


def _damping_keys(scenario: Scenario) -> list[tuple[str, str]]:
    form = scenario.background_damping.form
    if form == "none":
        return []
    kind, end = form.split("_")[0], "_per_s" if form == "viscous" else ""
    return [
        (f"damping_{part}", f"background_damping.{kind}_{part}{end}")
        for part in ("translation", "rotation")
    ]


def _write_layer(layer: PlannedLayer, path: Path, d: int) -> None:
    """Write a planned layer as a table; heights count from its lowest point, or from the floor."""
    names, columns = [f"{axis}_m" for axis in "xyz"[:d]], [layer.radius_m, *layer.position_m.T]
    if layer.velocity_m_s is not None:
        names += [f"v{axis}_m_s" for axis in "xyz"[:d]]
        columns += [*layer.velocity_m_s.T]
    rows = ["\t".join(["class", "radius_m", *names])]
    for number, numbers in zip(
        layer.class_number.tolist(), np.column_stack(columns).tolist(), strict=True
    ):
        rows.append("\t".join([str(number), *map(exact, numbers)]))
    path.write_text("\n".join(rows) + "\n", encoding="utf-8")


def load_session(scenario: Scenario) -> None:
    """Import the solver."""
    importlib.import_module("sandmould.engines.reference.session")


def open_session(
    program: Program, folder: Path, log: Path, checkpoint: Path | None = None
) -> SandSession:
    """Open a session, afresh or from a checkpoint; the deck is for people alone."""
    from sandmould.engines.reference.session import ReferenceSession

    log.unlink(missing_ok=True)  # the solver says nothing; a pattern in its steps begins a log
    return ReferenceSession(program, checkpoint)

"""Break each law of the reference solver by 5 % and see which case notices.

Run as ``python -m tests.verification.mutations`` from the root; it writes
docs/developers/mutations.md. The exact values are those of the laws as they should be. Numbers of
a law are changed on their way into the solver; its structure in a copy of the sources.
"""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from benchmarks.frame import table
from sandmould import ROOT
from sandmould.dem import source_hash
from sandmould.dem.motion import COMPONENTWISE, ISOTROPIC
from sandmould.engines.reference import session as session_module
from sandmould.runs.files import write_text
from tests.verification.cases.catalogue import CASES

PAGE = ROOT / "docs" / "developers" / "mutations.md"
FACTOR = 1.05
SHOWN = 4
"""Cases named in the table; how many more notice is said."""


@dataclass(frozen=True)
class Mutation:
    """One broken law."""

    what: str
    equation: str
    dimensions: tuple[int, ...] = (2,)
    scene: Callable[[Any], Any] | None = None
    """Changes the scene that the solver is given."""
    grains: Callable[[Any], Any] | None = None
    """Changes the grains that the solver is given."""
    source: tuple[str, str, str] | None = None
    """File of ``sandmould/dem``, text that stands there once, and what takes its place."""


def _law(which: str, field: str) -> Callable[[Any], Any]:
    def change(scene: Any) -> Any:
        law = getattr(scene, which)
        return scene._replace(**{which: law._replace(**{field: FACTOR * getattr(law, field)})})

    return change


def _flipped(field: str) -> Callable[[Any], Any]:
    def change(scene: Any) -> Any:
        laws = {
            w: getattr(scene, w)._replace(**{field: not getattr(getattr(scene, w), field)})
            for w in ("grain_law", "wall_law")
        }
        return scene._replace(**laws)

    return change


def _damping(field: str) -> Callable[[Any], Any]:
    def change(scene: Any) -> Any:
        raised = FACTOR * getattr(scene.damping, field)
        return scene._replace(damping=scene.damping._replace(**{field: raised}))

    return change


def _other_form(scene: Any) -> Any:
    other = {ISOTROPIC: COMPONENTWISE, COMPONENTWISE: ISOTROPIC}
    form = scene.damping.form
    return scene._replace(damping=scene.damping._replace(form=other.get(form, form)))


def _grains(field: str) -> Callable[[Any], Any]:
    return lambda grains: grains._replace(**{field: FACTOR * getattr(grains, field)})


_FIELDS = (
    ("k_n", "(16)"),
    ("k_t", "(25)"),
    ("friction", "(26)"),
    ("damping_ratio", "(19)-(21)"),
    ("rolling_arm", "(30), (32)"),
    ("k_roll", "(29), regularised"),
)
LAW, KINDS, PAIRS = "contact_law.py", "moving_state.py", "pairs.py"
MOTION, STEPS = "motion.py", "steps.py"
MUTATIONS = (
    *(
        Mutation(f"{field} of {where}", equation, scene=_law(which, field))
        for field, equation in _FIELDS
        for which, where in (("grain_law", "two grains"), ("wall_law", "grain and wall"))
    ),
    Mutation("total instead of elastic force clipped, and the reverse", "(18)",
             scene=_flipped("clip_total")),
    Mutation("torsion resisted where it should not be, and the reverse", "(31)", (3,),
             scene=_flipped("torsion")),
    Mutation("background damping of speed", "(36), (38)", scene=_damping("translation")),
    Mutation("background damping of spin", "(37), (39)", scene=_damping("rotation")),
    Mutation("damping by components instead of isotropic, and the reverse", "(38)",
             scene=_other_form),
    Mutation("gravity", "(1)",
             scene=lambda s: s._replace(gravity=tuple(FACTOR * g for g in s.gravity))),
    Mutation("time step", "(4), (5)", scene=lambda s: s._replace(dt=FACTOR * s.dt)),
    Mutation("mass", "(3)", grains=_grains("mass_of")),
    Mutation("moment of inertia", "(6)", grains=_grains("inertia_of")),
    Mutation("position", "(5)",
             source=(PAIRS, "plus(x, dt, v)", "plus(x, 1.05 * dt, v)")),
    Mutation("spin", "(7)", source=(MOTION, "plus(w, dt / inert, torque)",
                                    "plus(w, 1.05 * dt / inert, torque)")),
    Mutation("angle", "(8)", source=("vectors.py", "orientation[i, 0] += angle[0]",
                                     "orientation[i, 0] += 1.05 * angle[0]")),
    Mutation("sine term of the rotation", "(11)", (3,),
             source=("vectors.py", "a = math.sin(size) / size",
                     "a = 1.05 * math.sin(size) / size")),
    Mutation("cosine term of the rotation", "(11)", (3,),
             source=("vectors.py", "b = (1.0 - math.cos(size)) / size2",
                     "b = 1.05 * (1.0 - math.cos(size)) / size2")),
    Mutation("force between two grains", "(14)",
             source=(PAIRS, "plus(force_i, 1.0,", "plus(force_i, 1.05,")),
    Mutation("mass of two grains", "(21)",
             source=(KINDS, "m_i * m_j / (m_i + m_j)", "1.05 * m_i * m_j / (m_i + m_j)")),
    Mutation("arm of the slip", "(23)",
             source=(LAW, "plus(times(w_1, arm_1), 1.0, times(w_2, arm_2))",
                     "plus(times(w_1, 1.05 * arm_1), 1.05, times(w_2, arm_2))")),
    Mutation("arm of the friction's moment", "(2)",
             source=(LAW, "moment_1 = times(turning, arm_1)",
                     "moment_1 = times(turning, 1.05 * arm_1)")),
    Mutation("arm of friction at walls: r instead of r - u", "(23)",
             source=("surface_contacts.py", "max(distance, 0.0), 0.0,", "r, 0.0,")),
    Mutation("sign of the slip", "(25)",
             source=(LAW, "-law.k_t * dt, spun)", "law.k_t * dt, spun)")),
    Mutation("limit of the elastic instead of the total force", "(26)",
             source=(LAW, "law.friction * abs(normal)", "law.friction * law.k_n * overlap")),
    Mutation("relative spin", "(31)", source=(LAW, "relative = plus(w_1, -1.0, w_2)",
                                              "relative = plus(w_1, -1.05, w_2)")),
    Mutation("larger instead of smaller radius", "(33)",
             source=(KINDS, "min(r_i, r_j)", "max(r_i, r_j)")),
    Mutation("effective radius of two grains", "(29), regularised",
             source=(KINDS, "r_i * r_j / (r_i + r_j)", "1.05 * r_i * r_j / (r_i + r_j)")),
    Mutation("load on the vertices", "(56)",
             source=("surface_contacts.py", "add_to(on_grain, -weights[j]",
                     "add_to(on_grain, -1.05 * weights[j]")),
    Mutation("velocity of the moving walls", "(57)",
             source=(STEPS, "way / scene.dt", "1.05 * way / scene.dt")),
    Mutation("body force of the moving frame", "(58)",
             source=(STEPS, "-(ahead - behind)", "-1.05 * (ahead - behind)")),
)  # fmt: skip


def noticing(dimensions: tuple[int, ...]) -> list[str]:
    """Cases that fail now on the reference engine."""
    found = []
    for case in CASES:
        if "reference" not in case.engines:
            continue
        for dimension in set(dimensions) & set(case.dimensions):
            try:
                holds = all(r.holds for r in case.run("reference", dimension))
            except Exception:  # a case that cannot even be read has noticed too
                holds = False
            if not holds and case.family not in found:
                found.append(case.family)
    return found


def _break(mutation: Mutation) -> None:
    """Change what the session hands to the solver, in this process."""
    for name, change in (("scene_of", mutation.scene), ("grains_of", mutation.grains)):
        if change is not None:
            usual = getattr(session_module, name)
            setattr(session_module, name, lambda *a, u=usual, c=change: c(u(*a)))


def _copy_of_sources(folder: Path, mutation: Mutation) -> None:
    """Lay out the sources with one text replaced."""
    shutil.copytree(ROOT / "sandmould", folder / "sandmould")
    for name in ("templates", "config", "tests", "benchmarks"):
        (folder / name).symlink_to(ROOT / name)
    if mutation.source is not None:
        file, old, new = mutation.source
        path = folder / "sandmould" / "dem" / file
        text = path.read_text(encoding="utf-8")
        if text.count(old) != 1:
            raise SystemExit(f"{file} holds {text.count(old)} times: {old}")
        path.write_text(text.replace(old, new), encoding="utf-8")


def run(index: int) -> list[str]:
    """Cases that notice a mutation, found by a process of its own."""
    mutation = MUTATIONS[index]
    with tempfile.TemporaryDirectory(prefix="mutation_") as name:
        folder, environment = Path(name), dict(os.environ)
        _copy_of_sources(folder, mutation)
        if mutation.source is not None:
            environment["XDG_CACHE_HOME"] = name  # kernels that nobody will want again
        ended = subprocess.run(
            [sys.executable, "-m", "tests.verification.mutations", str(index)],
            cwd=folder, env=environment, capture_output=True, text=True, check=False,
        )  # fmt: skip
    if ended.returncode:
        raise SystemExit(f"{mutation.what}: {ended.stderr[-2000:]}")
    found: list[str] = json.loads(ended.stdout.splitlines()[-1])
    print(
        f"{mutation.what} {mutation.equation}: {', '.join(found) or 'NOBODY NOTICES'}", flush=True
    )
    return found


def page(found: list[list[str]]) -> str:
    """The page."""
    rows = []
    for mutation, names in zip(MUTATIONS, found, strict=True):
        words = ", ".join(names[:SHOWN]) or "**nobody**"
        if len(names) > SHOWN:
            words += f" and {len(names) - SHOWN} more"
        rows.append([mutation.what, mutation.equation, words])
    noticed = {name for names in found for name in names}
    quiet = {case.family: 0 for case in CASES if "reference" in case.engines}
    idle = ", ".join(name for name in quiet if name not in noticed) or "none"
    return (
        "# Would a wrong law be noticed?\n\n"
        f"`python -m tests.verification.mutations`, reference solver {source_hash()}. Each law is "
        "made wrong by 5 %, or in its structure where that is said. The exact values stay right. "
        "A good set of cases notices every wrong law. "
        f"{sum(map(bool, found))} of {len(found)} mutations are noticed.\n\n"
        f"{table(['broken', 'equation', 'noticed by'], rows)}\n"
        f"These cases hold under any law, so they notice no wrong one: {idle}.\n"
    )


def main() -> int:
    if len(sys.argv) > 1:
        mutation = MUTATIONS[int(sys.argv[1])]
        _break(mutation)
        print(json.dumps(noticing(mutation.dimensions)))
        return 0
    sound = noticing((2, 3))
    if sound:
        raise SystemExit(f"cases fail already on the sound solver: {', '.join(sound)}")
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        found = list(pool.map(run, range(len(MUTATIONS))))
    write_text(PAGE, page(found))
    return 0 if all(found) else 1


if __name__ == "__main__":
    sys.exit(main())

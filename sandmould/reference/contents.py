"""What files a study and its runs leave, and what stands in them: the text of ``docs/files.md``.

A name may hold ``<...>``, which stands for that of a run, a probe, a tube, a surface and so on.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from sandmould.runs.formatting import unit_of

SWEPT = "<swept key>"
MEASURES = "<measure>"


@dataclass(frozen=True)
class Described:
    """A column of a table, a key of a file, or a field of a frame."""

    name: str
    meaning: str
    unit_text: str = ""
    """Where the name does not state it."""
    is_word: bool = False

    @property
    def unit(self) -> str:
        """As its name's ending states it; 1 for a pure number, nothing for words."""
        return "" if self.is_word else self.unit_text or unit_of(self.name) or "1"


@dataclass(frozen=True)
class File:
    """A file, or files of one kind."""

    name: str
    meaning: str
    columns: tuple[Described, ...] = ()


def _words(name: str, meaning: str) -> Described:
    return Described(name, meaning, is_word=True)


_CLOCK = (
    Described("time_s", "Simulated time since the run began."),
    Described(
        "vibration_time_s",
        "Time since the first vibration began; absent before it and where nothing vibrates. It "
        "stands while the sand comes to rest. Versions before 0.2 wrote -1 for absent.",
    ),
    _words("stage", "What is computed: settle_1, vibrate_1, rest, discharge, cooling, ..."),
)
_OF_RUN = (
    _words("run", "Name of the run, that of its folder."),
    Described(SWEPT, "Value of each key that is swept.", "of the key"),
    Described("replicate", "Number of the replicate; the same number has the same seed."),
)
_SEED = Described("seed", "What the places of the grains are drawn from.")
_PART = _words("part", "sweep, cross_check, or control: and its name.")
_COST = (
    _words("engine", "Engine that computed it."),
    _words("version", "Version of the engine."),
    Described("ranks", "Processes, or threads of the reference engine."),
    Described("time_step_s", "Time step."),
    Described("time_step_fraction", "Time step over the critical one."),
    Described(
        "bed_limit_s", "Exact critical step of the filled bed, where the step is taken from it."
    ),
    Described("least_limit_s", "Least exact critical step of the shaken bed."),
    Described("limit_moments", "Moments at which that was found."),
    Described("grains", "Grains at the end."),
    Described("elements", "Elements of a solidification."),
    Described("particles", "Particles of a flow at the end."),
    Described("steps", "Time steps."),
    Described("grain_steps", "Grains times steps, added up."),
    Described("element_steps", "Elements times steps, added up."),
    Described("particle_solves", "Particles times solutions of the pressure, added up."),
    Described("poisson_iterations", "Iterations of the pressure, added up."),
    Described("solver_fraction", "Share of the wall time of the steps that the pressure takes."),
    Described("grain_steps_per_s", "Grain-steps a second of the engine's wall time."),
    Described("element_steps_per_s", "Element-steps a second of the engine's wall time."),
    Described("particle_solves_per_s", "Particle-solves a second of the engine's wall time."),
    Described("wall_s", "Wall time of the run."),
    Described("engine_wall_s", "Wall time of the engine in it."),
    Described("cpu_s", "Processor time."),
    Described("peak_memory_bytes", "Largest memory."),
    Described("largest_overlap_fraction", "Largest overlap of the whole run, over a radius."),
    _words("fill", "Shared fill that the run began with."),
)
_MEASURES = Described(
    MEASURES, "All measures of the scene: [measures](measures.md), and own ones.", "of the measure"
)
_SUMMARY = (
    *_OF_RUN, _SEED, _PART,
    Described("outcome_code", "How it ended, as a number: 0 is finished."),
    _words("outcome", "The same in words."),
    _words("detail", "What the engine or a guard said of it."),
    Described("simulated_s", "Simulated time that it reached."),
    Described("planned_s", "Simulated time that was planned at most."),
    Described("measured_time_s", "Time at which the measures were taken."),
    Described("measured_vibration_time_s", "The same as time of vibration; absent where none is."),
    _words("measured_stage", "Stage at which the measures were taken."),
    Described("measured_grains", "Grains at that time."),
    Described("measured_largest_overlap_fraction", "Largest overlap at that time, over a radius."),
    _MEASURES, *_COST,
    Described("fill_wall_s", "Wall time of the shared fill, over the runs that share it."),
    Described("fill_cpu_s", "Processor time of the shared fill, over the runs that share it."),
)  # fmt: skip
_CURVES = (*_OF_RUN, _PART, _words("engine", "Engine that computed it."), *_CLOCK, _MEASURES)
_SNAPSHOT = (
    *_CLOCK,
    Described("id", "Number of the grain, from 1."),
    Described("layer", "Layer of the fill that brought the grain, from 1."),
    Described("position_m", "Places in the frame of the box: x, z in 2D; x, y, z in 3D."),
    Described("velocity_m_s", "Velocities relative to the box, as many numbers."),
    Described("spin_rad_s", "Angular velocities, three numbers; in 2D the last one alone."),
    Described("radius_m", "Radii."),
    Described("orientation", "Angle in rad (2D) or rotation matrix (3D), where record.orientation "
           "asks for it.", "rad or 1"),
    Described("pattern_m", "Vertices of the pattern's outer line, where it bends."),
    Described("pattern_load_n", "Force of the sand on each of them."),
)  # fmt: skip
_DUMP = (
    Described("id", "Number of the grain."),
    Described("type", "Layer of fill, so that OVITO colours layers at once; not the size class."),
    *(
        Described(name, "Place; y and z as in the deck, 0 for what 2D lacks.", "m")
        for name in "xyz"
    ),
    *(Described(f"v{name}", "Velocity relative to the box.", "m/s") for name in "xyz"),
    *(Described(f"omega{name}", "Angular velocity.", "rad/s") for name in "xyz"),
    Described("radius", "Radius.", "m"),
    Described("layer", "Layer of fill, as type."),
)
_JSON_OUTCOME = (
    Described("code", "How it ended: 0 is finished."),
    _words("outcome", "The same in words."),
    _words("meaning", "The same as a sentence."),
    _words("restartable", "Whether the same command can go on from the last checkpoint."),
    _words("detail", "What the engine or a guard said of it."),
    Described("simulated_s", "Simulated time that it reached."),
    Described("planned_s", "Simulated time that was planned at most."),
)
_JSON_PRODUCTS = (
    _words("deck", "Hash of the deck that was computed."),
    _words("origin", "Command, hashes, seed, commit, versions and machine."),
    _words("cost", "The cost columns of `summary.tsv`."),
    Described("computed", "Files that computing left, with their sizes.", "bytes"),
    Described("measured", "Files that measuring left, with their sizes.", "bytes"),
    _words(
        "measured_by", "Hash of our code that measured: where it changes, runs are measured again."
    ),
)
_SOLIDIFIED = (
    Described("solidified_fraction", "Share of the casting that is solid."),
    Described("enthalpy_j_m", "All heat; a metre deep in 2D."),
    Described("enthalpy_j", "All heat, 3D."),
)
_FLOWING = (
    Described("<probe>_pa", "Pressure at a probe."),
    Described("largest_speed_m_s", "Speed of the fastest particle."),
    Described("mean_speed_m_s", "Mean speed of all particles."),
    Described("kinetic_energy_j_kg", "Kinetic energy of the metal by its mass.", "J/kg"),
    Described("top_m", "Height of the highest particle."),
    Described("largest_rise_m_s", "Largest upward speed."),
    Described("particles", "Particles."),
    Described("step_iterations", "Iterations of the pressure in the step."),
)
_FIELDS = (
    Described("position_m", "Middles of elements, or places of particles frame after frame."),
    Described("size_m", "Sides of elements."),
    Described("volume_m3", "Volumes of elements; a metre deep in 2D."),
    Described("melts", "Whether an element is metal."),
    Described("frozen_s", "When it froze; NaN where it has not."),
    Described("temperature_k", "Temperatures at the end."),
    Described("time_s", "Times of the frames of a flow."),
    Described("count", "Particles of each frame."),
    Described("velocity_m_s", "Velocities of particles."),
    Described("pressure_pa", "Pressures of particles."),
    Described("wall_m", "Places of the walls' particles."),
    Described("particle_m", "Spacing of particles."),
)
_PATTERN = (
    Described("time_s", "End of the window."),
    Described("window_s", "Its length."),
    Described("passes", "Times that it was computed."),
    Described("factor", "Relaxation factor of the next displacement."),
    Described("gain", "Last measured gain."),
    Described("residual_m", "Displacement that the loads give less the one at the interface."),
    Described("displacement_m", "Root mean square displacement at the interface."),
    Described("largest_m", "Largest displacement at the interface."),
    Described("load_n", "Mean force of the sand on the pattern."),
    Described("imbalance_n", "Sum of that force and the reaction of the supports."),
    Described("moment_left_n_m", "Moment of both about the origin.", "N m"),
    Described("work_j", "Work of the sand on the interface so far."),
    Described("energy_j", "Elastic energy of the pattern."),
    Described("solve_s", "Wall time of the pattern's solution."),
    Described("contact_n", "Force of floor, walls and obstacles on the pattern."),
    Described("contact_j", "Work against these forces so far."),
)
_TABLE = (
    *_CLOCK[1:],
    Described("displacement_m", "Amplitude of the table at the frequency of the drive."),
    Described("phase_deg", "Lag behind the force of the rotating masses."),
    Described("largest_displacement_m", "Half the way between its highest and lowest place."),
    Described("largest_acceleration_g", "Largest acceleration, impacts included."),
    Described("unbalance_work_j", "Work of the rotating masses."),
    Described("mount_loss_j", "What the mounts take."),
    Described("sand_work_j", "Work on the sand."),
    Described("table_energy_j", "Energy of table and mounts."),
)

OF_STUDY: tuple[File, ...] = (
    File("study.yaml", "The study as planned, with all that it is based on."),
    File("study_file.txt", "The study's file that the results belong to."),
    File("runs.tsv", "The plan: one row per run.", (*_OF_RUN, _SEED, _PART, _COST[-1])),
    File("summary.tsv", "One row per run of the sweep.", _SUMMARY),
    File("summary_checks.tsv", "One row per run that checks the sweep: another engine, controls.",
         _SUMMARY),
    File("curves.tsv", "One row per snapshot of a run of the sweep.", _CURVES),
    File("curves_checks.tsv", "One row per snapshot of a run that checks the sweep.", _CURVES),
    File("agreement.tsv", "One row per compared pair of settings and measure.", (
        _words("at", "Setting of the other keys."),
        _words("key", "Key that the pair differs in."),
        _words("first", "Its first value."),
        _words("second", "Its second value."),
        _words("measure", "What is compared."),
        Described("mean_first", "Mean at the first value.", "of the measure"),
        Described("mean_second", "Mean at the second value.", "of the measure"),
        Described("difference", "First minus second.", "of the measure"),
        Described("ci_low", "Lower end of its interval.", "of the measure"),
        Described("ci_high", "Upper end of its interval.", "of the measure"),
        Described("margin", "Difference that still counts as agreement.", "of the measure"),
        Described("n", "Runs of each."),
        _words("paired", "Whether replicates are compared pair by pair."),
        _words("verdict", "equivalent, different, not resolved or not tested."),
        _words("note", "What to know of it."),
    )),
    File("report.html", "The report; it opens offline."),
    File("verdict.txt", "Its first sentence."),
    File("figures/<name>.svg", "Its charts."),
    File("figures/.snakemake_timestamp", "Mark of Snakemake."),
    File("figures/<name>.png", "Its pictures of sand, pattern, heat and flow."),
    File("spheres/<name>.js", "All grains of a film that the page holds a part of, 3D."),
    File("rounds.json", "What each round of `refine` added, and why."),
    File("all_runs_finished", "Mark: the check of all runs is done."),
    File("batches/<name>.done", "Mark: the runs of one job are whole."),
    File("logs/<name>.log", "What jobs said."),
    File("logs/<name>.txt", "The same, of the screen."),
    File("lock", "Held while a command writes the results."),
    File("lock_owner", "Who holds it."),
    File("fills/<fill>/", "A fill that runs share: the files of a run, and its last state."),
    File("runs/<run>/", "A folder a run: see below."),
)  # fmt: skip
"""Files of ``results/<study>``."""
OF_ALL: tuple[File, ...] = (
    File("calibration.json", "How fast the engines are on this machine, for the price of plans."),
    File(
        "materials/<sand>.yaml", "Sands that studies have calibrated; `material: <sand>` uses one."
    ),
)
"""Files of ``results``."""
OF_RUN: tuple[File, ...] = (
    File("scenario.yaml", "The run as planned: scenario, parameters, sources of values."),
    File("deck.in", "What the engine was given."),
    File("layers/layer_<n>.tsv", "Where the grains of a layer begin, reference engine.", (
        Described("class", "Size class, from 1."),
        Described("radius_m", "Radius."),
        Described("x_m", "Place along the width."),
        Described("y_m", "Place: the height in 2D, the depth in 3D."),
        Described("z_m", "Place: the height in 3D."),
    )),
    File("layers/<name>", "Where the grains of a layer begin, as LAMMPS and LIGGGHTS read it."),
    File("<name>.stl", "Walls and meshes as LIGGGHTS reads them."),
    File("outcome.json", "How it ended; written last.", _JSON_OUTCOME),
    File("products.json", "Where it comes from, what it cost, its files.", _JSON_PRODUCTS),
    File("series.tsv", "One row per record.", (
        *_CLOCK,
        Described("grains", "Grains in the box."),
        Described("kinetic_energy_j", "Kinetic energy of all grains."),
        Described("rms_speed_m_s", "Root mean square speed of the grains, by mass."),
        Described("largest_overlap_fraction", "Largest overlap over a radius."),
        Described("<probe>_k", "Temperature at a probe of a solidification."),
        *_SOLIDIFIED, *_FLOWING,
        Described(MEASURES, "Measures of an own deck.", "of the measure"),
        Described("log_<column>", "Columns of its log.", "as in the log"),
    )),
    File("loads.tsv", "Force of the sand on each surface, its mean since the last record.", (
        *_CLOCK,
        _words("surface", "Wall or obstacle."),
        Described("force_<axis>_n", "Force along x, y or z."),
    )),
    File("measures.tsv", "One row per record: all measures.", (*_CLOCK, _MEASURES)),
    File("profile.tsv", "Solid fraction against height at moments of the vibration.", (
        _words("moment", "At its start, after 1/8, after 1/2, at its end."),
        _CLOCK[1],
        Described("height_m", "Middle of the slab."),
        Described("solid_fraction", "Share of grains in it."),
    )),
    File("loose_zones.tsv", "One row per zone of loose sand in 3D.", (
        Described("<axis>_m", "Its middle."),
        Described("volume_m3", "Its volume."),
        Described("solid_fraction", "Mean of the local one."),
        _words("side", "Where it lies: under, over or beside an obstacle, or away from all."),
    )),
    File("table.tsv", "One row per period of a table on mounts.", _TABLE),
    File("pattern.tsv", "One row per window of the loop between sand and pattern.", _PATTERN),
    File("pattern_shapes.f8", "Time and displacements of the pattern's surface, 64-bit numbers."),
    File("snapshots.npz", "All grains: `numpy.load(...)[\"000005/position_m\"]` is the sixth "
         "snapshot's.", _SNAPSHOT),
    File("fields.npz", "Fields of a solidification at its end, or frames of a flow.", _FIELDS),
    File("fields.vtu", "The fields of a solidification for ParaView: frozen_s, temperature_k, "
         "melts."),
    File("exports.zip", "Some snapshots for ParaView and OVITO."),
    File("exports.zip/<number>.dump", "A frame for OVITO. TIMESTEP is the simulated time in "
         "microseconds, TIME in seconds.", _DUMP),
    File("exports.zip/<number>.vtu", "The same for ParaView, with the names of `snapshots.npz`."),
    File("exports.zip/solids.vtu", "Surfaces of the solids; cells have the number of their solid."),
    File("exports/pattern_<moment>.stl", "The bent pattern after filling and at the end."),
    File("exports/pattern_<moment>.vtu", "The same surface with its loads."),
    File("final.png", "Picture of the end."),
    File("engine.log", "What the engine said."),
    File("pattern.log", "What the pattern's side said."),
    File("output/<name>", "What an own deck writes."),
    File("end_checkpoint/<name>", "State at the end of a fill that runs share."),
    File("lock", "Held while the run is computed."),
    File("lock_owner", "Who holds it."),
    File("compute_again.txt", "Mark of the plan: why the run is computed again."),
    File("measure_again.txt", "Mark of the plan: why the run is measured again."),
    File("work/<name>", "What a run that goes on has written, with its checkpoints."),
    File("last_work/<name>", "The same of a run that failed."),
)  # fmt: skip
"""Files of ``results/<study>/runs/<run>``."""


def files_lines() -> Iterator[str]:
    """The page: lists of files, each table of columns once."""
    for title, where, files in (
        ("All studies", "results/", OF_ALL),
        ("A study", "results/<study>/", OF_STUDY),
        ("A run", "results/<study>/runs/<run>/", OF_RUN),
    ):
        yield from (
            "",
            f"## {title}",
            "",
            f"In `{where}`; each where the kind of study has it:",
            "",
        )
        yield from ("| file | what it is |", "| --- | --- |")
        yield from (f"| `{file.name}` | {file.meaning} |" for file in files)
    said: dict[tuple[Described, ...], str] = {}
    for file in (*OF_STUDY, *OF_RUN):
        if not file.columns:
            continue
        yield from ("", f"### `{file.name}`", "")
        if file.columns in said:
            yield f"As `{said[file.columns]}`."
            continue
        said[file.columns] = file.name
        yield from ("| name | unit | meaning |", "| --- | --- | --- |")
        yield from (f"| `{c.name}` | {c.unit} | {c.meaning} |" for c in file.columns)

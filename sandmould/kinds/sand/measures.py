"""Measures of a run of sand."""

from __future__ import annotations

from sandmould.runs.measures import Measure, MeasureGroup, once
from sandmould.scenario.drive import ACCELERATION, DISPLACEMENT, VELOCITY
from sandmould.scenario.scenario import Scenario


def _bores(scenario: Scenario, dimension: int) -> list[str]:
    """Names of the tubes of a scene of a dimension."""
    return [bore.name for bore in scenario.scene.bores] if scenario.dimension == dimension else []


def _cavities(scenario: Scenario, dimension: int) -> list[str]:
    """Names of the cavities of a scene of a dimension."""
    names = [cavity.name for cavity in scenario.cavities]
    return names if scenario.dimension == dimension else []


def _gate(scenario: Scenario, is_level: bool) -> bool:
    return scenario.gate is not None and scenario.gate.is_level == is_level


def _windows(scenario: Scenario) -> bool:
    """Whether the log of the loop has windows."""
    return scenario.pattern is not None and scenario.pattern.loop.scheme != "monolithic"


def _foreseen(scenario: Scenario) -> bool:
    """Whether the gain of the loop is foreseen."""
    pattern = scenario.pattern
    return pattern is not None and scenario.dimension == 2 and pattern.loop.has_windows


def seeks_loose_sand(scenario: Scenario) -> bool:
    """Whether something is buried that sand may lie loose round, and stays."""
    return scenario.dimension == 3 and bool(scenario.scene.solids) and scenario.gate is None


MEASURES: tuple[MeasureGroup[Scenario], ...] = (
    MeasureGroup(
        "every scene",
        lambda scenario: once(),
        (
            Measure("grains", "Grains in the box."),
            Measure("bed_height_m", "Mean height of the bed's surface."),
            Measure("solid_fraction", "Share of grains in the space from the floor to there."),
            Measure(
                "apparent_density_raw_kg_m3",
                "Apparent density by the formula as printed: Rojek 2004, eq. (55).",
            ),
            Measure(
                "apparent_density_corrected_kg_m3",
                "The same, corrected for the space that walls and obstacles take.",
            ),
            Measure("coordination", "Mean number of contacts of a grain."),
            Measure(
                "coordination_bearing",
                "The same of grains that bear: two contacts in 2D, three in 3D.",
            ),
            Measure("bearing_fraction", "Share of the grains that bear."),
            Measure("largest_overlap_fraction", "Largest overlap over the smaller radius."),
            Measure(
                "overlap_p99_fraction",
                "Overlap over the smaller radius that 99 of 100 contacts do not exceed.",
            ),
            Measure(
                "layer_mixing_index",
                "How far the layers of the fill are mixed: 0 as filled, 1 at random.",
            ),
        ),
    ),
    MeasureGroup(
        "with a tube, by its name",
        lambda scenario: [*_bores(scenario, 2), *_bores(scenario, 3)],
        (
            Measure(
                "<tube>_fill_fraction",
                "Sand in the tube <tube> over its space: a dense bed gives its solid fraction.",
            ),
            Measure(
                "<tube>_fill_of_bed_fraction",
                "Sand in the tube <tube> over what it would hold as densely filled as the bed.",
            ),
            Measure("<tube>_front_depth_m", "How far sand has come into the tube <tube>."),
            Measure("<tube>_grains", "Grains in the tube <tube>."),
        ),
    ),
    MeasureGroup(
        "with a tube, in 2D",
        lambda scenario: _bores(scenario, 2),
        (Measure("<tube>_sand_m2", "Area of the grains in the tube <tube>."),),
    ),
    MeasureGroup(
        "with a tube, in 3D",
        lambda scenario: _bores(scenario, 3),
        (Measure("<tube>_sand_m3", "Volume of the grains in the tube <tube>."),),
    ),
    MeasureGroup(
        "with a cavity, by its name",
        lambda scenario: [*_cavities(scenario, 2), *_cavities(scenario, 3)],
        (
            Measure(
                "<cavity>_fill_fraction",
                "Sand in the cavity <cavity> over its space: a dense bed gives its solid fraction.",
            ),
            Measure(
                "<cavity>_fill_of_bed_fraction",
                "Sand in the cavity <cavity> over what it would hold as densely filled as the bed.",
            ),
            Measure("<cavity>_grains", "Grains in the cavity <cavity>."),
            Measure(
                "<cavity>_filled_depth_m",
                "Filled length of the cavity <cavity>, from its mouth inwards: of slabs one "
                "mass-median grain thick, those at least half as dense as the bed.",
            ),
            Measure(
                "<cavity>_voids",
                "Number of voids in the cavity <cavity> in which one more mass-median grain would "
                "fit. Places where such grains would overlap count once.",
            ),
            Measure(
                "<cavity>_void_fraction",
                "Space that such grains would cover, over the space of the cavity <cavity>.",
            ),
        ),
    ),
    MeasureGroup(
        "with a cavity, in 2D",
        lambda scenario: _cavities(scenario, 2),
        (
            Measure("<cavity>_sand_m2", "Area of the grains in the cavity <cavity>."),
            Measure("<cavity>_largest_void_m2", "Area of the largest void in <cavity>."),
        ),
    ),
    MeasureGroup(
        "with a cavity, in 3D",
        lambda scenario: _cavities(scenario, 3),
        (
            Measure("<cavity>_sand_m3", "Volume of the grains in the cavity <cavity>."),
            Measure("<cavity>_largest_void_m3", "Volume of the largest void in <cavity>."),
        ),
    ),
    MeasureGroup(
        "with obstacles in 3D, and no gate; of the last record",
        lambda scenario: once(seeks_loose_sand(scenario)),
        (
            Measure(
                "loose_fraction",
                "Share of the bed where sand lies loose: in a ball of three mass-median grains it "
                "is below 0.9 of what the bed has as far from a surface.",
            ),
            Measure(
                "loose_under_fraction",
                "The same of the places straight under an obstacle, within three such grains of "
                "it.",
            ),
            Measure("loose_over_fraction", "The same of those straight over one, as near."),
            Measure("loose_beside_fraction", "The same of those near one, and neither of both."),
            Measure("loose_away_fraction", "The same of those farther than three grains away."),
            Measure("loose_zones", "Zones of loose sand at least as large as a grain."),
            Measure("largest_loose_zone_m3", "Volume of the largest of them."),
        ),
    ),
    MeasureGroup(
        "with vibration",
        lambda scenario: once(bool(scenario.vibrations)),
        (
            Measure(
                DISPLACEMENT,
                "Amplitude of the box's motion at the frequency of its drive, as laid down. With "
                "hold unbalance it is measured between the ramps, in the second half so far.",
            ),
            Measure(VELOCITY, "The same of its velocity."),
            Measure(ACCELERATION, "The same of its acceleration."),
        ),
    ),
    MeasureGroup(
        "with a discharge",
        lambda scenario: once(scenario.gate is not None),
        (
            Measure("outflow_fraction", "Share of the sand's mass that has flowed out."),
            Measure("outflow_time_s", "Time until 95 % of what flows out is out."),
            Measure(
                "side_load_fraction",
                "Horizontal load on all that holds the sand before it flows, over its weight.",
            ),
            Measure(
                "heap_touches",
                "Walls that hold the heap: it has no slope then, and no run-out.",
                is_number=False,
            ),
        ),
    ),
    MeasureGroup(
        "with a discharge through a level gate",
        lambda scenario: once(_gate(scenario, is_level=True)),
        (
            Measure("heap_angle_deg", "Slope of the heap on the floor."),
            Measure("heap_angle_se_deg", "Its standard error."),
            Measure("residue_angle_deg", "Slope of the sand that stays over the gate."),
            Measure("residue_angle_se_deg", "Its standard error."),
        ),
    ),
    MeasureGroup(
        "with a discharge through a level gate, in 2D",
        lambda scenario: once(scenario.dimension == 2 and _gate(scenario, is_level=True)),
        (
            Measure("heap_angle_left_deg", "Slope of the heap's left flank."),
            Measure("heap_angle_right_deg", "Slope of the heap's right flank."),
        ),
    ),
    MeasureGroup(
        "with a discharge through an upright gate",
        lambda scenario: once(_gate(scenario, is_level=False)),
        (Measure("run_out_m", "How far the heap reaches beyond the gate."),),
    ),
    MeasureGroup(
        "with a pattern",
        lambda scenario: once(scenario.pattern is not None),
        (
            Measure("pattern_tip_deflection_m", "How far the pattern's tip has sunk."),
            Measure("pattern_largest_displacement_m", "Largest displacement of a vertex."),
            Measure("pattern_distance_largest_m", "Largest distance from the drawing."),
            Measure("pattern_distance_rms_m", "Root mean square distance from the drawing."),
            Measure(
                "pattern_tip_answered_m",
                "Deflection of the tip at rest under the mean load of the record.",
            ),
            Measure("pattern_tip_filled_m", "Deflection of the tip after filling."),
            Measure("pattern_tip_recovered_m", "What vibration gave back of the tip's deflection."),
            Measure(
                "pattern_pressure_above_pa",
                "Vertical load of the sand on what faces up, over its area: mean of the record.",
            ),
            Measure("pattern_pressure_below_pa", "The same on what faces down."),
            Measure("pattern_work_j", "Work of the sand on the pattern."),
            Measure("pattern_energy_j", "Energy in the pattern, mean since the snapshot before."),
            Measure("pattern_stored_fraction", "That energy over that work."),
            Measure("pattern_outside_fraction", "Share of the wall time that the pattern took."),
            Measure(
                "pattern_loop_error_fraction",
                "How far the shape may be off by the loop, over its displacement: the residual, or "
                "as far as energy that the loop made would bend the pattern.",
            ),
            Measure("pattern_loop", "Whether the loop holds, lags or cycles.", is_number=False),
        ),
    ),
    MeasureGroup(
        "with a pattern, in 2D",
        lambda scenario: once(scenario.pattern is not None and scenario.dimension == 2),
        (Measure("pattern_under_fraction", "Share of sand in the space under the pattern."),),
    ),
    MeasureGroup(
        "with a pattern, in 2D, where sand and pattern take turns (no in_step, no monolithic)",
        lambda scenario: once(_foreseen(scenario)),
        (
            Measure("pattern_predicted_gain", "Gain of the loop, foreseen from the scene."),
            Measure("pattern_predicted_limit", "Largest factor at which it should hold."),
        ),
    ),
    MeasureGroup(
        "with a pattern, in all schemes but monolithic",
        lambda scenario: once(_windows(scenario)),
        (
            Measure("pattern_residual_fraction", "Residual of the loop over the displacement."),
            Measure(
                "pattern_force_left_fraction", "Force that load and supports leave, over the load."
            ),
            Measure("pattern_moment_left_fraction", "Moment left, over load and reach."),
            Measure("pattern_factor", "Relaxation factor of the last window."),
            Measure("pattern_gain", "Gain that was measured last; in the scheme measured."),
            Measure("pattern_windows", "Windows so far."),
            Measure("pattern_passes", "Times that windows were computed so far."),
        ),
    ),
)

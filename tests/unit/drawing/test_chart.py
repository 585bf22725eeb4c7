"""Charts in pixels, and numbers in words."""

from __future__ import annotations

import math

import numpy as np
import pytest
from matplotlib.colors import to_rgb

from sandmould.drawing.chart import NARROW, WIDE, Chart, Line, Mark, lay_out, tints
from sandmould.runs.formatting import (
    display_scale,
    listed,
    name_of,
    number,
    range_text,
    seconds,
    setting_text,
    size,
    titled,
    unit_of,
    value_text,
    with_margin,
)


def curve(level: float, label: str = "") -> Line:
    return Line(np.array([[0.0, 0.0], [2.0, level]]), label=label)


@pytest.mark.parametrize("drawing", [WIDE, NARROW])
def test_curves_fill_the_axes_and_labels_keep_apart(drawing: tuple[int, int]) -> None:
    lines = tuple(curve(0.5 + 0.001 * n, f"{n} Hz") for n in range(12))
    laid = lay_out(Chart("time, s", "fill", "alt", lines), drawing)
    heights = sorted(line.label_y for line in laid.lines)
    assert np.diff(heights).min() >= 15.0 - 1e-9
    assert min(heights) >= 0
    assert max(heights) <= laid.height
    ends = {line.end[0] for line in laid.lines}
    assert ends == {laid.x.end}
    widest = max(8.0 * len(line.line.label) for line in laid.lines)
    assert laid.x.end + 9 + widest <= laid.width


def test_labels_of_means_that_end_early_stand_beyond_all_curves() -> None:
    short, whole = np.array([[0.0, 0.5], [0.6, 0.4]]), np.array([[0.0, 0.5], [1.0, 0.4]])
    lines = (Line(short, style="mean", label="5 mm"), Line(whole, style="mean", label="1 mm"))
    laid = lay_out(Chart("time, s", "fill", "alt", (*lines, Line(short, label="best"))), WIDE)
    early, late, upright = laid.lines
    assert early.end[0] < late.end[0]
    assert early.label_x == late.label_x > laid.x.end
    assert upright.end[0] < upright.label_x < laid.x.end


def test_ticks_are_round_and_inside() -> None:
    laid = lay_out(Chart("time, s", "fill", "alt", (curve(0.62),)), WIDE)
    assert [t.text for t in laid.x_ticks][:3] == ["0.0", "0.2", "0.4"]
    assert all(laid.x.start - 1e-9 <= t.at <= laid.x.end + 1e-9 for t in laid.x_ticks)
    assert [t.text for t in laid.y_ticks] == ["0.0", "0.1", "0.2", "0.3", "0.4", "0.5", "0.6"]


def test_given_ticks_do_not_run_into_each_other() -> None:
    marks = tuple(Mark(float(x), 0.5, "run") for x in (15, 16, 17, 150))
    chart = Chart("frequency, Hz", "fill", "alt", marks=marks, x_ticks=(15.0, 16.0, 17.0, 150.0))
    assert [t.text for t in lay_out(chart, NARROW).x_ticks] == ["15", "", "", "150"]


def test_intervals_stand_or_lie() -> None:
    mean = Mark(50.0, 0.5, "mean", half_width=0.1)
    standing = lay_out(Chart("x", "y", "alt", marks=(mean,)), WIDE)
    interval = standing.marks[0].interval
    assert interval is not None
    assert interval[0] == interval[2]
    assert interval[1] - interval[3] == pytest.approx(standing.y.at(0.4) - standing.y.at(0.6))
    row = Mark(0.5, 0.0, "mean", half_width=0.1)
    lying = lay_out(Chart("x", "", "alt", marks=(row,), rows=("a", "b")), WIDE)
    interval = lying.marks[0].interval
    assert interval is not None
    assert interval[1] == interval[3]


def test_failed_mark_stands_at_the_foot_and_moves_no_axis() -> None:
    marks = (Mark(50.0, 0.5, "run"), Mark(60.0, 0.6, "run"), Mark(60.0, math.nan, "failed"))
    laid = lay_out(Chart("x", "y", "alt", marks=marks), WIDE)
    assert laid.marks[2].y == laid.y.start - 8
    assert laid.y.low > 0.4


def test_gaps_and_nothing_at_all_are_drawn_without_error() -> None:
    broken = Line(np.array([[0.0, math.nan], [1.0, 2.0], [2.0, 3.0]]))
    empty = Line(np.full((2, 2), math.nan))
    laid = lay_out(Chart("x", "y", "alt", (broken, empty)), WIDE)
    assert len(laid.lines) == 1
    assert "nan" not in laid.lines[0].path
    assert lay_out(Chart("x", "y", "alt"), WIDE).lines == ()
    flat = lay_out(Chart("x", "y", "alt", (Line(np.array([[0.0, 3.0], [1.0, 3.0]])),)), WIDE)
    assert flat.y.low < 3.0 < flat.y.high


def brightness(colour: str) -> float:
    r, g, b = to_rgb(colour)
    return 0.2126 * r + 0.7152 * g + 0.0722 * b


def test_colours_of_a_scale_rise_in_brightness_and_stand_out_from_their_page() -> None:
    for page in ("light", "dark"):
        bright = [brightness(getattr(t, page)) for t in tints(8, True)]
        assert bright == sorted(bright)
        assert max(bright) < 0.75 if page == "light" else min(bright) > 0.25
    assert len({t.light for t in tints(7, False)}) == 7
    assert len(tints(20, False)) == 20


@pytest.mark.parametrize(
    ("key", "name", "unit"),
    [
        ("vibration.0.frequency_hz", "frequency", "Hz"),
        ("contact.grain_grain.normal_stiffness_n_m", "normal stiffness", "N/m"),
        ("gravity_m_s2", "gravity", "m/s²"),
        ("sand.density_kg_m3", "density", "kg/m³"),
        ("tube_fill_fraction", "fill of the tube", ""),
        ("blind_bore_fill_fraction", "fill of the blind bore", ""),
        ("contact.grain_grain.friction", "friction", ""),
        ("sand.disc_thickness_m", "disc thickness", "m"),
    ],
)
def test_names_and_units_of_keys(key: str, name: str, unit: str) -> None:
    assert (name_of(key), unit_of(key)) == (name, unit)


def test_words() -> None:
    assert titled("vibration.0.frequency_hz") == "frequency, Hz"
    assert display_scale("bed_height_m") == (1e3, "bed height, mm")
    assert value_text("vibration.0.hold", "velocity") == "velocity"
    assert value_text("pattern.material.young_modulus_pa", 6.4e6) == "6.4 MPa"
    assert value_text("contact.grain_grain.normal_stiffness_n_m", 1e6) == "1 MN/m"
    assert value_text("probe_pa", 200.0) == "200 Pa"
    assert range_text("pattern.material.young_modulus_pa", 8e5, 6.4e6) == "0.800 to 6.4 MPa"
    assert range_text("vibration.0.frequency_hz", 15.0, 24.5) == "15 to 24.5 Hz"
    assert setting_text({"vibration.0.frequency_hz": 65.0}) == "65 Hz"
    assert setting_text({"contact.grain_grain.friction": 0.8}) == "friction 0.8"
    assert setting_text({}) == "the one setting"
    assert listed(["a", "b", "c"]) == "a, b and c"
    assert listed(list("abcdef")) == "a, b, c and 3 others"
    assert listed(["x 1, y 2", "x 2, y 2", "z"]) == "x 1, y 2; x 2, y 2 and z"
    assert (seconds(3.5), seconds(600), seconds(86400)) == ("3.50 s", "10 min", "24 h")
    assert (size(2.5e8), size(12)) == ("250 MB", "12 B")


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (0.54217, "0.542"), (-0.5, "−0.500"), (12345.0, "12\u202f345"), (0, "0"),
        (1.2e-7, "1.20e−07"), (math.nan, "–"), ("word", "word"), (1.5, "1.50"), (3.0, "3"),
    ],
)  # fmt: skip
def test_numbers(value: object, text: str) -> None:
    assert number(value) == text


def test_means_have_the_digits_of_their_margin() -> None:
    assert with_margin(0.54217, 0.0071) == "0.5422 ± 0.0071"
    assert with_margin(0.54217, 0.0131) == "0.542 ± 0.013"
    assert with_margin(0.54217, math.nan) == "0.542"
    assert with_margin(1830.4, 12.3) == "1830 ± 12"


@pytest.mark.parametrize("drawing", [WIDE, NARROW])
def test_logarithmic_axes_have_decades_of_one_length(drawing: tuple[int, int]) -> None:
    marks = tuple(Mark(x, y, "mean", label=f"{x:g}") for x, y in ((1, 0.01), (10, 1), (100, 100)))
    none = Mark(10.0, 0.0, "mean")
    laid = lay_out(
        Chart("time, s", "error, %", "alt", marks=(*marks, none), log_x=True, log_y=True), drawing
    )
    assert [mark.mark for mark in laid.marks] == list(marks)
    for places in ([m.x for m in laid.marks], [m.y for m in laid.marks]):
        assert np.diff(places, 2) == pytest.approx([0.0])
    assert [t.text for t in laid.x_ticks if t.text in ("1", "10", "100")] == ["1", "10", "100"]
    assert {"0.01", "1", "100"} <= {t.text for t in laid.y_ticks}
    assert laid.x.start < laid.marks[0].x < laid.marks[-1].x < laid.x.end
    assert math.isnan(laid.y.at(0.0))


def test_one_value_on_logarithmic_axes_has_ticks_beside_it() -> None:
    one = Chart("x", "y", "alt", marks=(Mark(0.2, 3e-4, "mean"),), log_x=True, log_y=True)
    laid = lay_out(one, WIDE)
    assert laid.x.low < 0.2 < laid.x.high
    assert laid.y_ticks or laid.x_ticks


def test_what_reaches_to_zero_ends_at_the_foot_of_a_logarithmic_axis() -> None:
    rising = Line(np.array([[0.0, 0.0], [1.0, 1e-4], [2.0, 10.0]]))
    mean = Mark(2.0, 0.1, "mean", half_width=0.2)
    laid = lay_out(Chart("time, s", "energy, J", "alt", (rising,), (mean,), log_y=True), WIDE)
    interval = laid.marks[0].interval
    assert interval is not None
    assert interval[1] == laid.y.start
    assert laid.lines[0].path.endswith(f"{laid.lines[0].end[1]:.1f}")
    assert "nan" not in laid.lines[0].path
    assert not laid.x.is_logarithmic

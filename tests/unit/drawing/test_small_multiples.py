"""Charts with many lines: a panel a setting, or one chart where the curves lie on each other."""

from __future__ import annotations

import numpy as np

from sandmould.drawing.chart import Chart, Line, Tint
from sandmould.drawing.small_multiples import MOST_PANELS, PANEL, small_multiples


def chart(count: int, step: float = 0.1) -> Chart:
    """Means of so many settings, each a step above the last, with a run beside it."""
    x = np.linspace(0.0, 2.0, 1000)
    lines = []
    for place in range(count):
        name, tint = f"{10 * place} Hz", Tint(f"#0000{place:02d}", "#ffffff")
        y = x * x + step * place
        lines.append(Line(np.column_stack([x, y + 0.01]), tint, title="a run", group=name))
        title = f"{name}, mean of 3"
        lines.append(Line(np.column_stack([x, y]), tint, "mean", name, title, name))
    return Chart("time, s", "fill", "Curves of fill against time.", tuple(lines))


def test_four_settings_stay_one_chart() -> None:
    assert small_multiples(chart(4)) is None


def test_each_setting_stands_before_all_others_on_the_same_axes() -> None:
    made = small_multiples(chart(6))
    assert made is not None
    assert [title for title, _ in made.panels] == [f"{10 * n} Hz" for n in range(6)]
    assert made.note == ""
    for title, panel in made.panels:
        *behind, run, mean = [laid.line for laid in panel.lines]
        assert [line.style for line in behind] == ["behind"] * 6
        assert (run.group, mean.group, mean.style) == (title, title, "mean")
        assert not any(line.label for line in (*behind, run, mean))
        assert (panel.width, panel.height) == PANEL
        assert f"{title}, mean of 3 before all others; it ends at " in panel.chart.alt
    assert len({(p.x, p.y) for _, p in made.panels}) == 1


def test_of_many_settings_some_are_shown_and_that_is_said() -> None:
    made = small_multiples(chart(40))
    assert made is not None
    assert len(made.panels) == MOST_PANELS
    assert [made.panels[0][0], made.panels[-1][0]] == ["0 Hz", "390 Hz"]
    assert made.note == "Shown are 12 of 40 settings."


def test_curves_that_lie_on_each_other_are_one_chart_without_labels() -> None:
    made = small_multiples(chart(6, step=0.01))
    assert made is not None
    assert made.panels == ()
    assert made.together is not None
    assert not any(laid.line.label for laid in made.together[0].lines)
    assert made.note == (
        "The curves of all 6 settings lie on each other: at any time they differ by 0.050 or less."
    )

"""How sure an answer is, in these words."""

from __future__ import annotations

from sandmould.kinds.sand.kind import SandStudy
from sandmould.pattern_fe.coupling.interface import with_surface
from sandmould.wording.grounds import sand_grounds, scatter_grounds
from tests.unit.pattern_fe.test_pattern_scene import l_scene
from tests.unit.report.test_answer import CLEAR, KEY, judged, summary
from tests.unit.report_study import scenario


def test_a_best_frequency_rests_on_these_grounds() -> None:
    strong = scenario(50.0)
    (stage,) = strong.vibration[:1]
    weak = strong.model_copy(
        update={"vibration": (stage.model_copy(update={"acceleration_g": 0.5}),)}
    )
    study = SandStudy.model_validate(
        {
            "sweep": {"keys": {KEY: [25, 50, 100]}},
            "replicates": 3,
            "certificate": {"sand_wave_speed": {"low_m_s": 100, "high_m_s": 160, "by": "a guess"}},
        }
    )
    verdict = judged(summary(CLEAR)).verdict
    found = sand_grounds(strong, study, verdict, {"0.5 g": weak, "1.5 g": strong})
    assert "\n".join(": ".join(it) for it in found) == (
        "Scatter: each setting was run 3 times with other random fillings. The fill of the tube "
        "scatters by ±0.012 (standard deviation); the means of 50 Hz and 100 Hz differ by 0.20.\n"
        "Wave speed: 128 m/s in the model, 100 to 160 m/s in the real sand.\n"
        "Drive: the acceleration stays the same when the frequency changes. With another drive "
        "another frequency may be best.\n"
        "Model grains: 4 times as large as real ones. They block narrow places and leave larger "
        "voids than real sand.\n"
        "Below 1 g: at 0.5 g the box never throws the sand: expect little there."
    )


def test_walls_thinner_than_grains_and_a_bedding_are_grounds() -> None:
    supports = {"bedding_n_m3": 3e6}
    scene = with_surface(l_scene(supports=supports))
    coarse = scene.sand.model_copy(update={"size_scale": 80.0})
    verdict = judged(summary(CLEAR)).verdict
    of_fine, of_coarse = (
        {note.about: note.text for note in sand_grounds(each, SandStudy(), verdict, {})}
        for each in (scene, scene.model_copy(update={"sand": coarse}))
    )
    assert "springs of 3\u202f000\u202f000 N/m³ hold the part" in of_fine["Bedding"]
    assert "Walls of pattern" not in of_fine
    said = of_coarse["Walls of pattern"]
    assert said.startswith("the thinnest measures 10.0 mm, at (")
    assert "Grains may pass through this wall" in said


def test_one_run_says_nothing_about_chance() -> None:
    (one,) = scatter_grounds(judged(summary({50.0: (0.6,)})).verdict, "seeds", False)
    assert one.text == "one run: how much chance matters is not known."

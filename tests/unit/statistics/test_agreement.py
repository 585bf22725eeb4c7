"""Which settings are compared, what is said of them, and the page on the engines."""

from __future__ import annotations

import itertools
import json
import shutil
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from benchmarks.agreement import engine_twins
from sandmould.definition.study import Equivalence
from sandmould.report.agreement import row_name
from sandmould.runs.columns import CROSS_CHECK, CROSS_CHECK_OWN, PART
from sandmould.statistics.agreement import (
    COLUMNS,
    compare_keys,
    speeds,
    sweep_part,
)
from sandmould.study.collect import collect, compare_study, gather, read_study
from sandmould.wording.agreement import agreement_sentences
from tests.unit.report_study import ENGINES, KEY, write_cross_check, write_twins

FILL = "tube_fill_fraction"
FORM = "background_damping.form"
EQUAL = dict.fromkeys(ENGINES, 0.5)
DENSE = dict.fromkeys(ENGINES, 0.78)


def summary(**columns: list[object]) -> pd.DataFrame:
    """A summary of a grid of settings with four replicates each, fill 0.5 with a little noise."""
    noise = np.random.default_rng(2)
    rows = []
    for values in itertools.product(*columns.values()):
        for replicate in (1, 2, 3, 4):
            row = dict(zip(columns, values, strict=True))
            fill = 0.5 + float(noise.normal(0, 0.004))
            rows.append({**row, "replicate": replicate, "seed": 100 + replicate,
                         "outcome_code": 0, FILL: fill})  # fmt: skip
    return pd.DataFrame(rows)


def test_settings_that_differ_in_one_chosen_key_are_compared() -> None:
    table = summary(**{FORM: ["none", "viscous"], "engine.name": ["lammps", "reference"]})
    margins = {FILL: 0.03}
    one = compare_keys(table, [FORM, "engine.name"], Equivalence(keys=(FORM,), margins=margins))
    assert [(c.first, c.second, c.at) for c in one] == [
        ("none", "viscous", "engine lammps"),
        ("none", "viscous", "engine reference"),
    ]
    both = Equivalence(keys=(FORM, "engine.name"), margins=margins)
    found = compare_keys(table, [FORM, "engine.name"], both)
    assert [c.key for c in found].count("engine.name") == 2
    assert len(found) == 4
    assert {c.agreement.verdict for c in found} == {"equivalent"}


def test_main_effect_compares_at_equal_values_of_what_it_is_averaged_over() -> None:
    forms, scales = ["none", "viscous"], [4.0, 8.0]
    table = summary(**{FORM: forms, "sand.size_scale": scales})
    # The scale matters much, the form by 0.01: pairs at equal scales show it all the same.
    table[FILL] += 0.2 * (table["sand.size_scale"] == 8.0) + 0.01 * (table[FORM] == "viscous")
    keys = [FORM, "sand.size_scale"]
    wanted = Equivalence(keys=(FORM,), over=tuple(keys), margins={FILL: 0.02})
    (one,) = compare_keys(table, keys, wanted)
    assert (one.first, one.second, one.at) == ("none", "viscous", "")
    assert one.agreement.paired
    assert one.agreement.n == 8
    assert one.agreement.verdict == "equivalent"
    assert one.agreement.difference == pytest.approx(-0.01, abs=0.005)


def test_numbers_are_named_and_words_stand_alone() -> None:
    table = summary(**{"contact.grain_grain.rolling_arm_fraction": [0.1, 0.0]})
    keys = list(table.columns[:1])
    (one,) = compare_keys(table, keys, Equivalence(keys=tuple(keys), margins={FILL: 0.03}))
    assert one.pair == "rolling arm 0 − rolling arm 0.1"


def test_rows_of_a_chart_are_told_apart_where_their_names_are_cut() -> None:
    values: dict[str, list[object]] = {
        FORM: ["none", "viscous"],
        "pattern.statics": ["large", "linear"],
        "pattern.young_modulus_pa": [6.4e6, 6.4e8],
    }
    keys = list(values)
    found = compare_keys(summary(**values), keys, Equivalence(keys=(FORM,), margins={FILL: 0.03}))
    rows = [row_name(c) for c in found]
    assert len(set(rows)) == len(found) == 4
    assert rows[0].startswith("none − viscous, large, 6.4 MPa: ")


def test_planted_difference_between_engines_is_found(tmp_path: Path) -> None:
    folder = write_twins(tmp_path / "twins", {**EQUAL, "reference": 0.6}, DENSE)
    collected = gather(folder)
    found = compare_study(collected.summary, collected.keys, read_study(folder))
    judged = {(c.measure, c.first, c.second): c.agreement.verdict for c in found}
    assert judged[FILL, "lammps", "liggghts"] == "equivalent"
    assert judged[FILL, "lammps", "reference"] == "different"
    assert judged[FILL, "liggghts", "reference"] == "different"
    assert judged["solid_fraction", "lammps", "reference"] == "equivalent"
    sentences = agreement_sentences(found)
    assert sentences == (
        "Settings differ by more than the margin in fill of the tube (lammps – reference and "
        "liggghts – reference), at 90 %.",
        "4 of 6 comparisons agree within the margins set beforehand.",
    )


def test_engine_without_finished_runs_is_not_tested(tmp_path: Path) -> None:
    failed = [f"engine_liggghts_r{r}" for r in (1, 2, 3)]
    folder = write_twins(tmp_path / "twins", EQUAL, DENSE, replicates=3, failed=failed)
    collected = gather(folder)
    found = compare_study(collected.summary, collected.keys, read_study(folder))
    untested = [c for c in found if "liggghts" in (c.first, c.second)]
    assert {c.agreement.verdict for c in untested} == {"not tested"}


def test_all_equivalent_is_said_in_one_sentence(tmp_path: Path) -> None:
    collected = gather(write_twins(tmp_path / "twins", EQUAL, DENSE))
    found = compare_study(collected.summary, collected.keys, read_study(tmp_path / "twins"))
    assert agreement_sentences(found) == (
        "All 6 comparisons agree within the margins set beforehand, at 90 %.",
    )


def test_cross_check_is_compared_at_its_point_alone(tmp_path: Path) -> None:
    folder = write_cross_check(tmp_path / "demo")
    collected = gather(folder)
    assert len(collected.summary) == 12
    assert len(sweep_part(collected.summary)) == len(collected.of_sweep.summary) == 9
    assert collected.keys == (KEY,)
    packing, fill = compare_study(collected.summary, collected.keys, read_study(folder))
    assert (fill.first, fill.second, fill.at) == ("reference", "lammps", "50 Hz")
    assert fill.agreement.n == packing.agreement.n == 3
    assert fill.agreement.means == pytest.approx((0.55, 0.85), abs=0.02)
    assert fill.agreement.verdict == "different"


def test_a_shorter_cross_check_compares_the_runs_of_both_engines_that_are_as_short(
    tmp_path: Path,
) -> None:
    folder = write_cross_check(tmp_path / "demo")
    study = read_study(folder)
    check = study.cross_check.model_copy(update={"vibration_s": 0.5})  # type: ignore[union-attr]
    summary = gather(folder).summary
    # The shorter runs of the study's own engine: as filled as those of the other, less 0.1.
    own = summary[summary[PART] == CROSS_CHECK].copy()
    own[PART] = CROSS_CHECK_OWN
    own["tube_fill_fraction"] -= 0.1
    summary = pd.concat([summary, own], ignore_index=True)
    shorter = study.model_copy(update={"cross_check": check})
    _, fill = compare_study(summary, (KEY,), shorter)
    assert fill.agreement.means[1] - fill.agreement.means[0] == pytest.approx(0.1)


def test_table_is_written_and_reads_back(tmp_path: Path) -> None:
    folder = write_twins(tmp_path / "twins", EQUAL, DENSE)
    collect(folder)
    table = pd.read_csv(folder / "agreement.tsv", sep="\t")
    assert tuple(table.columns) == COLUMNS
    assert len(table) == 6
    assert set(table["verdict"]) == {"equivalent"}
    (folder / "study.yaml").unlink()
    collect(folder)
    assert pd.read_csv(folder / "agreement.tsv", sep="\t").empty


def test_speed_of_each_engine_fastest_first(tmp_path: Path) -> None:
    collected = gather(write_twins(tmp_path / "twins", EQUAL, DENSE, replicates=2))
    found = speeds(collected.summary)
    assert [s.engine for s in found] == ["reference", "liggghts", "lammps"]
    assert found[0].grain_steps_per_s == 2.1e7
    assert {s.runs for s in found} == {2}
    assert speeds(collected.summary.drop(columns="engine")) == ()


def records(folder: Path) -> Path:
    """The committed result of the page, with planted values."""
    made = write_twins(folder / "made", EQUAL, DENSE)
    collect(made)
    kept = folder / "records" / engine_twins.TWINS
    kept.mkdir(parents=True)
    shutil.copy(made / "summary.tsv", kept / "summary.tsv")
    study = f"config/studies/{engine_twins.TWINS}.yaml"
    (kept / "record.json").write_text(json.dumps({"study": study, "commit": "abc1234"}))
    return folder / "records"


def test_page_on_the_engines_has_its_tables(tmp_path: Path) -> None:
    text = engine_twins.page(records(tmp_path))
    assert "# Do three engines fill and shake the same box alike?" in text
    assert "| lammps − reference | 0.00055 | −0.00074 to 0.0018 | ±0.005 | equivalent |" in text
    assert text.count("| equivalent |") >= 6
    assert (
        "Study [engine_twins](results/engine_twins/README.md), 6 replicates," in text
    )  # the file asks for more
    assert "| reference | 22 Jul 2025 | 6 | 21 M |" in text
    assert "2/5 m r²" in text
    assert "\n\n\n\n" not in text


def test_page_names_what_was_not_recorded(tmp_path: Path) -> None:
    folder = records(tmp_path)
    shutil.rmtree(folder / "engine_twins")
    with pytest.raises(SystemExit, match="no record of engine_twins"):
        engine_twins.page(folder)

"""What a run lacks: whatever is lost or damaged is seen, and nothing else."""

from __future__ import annotations

import json
import os
import shutil
from collections.abc import Callable
from pathlib import Path

import pytest

from sandmould.execution.simulate import measure_run
from sandmould.execution.status import run_status, status_text
from sandmould.runs.manifest import LEFT_OUT, MANIFEST_FILE
from sandmould.study.plan.announcement import prepare
from sandmould.study.plan.build_plan import RESULTS, Plan, open_plan
from sandmould.study.plan.lacking import WHOLE, Lack, Need, lack_of, notes_of
from tests.finished_study import finished_study, study_text
from tests.workflow.runs import compute_all


@pytest.fixture(scope="module")
def once(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Compute a study of one run."""
    folder = tmp_path_factory.mktemp("once")
    (folder / "one.yaml").write_text(study_text([0.02], ["faces"]))
    before = Path.cwd()
    os.chdir(folder)
    finished_study(Path("one.yaml"))
    os.chdir(before)
    return folder


@pytest.fixture
def plan(once: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Plan:
    """A copy of the study, with the plan of it."""
    shutil.copytree(once, tmp_path, dirs_exist_ok=True)
    monkeypatch.chdir(tmp_path)
    return open_plan(Path("one.yaml"))


def folder_of(plan: Plan) -> Path:
    return RESULTS / plan.study.name / "runs" / plan.runs[0].run


def lack(plan: Plan) -> Lack:
    return lack_of(plan.runs[0], folder_of(plan))


def cut(name: str) -> Callable[[Path], None]:
    """Leave the first half of a file, as a full disk or a torn copy does."""

    def damage(folder: Path) -> None:
        path = folder / name
        path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])

    return damage


def emptied(name: str) -> Callable[[Path], None]:
    return lambda folder: (folder / name).write_bytes(b"")


def removed(name: str) -> Callable[[Path], None]:
    return lambda folder: (folder / name).unlink()


def appended(name: str) -> Callable[[Path], None]:
    """Write more into a file."""

    def damage(folder: Path) -> None:
        path = folder / name
        path.write_text(path.read_text() + "\n")

    return damage


@pytest.mark.parametrize(
    ("damage", "need", "why"),
    [
        (removed("outcome.json"), Need.COMPUTE, "outcome.json is missing"),
        (emptied("outcome.json"), Need.COMPUTE, "outcome.json cannot be read"),
        (cut("outcome.json"), Need.COMPUTE, "outcome.json cannot be read"),
        (removed(MANIFEST_FILE), Need.COMPUTE, "products.json is missing"),
        (cut(MANIFEST_FILE), Need.COMPUTE, "products.json cannot be read"),
        (removed("fields.npz"), Need.COMPUTE, "fields.npz is missing"),
        (cut("fields.npz"), Need.COMPUTE, "fields.npz has "),
        (emptied("series.tsv"), Need.COMPUTE, "series.tsv has 0 of "),
        (removed("deck.in"), Need.COMPUTE, "deck.in is missing"),
        (appended("deck.in"), Need.COMPUTE, "deck.in was changed by hand"),
        (removed("measures.tsv"), Need.MEASURE, "measures.tsv is missing"),
        (cut("measures.tsv"), Need.MEASURE, "measures.tsv has "),
    ],
)
def test_damage_is_seen_and_told(
    damage: Callable[[Path], None], need: Need, why: str, plan: Plan
) -> None:
    assert lack(plan) == WHOLE
    damage(folder_of(plan))
    found = lack(plan)
    assert found.need is need
    assert why in found.why
    said = status_text(plan, RESULTS, 1)
    assert said.startswith("one: 1 waiting of 1 runs\n")
    assert f"  waiting: {plan.runs[0].run}  {found.why}" in said
    assert f"{plan.runs[0].run} ({found.why})" in prepare(plan, RESULTS)


@pytest.mark.parametrize(
    "harmless",
    [
        lambda folder: (folder / "notes.txt").write_text("mine"),
        lambda folder: (folder / "log.lammps").write_text("of a run by hand"),
        lambda folder: os.utime(folder / "scenario.yaml"),
        lambda folder: os.utime(folder / "deck.in"),
    ],
)
def test_what_is_no_damage_computes_nothing(harmless: Callable[[Path], None], plan: Plan) -> None:
    harmless(folder_of(plan))
    assert plan.lacks(RESULTS) == {}
    assert prepare(plan, RESULTS) == ""


def test_a_killed_measurement_is_done_again(plan: Plan) -> None:
    path = folder_of(plan) / MANIFEST_FILE
    tree = json.loads(path.read_text())
    del tree["measured"]
    path.write_text(json.dumps(tree))
    assert lack(plan) == Lack(Need.MEASURE, "computed, but its measures are not taken yet")


def test_what_other_code_measured_is_measured_again_if_it_can_be(plan: Plan) -> None:
    folder = folder_of(plan)
    path = folder / MANIFEST_FILE
    tree = json.loads(path.read_text())
    for of_other_code in (
        tree | {"measured_by": {"code_sha256": "0" * 12}},
        {step: tree[step] for step in tree if step != "measured_by"},
    ):
        path.write_text(json.dumps(of_other_code))
        assert lack(plan) == Lack(Need.MEASURE, "it is measured otherwise since")
        # a pack that leaves out what is measured keeps the measures that it has
        path.write_text(json.dumps(of_other_code | {LEFT_OUT: {"snapshots.npz": 1}}))
        assert lack(plan) == WHOLE
    path.write_text(json.dumps(of_other_code))
    measure_run(folder)
    assert lack(plan) == WHOLE
    assert json.loads(path.read_text()) == tree


def test_notes_ask_for_what_is_lacking_and_go_when_nothing_is(plan: Plan) -> None:
    folder = folder_of(plan)
    both = (Need.COMPUTE, Need.MEASURE)
    assert notes_of(str(folder), *both) == []
    kept = (folder / "series.tsv").read_text()
    (folder / "series.tsv").unlink()
    prepare(plan, RESULTS)
    (note,) = notes_of(str(folder), *both)
    assert notes_of(str(folder), Need.COMPUTE) == [note]
    first = Path(note).read_text()
    prepare(plan, RESULTS)
    # An input that says the same is none that is newer.
    assert Path(note).read_text() != first
    (folder / "series.tsv").write_text(kept)
    (folder / "measures.tsv").unlink()
    prepare(plan, RESULTS)
    assert len(notes_of(str(folder), Need.MEASURE)) == len(notes_of(str(folder), *both)) == 1
    # Else a deck that was rendered before the note would be rendered, and computed, again.
    measure_run(folder)
    assert prepare(plan, RESULTS) == ""
    assert notes_of(str(folder), *both) == []


def test_a_batch_mends_what_is_damaged(plan: Plan) -> None:
    folder = folder_of(plan)
    before = {name: (folder / name).read_text() for name in ("series.tsv", "measures.tsv")}
    cut("outcome.json")(folder)
    compute_all([folder], folder / "log")
    assert lack(plan) == WHOLE
    removed("measures.tsv")(folder)
    compute_all([folder], folder / "log")
    assert lack(plan) == WHOLE
    assert before == {name: (folder / name).read_text() for name in before}
    assert run_status(folder, lack(plan)).state == "done"


FILES = ("outcome.json", MANIFEST_FILE, "deck.in", "series.tsv", "fields.npz", "measures.tsv",
         "scenario.yaml")  # fmt: skip


def flipped(path: Path) -> None:
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 1
    path.write_bytes(content)


def other(make: Callable[[Path], object]) -> Callable[[Path], None]:
    """Put something else in a file's place."""

    def damage(path: Path) -> None:
        path.unlink()
        make(path)

    return damage


WAYS: dict[str, Callable[[Path], object]] = {
    "missing": Path.unlink,
    "empty": lambda path: path.write_bytes(b""),
    "halved": lambda path: path.write_bytes(path.read_bytes()[: path.stat().st_size // 2]),
    "flipped": flipped,
    "garbage": lambda path: path.write_bytes(os.urandom(path.stat().st_size)),
    "folder": other(Path.mkdir),
    "pipe": other(os.mkfifo),
    "link": other(lambda path: path.symlink_to("nowhere")),
}


@pytest.mark.parametrize("file", FILES)
def test_whatever_is_damaged_is_found_by_its_hash(file: str, plan: Plan) -> None:
    folder = folder_of(plan)
    said = status_text(plan, RESULTS, 1, deep=True)
    assert "1 runs and fills checked: no file is damaged" in said
    for way, damage in WAYS.items():
        if (file, way) == ("scenario.yaml", "flipped"):
            continue  # a letter of a comment
        shutil.copytree(folder, "kept")
        damage(folder / file)
        said = status_text(plan, RESULTS, 1, deep=True)
        assert f"{plan.runs[0].run}  {file} " in said, way
        assert ("damaged: " in said) is (not lack(plan).need)
        shutil.rmtree(folder)
        os.rename("kept", folder)


def test_what_is_lost_of_the_hashes_is_seen(plan: Plan) -> None:
    path = folder_of(plan) / MANIFEST_FILE
    tree = json.loads(path.read_text())
    for keys in (("sha256",), ("seal",), ("sha256", "seal")):
        path.write_text(json.dumps({k: v for k, v in tree.items() if k not in keys}))
        assert f"{MANIFEST_FILE} is not as the run wrote it" in status_text(plan, RESULTS, 1, True)


@pytest.mark.parametrize("file", ["outcome.json", MANIFEST_FILE, "scenario.yaml"])
def test_what_is_nested_without_end_is_a_sentence(file: str, plan: Plan) -> None:
    for text in ("[" * 100_000, "- " * 100_000):
        (folder_of(plan) / file).write_text(text)
        assert f"  {file} " in status_text(plan, RESULTS, 1, deep=True)

"""Finished runs travel from folder to folder; what is foreign or torn is refused in a sentence."""

from __future__ import annotations

import copy
import errno
import json
import lzma
import os
import shutil
import stat
import zipfile
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace

import pytest

from sandmould.bad_input import BadInputError
from sandmould.definition.run import Run
from sandmould.digest import digest
from sandmould.execution.packs import archive, recorded
from sandmould.execution.packs.pack import pack
from sandmould.execution.packs.rounds import merge_rounds
from sandmould.execution.packs.unpack import unpack
from sandmould.runs.hashing import scenario_hash
from sandmould.runs.manifest import MANIFEST_FILE
from sandmould.scenario.own_deck import OwnDeck
from sandmould.study.collect import collect
from sandmould.study.plan.batches import mark_done
from sandmould.study.plan.build_plan import RESULTS, Plan, announce, open_plan
from sandmould.study.plan.lacking import Need
from sandmould.study.plan.plan_files import write_plan
from sandmould.study.rounds.round_log import ROUNDS_FILE
from tests.finished_study import finished_study, study_text

TABLES = ("summary.tsv", "curves.tsv", "agreement.tsv")


@pytest.fixture(scope="module")
def there(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Compute a study of two runs, one of which fails, on another machine."""
    folder = tmp_path_factory.mktemp("there")
    (folder / "two.yaml").write_text(study_text([0.02], ["faces", "difference"]))
    before = Path.cwd()
    os.chdir(folder)
    finished_study(Path("two.yaml"), failed=1)
    os.chdir(before)
    return folder


@pytest.fixture
def packed(there: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Pack the study, and go to an empty folder with the study's file alone."""
    monkeypatch.chdir(there)
    file = pack(open_plan(Path("two.yaml")), RESULTS, tmp_path / "two.zip").path
    here = tmp_path / "here"
    here.mkdir()
    shutil.copy(there / "two.yaml", here)
    monkeypatch.chdir(here)
    return file


def run_folder(plan: Plan, place: int = 0) -> Path:
    return RESULTS / plan.study.name / "runs" / plan.runs[place].run


def test_unpacked_runs_lack_nothing_and_give_the_same_tables(packed: Path, there: Path) -> None:
    assert unpack(packed, RESULTS).text() == "two: 2 runs taken"
    plan = open_plan(Path("two.yaml"))
    announce(plan, RESULTS, 1)
    assert plan.lacks(RESULTS) == {}
    collect(RESULTS / "two")
    for table in TABLES:
        assert (RESULTS / "two" / table).read_bytes() == (
            there / RESULTS / "two" / table
        ).read_bytes()
    # Nothing is older than what it is made from, and no job looks at batches that are whole.
    folder = run_folder(plan)
    assert (
        folder.joinpath("deck.in").stat().st_mtime <= folder.joinpath("series.tsv").stat().st_mtime
    )
    mark_done(plan.batches(10.0), plan.lacks(RESULTS), RESULTS / "two")
    assert len(list((RESULTS / "two" / "batches").iterdir())) == 2
    # What was unpacked packs into the same bytes; a second time nothing is taken.
    again = pack(plan, RESULTS).path
    assert again == Path("two_runs.zip")
    assert again.read_bytes() == packed.read_bytes()
    assert unpack(packed, RESULTS).text() == "two: 0 runs taken, 2 here already"
    with zipfile.ZipFile(again) as zipped:
        names = zipped.namelist()
        assert {head.date_time for head in zipped.infolist()} == {(1980, 1, 1, 0, 0, 0)}
    assert names == [*sorted(names[:-1]), "manifest.json"]
    assert f"two/runs/{plan.runs[0].run}/series.tsv" in names


def test_packs_of_two_machines_merge_and_conflicts_are_told(packed: Path) -> None:
    unpack(packed, RESULTS)
    plan = open_plan(Path("two.yaml"))
    one, other = run_folder(plan, 0), run_folder(plan, 1)
    # The other machine's last digits differ; its other run is of another solver.
    with (one / "series.tsv").open("a") as table:
        table.write("\n")
    manifest = json.loads((other / MANIFEST_FILE).read_text())
    manifest["origin"]["template_sha256"] = "older"
    (other / MANIFEST_FILE).write_text(json.dumps(manifest))
    said = unpack(packed, RESULTS).text()
    assert "0 runs taken, 1 here already" in said
    assert f"with other digits: {one.name}, ours stay" in said
    assert f"not taken: {other.name}, at its end here with another scenario" in said
    shutil.rmtree(other)
    assert unpack(packed, RESULTS).taken == [other.name]
    # In a folder of packs each run is once.
    Path("packs").mkdir()
    first = pack(plan, RESULTS, Path("packs"))
    assert first.path.parent == Path("packs")
    assert first.path.name.startswith("two_")
    with pytest.raises(BadInputError, match="packed already"):
        pack(plan, RESULTS, Path("packs"))


def test_the_last_state_alone_is_whole_but_cannot_be_measured_again(
    there: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    shutil.copytree(there, tmp_path / "there")
    monkeypatch.chdir(tmp_path / "there")
    plan = open_plan(Path("two.yaml"))
    folder = run_folder(plan)
    manifest = json.loads((folder / MANIFEST_FILE).read_text())
    for number in range(3):
        (folder / "snapshots").mkdir(exist_ok=True)
        (folder / "snapshots" / f"{number}.npz").write_bytes(b"grains")
        manifest["computed"][f"snapshots/{number}.npz"] = 6
    (folder / MANIFEST_FILE).write_text(json.dumps(manifest))
    whole = pack(plan, RESULTS, tmp_path / "whole.zip")
    small = pack(plan, RESULTS, tmp_path / "small.zip", last_state=True)
    assert small.bytes < whole.bytes
    shutil.rmtree(RESULTS)
    unpack(small.path, RESULTS)
    assert [path.name for path in (folder / "snapshots").iterdir()] == ["2.npz"]
    assert plan.lacks(RESULTS) == {}
    (folder / "measures.tsv").unlink()
    lack = plan.lacks(RESULTS)[folder.name]
    assert (lack.need, "left out of a pack" in lack.why) == (Need.COMPUTE, True)


def test_checkpoints_travel_where_both_sides_want_it(
    there: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    shutil.copytree(there, tmp_path / "there")
    monkeypatch.chdir(tmp_path / "there")
    plan = open_plan(Path("two.yaml"))
    stopped = run_folder(plan, 1)
    (stopped / "outcome.json").unlink()
    (stopped / "work").mkdir()
    (stopped / "work" / "checkpoint.npz").write_bytes(b"arrays")
    assert pack(plan, RESULTS).left_out == {stopped.name: "not at their end"}
    file = pack(plan, RESULTS, checkpoints=True).path
    shutil.rmtree(RESULTS)
    assert "--checkpoints takes its checkpoint" in unpack(file, RESULTS).text()
    assert not stopped.exists()
    assert unpack(file, RESULTS, checkpoints=True).checkpoints == [stopped.name]
    assert [p.name for p in stopped.rglob("*")] == ["work", "checkpoint.npz"]
    assert plan.lacks(RESULTS)[stopped.name].why == ""
    assert "begun here as well" in unpack(file, RESULTS, checkpoints=True).text()


def test_the_record_of_a_shipped_study_is_taken_up_where_it_fits(
    packed: Path, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    study = tmp_path / "config" / "studies" / "two.yaml"
    study.parent.mkdir(parents=True)
    shutil.copy("two.yaml", study)
    monkeypatch.setattr(recorded, "SHIPPED", tmp_path)
    monkeypatch.setattr(recorded, "RECORDS", tmp_path / "records")
    unpack(packed, RESULTS)
    plan = open_plan(study)
    shutil.rmtree(run_folder(plan, 1))
    said = recorded.record_part(plan, RESULTS).text()
    assert "1 runs" in said
    assert f"left out: {plan.runs[1].run}, not at their end" in said
    shutil.rmtree(RESULTS)
    plan, said = recorded.take_up(plan, RESULTS)
    assert said == "1 runs taken from the record of two"
    assert list(plan.lacks(RESULTS)) == [plan.runs[1].run]
    assert recorded.take_up(plan, RESULTS) == (plan, "")
    # A study that has changed since takes none: it would be computed again.
    shutil.rmtree(RESULTS)
    study.write_text(study.read_text().replace("until_s: 100", "until_s: 101"))
    assert recorded.take_up(open_plan(study), RESULTS)[1] == ""
    # A user's study of the same name has no record.
    assert recorded.take_up(open_plan(Path("two.yaml")), RESULTS)[1] == ""


def test_rounds_go_on_from_each_other_or_ours_stay(tmp_path: Path) -> None:
    def text(*points: float, ended: str = "") -> bytes:
        rounds = [
            {"runs": [[{"f": p}, 1]], "setting": {"f": p}, "interval": {}, "spent_core_h": 1.0}
            for p in points
        ]
        log = {"basis": "b", "rounds": rounds, "ended": ended, "certified_hz": []}
        return json.dumps(log).encode()

    path = tmp_path / ROUNDS_FILE
    for theirs, ours in ((text(1), text(1)), (text(1, 2), text(1, 2)), (text(1), text(1, 2)),
                         (text(1, 2, ended="so"), text(1, 2, ended="so"))):  # fmt: skip
        assert merge_rounds(theirs, tmp_path) == ""
        assert path.read_bytes() == ours
    assert "chose other runs" in merge_rounds(text(1, 3), tmp_path)
    with pytest.raises(ValueError, match="no list of rounds"):
        merge_rounds(b"[]", tmp_path)


Members = dict[str, bytes]


def written(members: Members, path: Path) -> None:
    """Write a zip as a hand can that knows the format, and make its list right again."""
    listed = json.loads(members["manifest.json"])
    listed["files"] = {
        name.removeprefix("two/"): {"size": len(text), "sha256": digest(text)}
        for name, text in members.items()
        if name != "manifest.json"
    }
    with zipfile.ZipFile(path, "w") as zipped:
        for name, text in {**members, "manifest.json": json.dumps(listed).encode()}.items():
            zipped.writestr(name, text)


def members_of(path: Path) -> Members:
    with zipfile.ZipFile(path) as zipped:
        return {name: zipped.read(name) for name in zipped.namelist()}


def series_in(members: Members) -> str:
    return next(name for name in members if name.endswith("series.tsv"))


def refused(path: Path, said: str) -> None:
    """One sentence, and nothing lies anywhere that was not there before."""
    before = sorted(Path().resolve().parent.rglob("*"))
    with pytest.raises(BadInputError, match=said) as told:
        unpack(path, RESULTS, checkpoints=True)
    assert "\n" not in str(told.value)
    after = {p for p in Path().resolve().parent.rglob("*") if p.name != "lock"}
    assert after - set(before) <= {RESULTS.resolve(), (RESULTS / "two").resolve()}


@pytest.mark.parametrize(
    "name",
    [
        "../../../../outside", "/tmp/outside", "work/checkpoint.npz", "deck.in/inner", "lock",
        "lock_owner", ".hidden", "a\\b", "a\nb", "", "fields/../../x", "compute_again.txt",
        "x" * 201, "last_work/x", "checkpoints_of_a/x", "fields.partial",
    ],
)  # fmt: skip
def test_names_that_are_no_files_of_a_run_are_refused(name: str, packed: Path) -> None:
    members = members_of(packed)
    series = series_in(members)
    members[series.replace("series.tsv", name)] = members.pop(series)
    written(members, packed)
    refused(packed, "is no file of a run" if name else "is no plain file")


@pytest.mark.parametrize("name", ["two/x", "two/runs/x/y", "two/batches/b.done", "two/runs.tsv"])
def test_files_that_are_of_no_run_are_refused(name: str, packed: Path) -> None:
    written(members_of(packed) | {name: b""}, packed)
    refused(packed, "is no file of a run")


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda m, name: {name: bytes([m[name][0] ^ 1]) + m[name][1:]}, "does not match its hash"),
        (lambda m, name: {name: b""}, "is not as its manifest.json says"),
        (lambda m, name: {name: None}, "is not as its manifest.json says"),
        (lambda m, name: {name + "x": b""}, "is not as its manifest.json says"),
        (lambda m, name: {"manifest.json": b"{}"}, "its manifest.json is none of ours"),
        (lambda m, name: {"manifest.json": b"[" * 100_000}, "its manifest.json is none of ours"),
        (
            lambda m, name: {"manifest.json": m["manifest.json"].replace(b"pack 2", b"pack 3")},
            "its manifest.json is none of ours",
        ),
        (lambda m, name: {"manifest.json": None}, "it has no manifest.json"),
    ],
)
def test_what_is_not_as_the_list_says_is_refused(
    change: Callable[[Members, str], dict[str, bytes | None]], said: str, packed: Path
) -> None:
    members = members_of(packed)
    changed = members | change(members, series_in(members))
    with zipfile.ZipFile(packed, "w") as zipped:
        for name, text in changed.items():
            if text is not None:
                zipped.writestr(name, text)
    refused(packed, said)


def heads_changed(path: Path, change: Callable[[zipfile.ZipInfo], object], copies: int = 0) -> None:
    """Write another head for the largest file, as no program for zips does."""
    with zipfile.ZipFile(path, "a") as zipped:
        head = max(zipped.infolist(), key=lambda head: head.compress_size)
        change(head)
        for number in range(copies):
            twin = copy.copy(head)
            twin.filename = twin.orig_filename = f"two/runs/{number}"
            zipped.filelist.append(twin)
        zipped.comment = b"so that heads are written again"


@pytest.mark.parametrize(
    ("key", "value", "copies", "said"),
    [
        ("external_attr", (stat.S_IFLNK | 0o777) << 16, 0, "is no plain file"),
        ("external_attr", (stat.S_IFIFO | 0o777) << 16, 0, "is no plain file"),
        ("flag_bits", 1, 0, "is no plain file"),
        ("compress_type", zipfile.ZIP_LZMA, 0, "is no plain file"),
        ("file_size", 6 * 10**11, 0, "it says that it holds 1. files of 6000"),
        ("file_size", 10**9, 0, "is not as its manifest.json says"),
        ("CRC", 7, 0, "is damaged"),
        ("comment", b"", 1000, "files in it lie over each other"),
        ("comment", b"", 3000, "it says that it holds 30.. files"),
    ],
)
def test_links_bombs_and_false_heads_are_refused(
    key: str, value: object, copies: int, said: str, packed: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(archive, "_MOST_FILES", 2000)
    heads_changed(packed, lambda head: setattr(head, key, value), copies)
    refused(packed, said)


def test_torn_files_and_other_files_are_refused(packed: Path) -> None:
    whole = packed.read_bytes()
    for number in (0, 10, len(whole) * 3 // 4, len(whole) - 1):
        packed.write_bytes(whole[:number])
        refused(packed, "it is no zip, cut short or damaged")
    # Its directory would take all memory.
    end = whole.rindex(b"PK\5\6") + 12
    packed.write_bytes(whole[:end] + b"\xff\xff\xff\x7f" + whole[end + 4 :])
    refused(packed, "more files than any pack does|cut short or damaged")
    with zipfile.ZipFile(packed, "w") as zipped:
        zipped.writestr("manifest.json", b"{}")
        with pytest.warns(UserWarning, match="Duplicate"):
            zipped.writestr("manifest.json", b"{}")
    refused(packed, "files in it lie over each other")
    packed.write_bytes(lzma.compress(whole))
    refused(packed, "an older version wrote this one: pack the runs again")
    packed.unlink()
    os.mkfifo(packed)
    refused(packed, "it is no file")


DEEP = b"[" * 100_000


@pytest.mark.parametrize(
    ("file", "change", "why"),
    [
        ("series.tsv", lambda text, of_other: None, "series.tsv is missing"),
        ("series.tsv", lambda text, of_other: text + b"1", "series.tsv has "),
        ("deck.in", lambda text, of_other: text + b"#", "deck.in was changed by hand"),
        ("outcome.json", lambda text, of_other: DEEP, "outcome.json cannot be read"),
        ("products.json", lambda text, of_other: None, "products.json is missing"),
        ("products.json", lambda text, of_other: DEEP, "products.json cannot be read"),
        (
            "products.json",
            lambda text, of_other: text.replace(b'"template_sha256": "', b'"template_sha256": "0'),
            "its deck or its solver has changed since",
        ),
        (
            "products.json",
            lambda text, of_other: text.replace(b"series.tsv", rb"\u0000"),
            "\0 is missing",
        ),
        ("scenario.yaml", lambda text, of_other: None, "cannot be read by this version"),
        ("scenario.yaml", lambda text, of_other: b"kind: x", "cannot be read by this version"),
        ("scenario.yaml", lambda text, of_other: DEEP, "is not as a plan writes it"),
        ("scenario.yaml", lambda text, of_other: b"- &a []\n- *a", "is not as a plan writes it"),
        ("scenario.yaml", lambda text, of_other: of_other, "is that of another run"),
        (
            "scenario.yaml",
            lambda text, of_other: text.replace(b"until_s: 100", b"until_s: 101"),
            "it is of another scenario",
        ),
    ],
)
def test_a_run_that_a_start_would_compute_is_left_and_the_others_are_taken(
    file: str, change: Callable[[bytes, bytes], bytes | None], why: str, packed: Path
) -> None:
    members = members_of(packed)
    name = series_in(members).replace("series.tsv", file)
    run = Path(name).parent.name
    other = next(n for n in members if n.endswith(f"/{file}") and run not in n)
    text = change(members.pop(name), members[other])
    written(members | ({} if text is None else {name: text}), packed)
    unpacked = unpack(packed, RESULTS)
    assert why in unpacked.left[run]
    assert unpacked.taken == [Path(other).parent.name]
    assert [p.name for p in (RESULTS / "two" / "runs").iterdir()] == unpacked.taken
    assert not list(RESULTS.rglob("*.partial"))


def test_files_that_a_scenario_names_are_not_opened(packed: Path) -> None:
    """A deck of the user's own names its template, which may be any file of this machine."""
    scenario = OwnDeck(template="nowhere/deck.in.j2")
    run = Run("two", "own_r1_0a1b2c", {}, 1, scenario, {})
    write_plan([run], Path("plan"))
    origin = {"scenario_sha256": scenario_hash(scenario), "template_sha256": "as it was there"}
    texts = {
        "scenario.yaml": (Path("plan") / run.place / "scenario.yaml").read_bytes(),
        "deck.in": b"run 0",
        "products.json": json.dumps({"origin": origin, "computed": {}, "measured": {}}).encode(),
        "outcome.json": members_of(packed)[
            series_in(members_of(packed)).replace("series.tsv", "outcome.json")
        ],
    }
    listed = {"manifest.json": members_of(packed)["manifest.json"]}
    written({f"two/{run.place}/{name}": text for name, text in texts.items()} | listed, packed)
    assert unpack(packed, RESULTS).taken == [run.run]


def test_what_is_begun_here_with_another_deck_stays(packed: Path) -> None:
    plan = open_plan(Path("two.yaml"))
    begun, other = run_folder(plan, 0), run_folder(plan, 1)
    for folder in (begun, other):
        (folder / "work").mkdir(parents=True)
        (folder / "notes.txt").write_text("mine")
    (begun / "deck.in").write_text("another")
    unpacked = unpack(packed, RESULTS)
    assert "begun here with another deck" in unpacked.left[begun.name]
    assert (begun / "work").is_dir()
    assert unpacked.taken == [other.name]
    assert not (other / "work").exists()
    assert (other / "notes.txt").read_text() == "mine"


def test_a_disk_that_takes_no_more_is_said_in_a_sentence(
    packed: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with monkeypatch.context() as full:
        full.setattr(shutil, "disk_usage", lambda folder: SimpleNamespace(free=10))
        refused(packed, "GB of room: it has 0.0")

    def no_space(*_: object) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    with monkeypatch.context() as full:
        full.setattr(os, "utime", no_space)
        refused(packed, "a folder that takes files: it does not")
    unpack(packed, RESULTS)
    plan = open_plan(Path("two.yaml"))
    with pytest.raises(BadInputError, match=r"name ends in \.zip"):
        pack(plan, RESULTS, Path("runs.tar.xz"))
    with pytest.raises(BadInputError, match="--output = 'nowhere' cannot be used"):
        pack(plan, RESULTS, Path("nowhere/runs.zip"))
    before = pack(plan, RESULTS).path.read_bytes()
    with monkeypatch.context() as full:
        full.setattr(zipfile.ZipFile, "writestr", no_space)
        with pytest.raises(BadInputError, match="No space left on device"):
            pack(plan, RESULTS)
    assert Path("two_runs.zip").read_bytes() == before
    assert not list(Path().glob("*.partial"))

"""Finished runs travel from folder to folder; what is foreign or torn is refused in a sentence."""

from __future__ import annotations

import errno
import json
import os
import shutil
import zipfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from sandmould.bad_input import BadInputError
from sandmould.definition.run import Run
from sandmould.digest import digest, file_digest
from sandmould.engines.snapshot import SNAPSHOTS, Snapshot, SnapshotFile, stored_snapshots
from sandmould.execution.packs.pack import pack
from sandmould.execution.packs.unpack import unpack
from sandmould.kinds.registry import kind_of
from sandmould.runs.hashing import scenario_hash
from sandmould.runs.manifest import MANIFEST_FILE, read_manifest, save_manifest
from sandmould.scenario.own_deck import OwnDeck
from sandmould.study.collect import collect
from sandmould.study.plan.batches import mark_done
from sandmould.study.plan.build_plan import RESULTS, Plan, open_plan
from sandmould.study.plan.lacking import Need
from sandmould.study.rounds.round_log import ROUNDS_FILE
from tests.finished_study import finished_study, study_text
from tests.planned import announce, write_plan

PACK = Path("two_runs.zip")


@pytest.fixture(scope="module")
def there(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Compute and pack a study of two runs, one of which fails, on another machine."""
    folder = tmp_path_factory.mktemp("there")
    (folder / "two.yaml").write_text(study_text([0.02], ["faces", "difference"]))
    before = Path.cwd()
    os.chdir(folder)
    pack(finished_study(Path("two.yaml"), failed=1), RESULTS)
    os.chdir(before)
    return folder


@pytest.fixture
def packed(there: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Go to an empty folder with the study's file and the pack alone."""
    here = tmp_path / "here"
    here.mkdir()
    monkeypatch.chdir(here)
    for name in ("two.yaml", PACK):
        shutil.copy(there / name, here)
    return PACK


def run_folder(plan: Plan, place: int = 0) -> Path:
    return RESULTS / plan.study.name / plan.runs[place].place


def test_unpacked_runs_lack_nothing_and_give_the_same_tables(packed: Path, there: Path) -> None:
    assert unpack(packed, RESULTS) == "two: 2 runs taken"
    plan = open_plan(Path("two.yaml"))
    announce(plan, RESULTS, 1)
    assert plan.lacks(RESULTS) == {}
    collect(RESULTS / "two")
    for table in ("summary.tsv", "curves.tsv", "agreement.tsv"):
        ours = (RESULTS / "two" / table).read_bytes()
        assert ours == (there / RESULTS / "two" / table).read_bytes()
    # Nothing is older than what it is made from, and no job looks at batches that are whole.
    assert len({path.stat().st_mtime for path in run_folder(plan).iterdir()}) <= 2
    mark_done(plan.batches(10.0), plan.lacks(RESULTS), RESULTS / "two")
    assert len(list((RESULTS / "two" / "batches").iterdir())) == 2
    # What was unpacked packs into the same bytes; a second time nothing is taken.
    before = packed.read_bytes()
    assert pack(plan, RESULTS).startswith("two_runs.zip: 2 runs, ")
    assert packed.read_bytes() == before
    said = unpack(packed, RESULTS).splitlines()
    assert said[0] == "two: 0 runs taken"
    assert said[1].endswith("here already")
    with zipfile.ZipFile(packed) as zipped:
        assert {head.date_time for head in zipped.infolist()} == {(1980, 1, 1, 0, 0, 0)}
        assert f"two/{plan.runs[0].place}/series.tsv" in zipped.namelist()


def test_a_run_that_a_start_would_compute_again_gives_way_and_others_stay(packed: Path) -> None:
    unpack(packed, RESULTS)
    plan = open_plan(Path("two.yaml"))
    older, begun = run_folder(plan, 0), run_folder(plan, 1)
    manifest = read_manifest(older)
    manifest["origin"]["template_sha256"] = "of an older solver"
    save_manifest(older, manifest)
    (older / "notes.txt").write_text("mine")
    (begun / "outcome.json").unlink()
    (begun / "work").mkdir()
    deck = (begun / "deck.in").read_text()
    (begun / "deck.in").write_text("another")
    said = unpack(packed, RESULTS)
    assert said.startswith("two: 1 runs taken\n")
    assert f"{begun.name}, begun here with another deck" in said
    assert list(plan.lacks(RESULTS)) == [begun.name]
    assert (older / "notes.txt").read_text() == "mine"
    assert (begun / "work").is_dir()
    (begun / "deck.in").write_text(deck)
    assert unpack(packed, RESULTS).startswith("two: 1 runs taken\n")
    assert plan.lacks(RESULTS) == {}
    assert not (begun / "work").exists()


def test_the_last_state_alone_is_whole_but_cannot_be_measured_again(
    there: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    shutil.copytree(there, tmp_path / "there")
    monkeypatch.chdir(tmp_path / "there")
    plan = open_plan(Path("two.yaml"))
    folder = run_folder(plan)
    file = SnapshotFile(folder, 0)
    for time_s in (0.0, 0.1, 0.2):
        file.append(Snapshot(
            time_s, time_s, "vibrate_1", np.array([1, 2]), np.array([1, 1]),
            np.zeros((2, 2)), np.zeros((2, 2)), np.zeros((2, 3)), np.ones(2),
        ))  # fmt: skip
    file.close()
    manifest = read_manifest(folder)
    manifest["computed"][SNAPSHOTS] = (folder / SNAPSHOTS).stat().st_size
    manifest["sha256"][SNAPSHOTS] = file_digest(folder / SNAPSHOTS)
    save_manifest(folder, manifest)
    pack(plan, RESULTS, last_state=True)
    shutil.rmtree(RESULTS)
    unpack(PACK, RESULTS)
    (last,) = stored_snapshots(folder)
    assert last.times_s()[0] == 0.2
    assert plan.lacks(RESULTS) == {}
    (folder / "measures.tsv").unlink()
    lack = plan.lacks(RESULTS)[folder.name]
    assert (lack.need, "left out of a pack" in lack.why) == (Need.COMPUTE, True)


def test_what_is_not_whole_is_left_out_with_its_reason(packed: Path) -> None:
    unpack(packed, RESULTS)
    plan = open_plan(Path("two.yaml"))
    damaged, stopped = run_folder(plan, 0), run_folder(plan, 1)
    (damaged / "series.tsv").write_bytes(bytes((damaged / "series.tsv").stat().st_size))
    said = pack(plan, RESULTS)
    assert f"left out: {damaged.name}, series.tsv is not as the run wrote it" in said
    (stopped / "outcome.json").unlink()
    (stopped / MANIFEST_FILE).unlink()
    with pytest.raises(BadInputError, match="are not at their end"):
        pack(plan, RESULTS)


Members = dict[str, bytes]


def members_of(path: Path) -> Members:
    with zipfile.ZipFile(path) as zipped:
        return {name: zipped.read(name) for name in zipped.namelist()}


def write(members: Members, path: Path) -> None:
    with zipfile.ZipFile(path, "w") as zipped:
        for name, text in members.items():
            zipped.writestr(name, text)


def written(members: Members, path: Path) -> None:
    """Write a zip as a hand can that knows the format, and make its list right again."""
    listed = json.loads(members["manifest.json"])
    listed["files"] = {
        name.removeprefix("two/"): {"size": len(text), "sha256": digest(text)}
        for name, text in members.items()
        if name != "manifest.json"
    }
    write(members | {"manifest.json": json.dumps(listed).encode()}, path)


def series_in(members: Members) -> str:
    return next(name for name in members if name.endswith("series.tsv"))


def refused(path: Path, said: str) -> None:
    """One sentence, and nothing lies anywhere that was not there before."""
    before = sorted(Path().resolve().parent.rglob("*"))
    with pytest.raises(BadInputError, match=said) as told:
        unpack(path, RESULTS)
    assert "\n" not in str(told.value)
    after = {p for p in Path().resolve().parent.rglob("*") if p.name != "lock"}
    assert after - set(before) <= {RESULTS.resolve(), (RESULTS / "two").resolve()}


@pytest.mark.parametrize(
    "name",
    ["../../../../outside", "/tmp/outside", "work/checkpoint.npz", "last_work/x", "lock",
     "lock_owner", ".hidden", "a\\b", "a\nb", "", "fields/../../x", "fields//x",
     "../../../batches/b.done"],
)  # fmt: skip
def test_names_that_are_no_files_of_a_run_are_refused(name: str, packed: Path) -> None:
    members = members_of(packed)
    series = series_in(members)
    members[series.replace("series.tsv", name)] = members.pop(series)
    written(members, packed)
    refused(packed, "is no file of a run")


def test_rounds_are_taken_where_they_go_on_from_ours(packed: Path) -> None:
    def log(*points: float, basis: str = "b") -> bytes:
        rounds = [
            {"runs": [[{"f": p}, 1]], "setting": {"f": p}, "interval": {}, "spent_core_h": 1.0}
            for p in points
        ]
        tree = {"basis": basis, "rounds": rounds, "ended": "", "certified_hz": []}
        return json.dumps(tree).encode()

    members = members_of(packed)
    for theirs, ours in ((log(1), log(1)), (log(1, 2), log(1, 2)), (log(1), log(1, 2)),
                         (log(1, 3), log(1, 2)), (log(1, 2, basis="c"), log(1, 2))):  # fmt: skip
        written(members | {f"two/{ROUNDS_FILE}": theirs}, packed)
        said = f"{ROUNDS_FILE}, rounds chose other runs here"
        others = theirs in (log(1, 3), log(1, 2, basis="c"))
        assert (said in unpack(packed, RESULTS)) is others
        assert (RESULTS / "two" / ROUNDS_FILE).read_bytes() == ours
    # Those that were unpacked are packed.
    pack(open_plan(Path("two.yaml")), RESULTS)
    assert members_of(packed)[f"two/{ROUNDS_FILE}"] == log(1, 2)
    shutil.rmtree(RESULTS)
    written(members | {f"two/{ROUNDS_FILE}": b"[]"}, packed)
    refused(packed, "no list of rounds")


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda m, name: {name: bytes([m[name][0] ^ 1]) + m[name][1:]}, "does not match its hash"),
        (lambda m, name: {name: b""}, "is not as its manifest.json says"),
        (lambda m, name: {name: None}, "is not as its manifest.json says"),
        (lambda m, name: {name + "x": b""}, "is not as its manifest.json says"),
        (lambda m, name: {"manifest.json": b"{}"}, "a whole pack of runs"),
        (lambda m, name: {"manifest.json": b"[" * 100_000}, "a whole pack of runs"),
        (
            lambda m, name: {"manifest.json": m["manifest.json"].replace(b"pack 2", b"pack 3")},
            "its manifest.json is none of ours",
        ),
        (
            lambda m, name: {"manifest.json": m["manifest.json"].replace(b'"two"', b'"../two"')},
            "its manifest.json is none of ours",
        ),
        (lambda m, name: {"manifest.json": None}, "no item named 'manifest.json'"),
    ],
)
def test_what_is_not_as_the_list_says_is_refused(
    change: Callable[[Members, str], dict[str, bytes | None]], said: str, packed: Path
) -> None:
    members = members_of(packed)
    changed = members | change(members, series_in(members))
    write({name: text for name, text in changed.items() if text is not None}, packed)
    refused(packed, said)


@pytest.mark.parametrize(
    ("key", "value"),
    [("flag_bits", 1), ("compress_type", 99), ("file_size", 10**9), ("CRC", 7),
     ("header_offset", 10**6)],
)  # fmt: skip
def test_false_heads_are_refused(key: str, value: int, packed: Path) -> None:
    with zipfile.ZipFile(packed, "a") as zipped:
        setattr(zipped.getinfo(series_in(members_of(packed))), key, value)
        zipped.comment = b"so that heads are written again"
    refused(packed, "a whole pack of runs")


def test_torn_files_and_other_files_are_refused(packed: Path) -> None:
    whole = packed.read_bytes()
    for number in (0, 10, len(whole) * 3 // 4, len(whole) - 1):
        packed.write_bytes(whole[:number])
        refused(packed, "a whole pack of runs")
    # Its directory would take all memory.
    end = whole.rindex(b"PK\5\6") + 12
    packed.write_bytes(whole[:end] + b"\xff\xff\xff\x7f" + whole[end + 4 :])
    refused(packed, "a whole pack of runs")
    packed.unlink()
    refused(packed, "No such file")
    os.mkfifo(packed)
    refused(packed, "it is no plain file")


DEEP = b"[" * 100_000


@pytest.mark.parametrize(
    ("file", "change", "why"),
    [
        ("series.tsv", lambda text, of_other: None, "series.tsv is missing"),
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
        ("scenario.yaml", lambda text, of_other: DEEP, "cannot be read by this version"),
        ("scenario.yaml", lambda text, of_other: b"- &a []\n- *a", "cannot be read by this"),
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
    # What a kill left behind is cleared away.
    (RESULTS / "two" / "unpacking.partial").mkdir(parents=True)
    said = unpack(packed, RESULTS)
    assert said.startswith("two: 1 runs taken\n")
    assert f"not taken: {run}, " in said
    assert why in said
    left = {path.name for path in (RESULTS / "two" / "runs").iterdir()}
    assert left == {Path(other).parent.name}
    assert not list(RESULTS.rglob("*.partial"))


def test_files_that_a_scenario_names_are_not_opened(packed: Path) -> None:
    """A deck of the user's own names its template, which may be any file of this machine."""
    scenario = OwnDeck(template="nowhere/deck.in.j2")
    run = Run("two", "own_r1_0a1b2c", {}, 1, scenario, {})
    write_plan([run], Path("plan"))
    template_sha256 = kind_of(scenario).planning.template_hash(scenario)
    origin = {"scenario_sha256": scenario_hash(scenario), "template_sha256": template_sha256}
    members = members_of(packed)
    texts = {
        "scenario.yaml": (Path("plan") / run.place / "scenario.yaml").read_bytes(),
        "deck.in": b"run 0",
        "products.json": json.dumps({"origin": origin, "computed": {}, "measured": {}}).encode(),
        "outcome.json": members[series_in(members).replace("series.tsv", "outcome.json")],
    }
    listed = {"manifest.json": members["manifest.json"]}
    written({f"two/{run.place}/{name}": text for name, text in texts.items()} | listed, packed)
    assert unpack(packed, RESULTS) == "two: 1 runs taken"


def test_a_disk_that_takes_no_more_is_said_in_a_sentence(
    packed: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def no_space(*_: object) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    with monkeypatch.context() as full:
        full.setattr(shutil, "copyfileobj", no_space)
        refused(packed, "a folder that takes files: it does not")
    unpack(packed, RESULTS)
    plan = open_plan(Path("two.yaml"))
    with pytest.raises(BadInputError, match=r"name ends in \.zip"):
        pack(plan, RESULTS, Path("runs.tar.xz"))
    with pytest.raises(BadInputError, match="--output = 'nowhere' cannot be used"):
        pack(plan, RESULTS, Path("nowhere/runs.zip"))
    before = sorted(Path().iterdir()), packed.read_bytes()
    with monkeypatch.context() as full:
        full.setattr(shutil, "copyfileobj", no_space)
        with pytest.raises(BadInputError, match="No space left on device"):
            pack(plan, RESULTS)
    assert before == (sorted(Path().iterdir()), packed.read_bytes())

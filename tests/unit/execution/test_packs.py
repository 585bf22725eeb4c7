"""Finished runs travel from folder to folder; what is foreign or torn is refused in a sentence."""

from __future__ import annotations

import io
import json
import lzma
import os
import shutil
import tarfile
from collections.abc import Callable
from pathlib import Path

import pytest

from sandmould.bad_input import BadInputError
from sandmould.execution.packs import recorded
from sandmould.execution.packs.pack import pack
from sandmould.execution.packs.rounds import merge_rounds
from sandmould.execution.packs.unpack import unpack
from sandmould.runs.manifest import MANIFEST_FILE
from sandmould.study.collect import collect
from sandmould.study.plan.batches import mark_done
from sandmould.study.plan.build_plan import RESULTS, Plan, announce, open_plan
from sandmould.study.plan.lacking import Need
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
    file = pack(open_plan(Path("two.yaml")), RESULTS, tmp_path / "two.tar.xz").path
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
    assert again == Path("two_runs.tar.xz")
    assert again.read_bytes() == packed.read_bytes()
    assert unpack(packed, RESULTS).text() == "two: 0 runs taken, 2 here already"
    with tarfile.open(again) as archive:
        assert archive.getnames()[0] == "two/pack.json"


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
    assert f"with other digits, ours stay: {one.name}" in said
    assert f"not taken: {other.name}, at its end here with another scenario" in said
    shutil.rmtree(other)
    assert unpack(packed, RESULTS).taken == [other.name]
    # In a folder of packs each run is once.
    Path("packs").mkdir()
    first = pack(plan, RESULTS, Path("packs"))
    assert first.path.parent == Path("packs")
    assert first.path.name.startswith("two_")
    with pytest.raises(BadInputError, match="packed in packs already"):
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
    whole = pack(plan, RESULTS, tmp_path / "whole.tar.xz")
    small = pack(plan, RESULTS, tmp_path / "small.tar.xz", last_state=True)
    assert small.index.bytes < whole.index.bytes
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
    assert "left out: 1, not at their end" in said
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


def changed(change: Callable[[dict[str, bytes]], None], path: Path) -> None:
    """Write a pack anew with other members, as a hand that knows the format can."""
    with tarfile.open(path) as archive:
        members = {i.name: archive.extractfile(i).read() for i in archive.getmembers()}  # type: ignore[union-attr]
    change(members)
    out = io.BytesIO()
    with tarfile.open(fileobj=out, mode="w", format=tarfile.USTAR_FORMAT) as archive:
        for name, text in members.items():
            info = tarfile.TarInfo(name)
            info.size = len(text)
            archive.addfile(info, io.BytesIO(text))
    path.write_bytes(lzma.compress(out.getvalue()))


def renamed(new: str) -> Callable[[dict[str, bytes]], None]:
    """Call a file of the first run otherwise, in the index and in the archive."""

    def change(members: dict[str, bytes]) -> None:
        index = json.loads(members["two/pack.json"])
        run, held = next(iter(index["runs"].items()))
        held["files"] = {new if n == "series.tsv" else n: f for n, f in held["files"].items()}
        body = members.pop(f"two/runs/{run}/series.tsv")
        rest = {n: members.pop(n) for n in list(members) if n != "two/pack.json"}
        members["two/pack.json"] = json.dumps(index).encode()
        members[f"two/runs/{run}/{new}"] = body
        members.update(rest)

    return change


def damaged(members: dict[str, bytes]) -> None:
    name = next(n for n in members if n.endswith("series.tsv"))
    members[name] = bytes([members[name][0] ^ 1]) + members[name][1:]


def emptied(members: dict[str, bytes]) -> None:
    name = next(n for n in members if n.endswith("outcome.json"))
    members[name] = b""


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (renamed("../../../../outside"), "has a file of the name"),
        (renamed("/tmp/outside"), "has a file of the name"),
        (renamed("work/checkpoint.npz"), "has a file of the name"),
        (renamed("deck.in/inner"), "has a file and a folder of the name"),
        (renamed("lock"), "has a file of the name"),
        (damaged, "does not match its hash"),
        (emptied, "is not where its index says"),
        (lambda members: members.update({"two/pack.json": b"{}"}), "its index is none of ours"),
        (lambda members: members.pop("two/pack.json"), "does not begin with an index"),
    ],
)
def test_a_pack_that_is_not_ours_is_refused(
    change: Callable[[dict[str, bytes]], None], said: str, packed: Path
) -> None:
    changed(change, packed)
    with pytest.raises(BadInputError, match=said):
        unpack(packed, RESULTS)
    assert not list(packed.parent.parent.rglob("outside"))
    assert not list(RESULTS.rglob("*.partial"))


def test_links_torn_files_and_bombs_are_refused(packed: Path, tmp_path: Path) -> None:
    whole = packed.read_bytes()
    (tmp_path / "torn.tar.xz").write_bytes(whole[: len(whole) * 3 // 4])
    with pytest.raises(BadInputError, match="it is cut short"):
        unpack(tmp_path / "torn.tar.xz", RESULTS)
    link = tmp_path / "link.tar.xz"
    with tarfile.open(link, "w:xz", format=tarfile.USTAR_FORMAT) as archive:
        info = tarfile.TarInfo("two/pack.json")
        info.type, info.linkname = tarfile.SYMTYPE, "/etc/passwd"
        archive.addfile(info)
    with pytest.raises(BadInputError, match="no plain file"):
        unpack(link, RESULTS)
    info = tarfile.TarInfo("two/pack.json")
    info.size = 40_000_000
    bomb = tmp_path / "bomb.tar.xz"
    bomb.write_bytes(lzma.compress(info.tobuf() + bytes(info.size), preset=0))
    with pytest.raises(BadInputError, match="it swells to more"):
        unpack(bomb, RESULTS)

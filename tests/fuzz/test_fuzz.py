"""No reader of foreign files ends in a traceback, hangs, or writes beside the results."""

from __future__ import annotations

import random
import shutil
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.fuzz.campaign import corpus_findings, fuzz
from tests.fuzz.mutate import mutated
from tests.fuzz.readers import READERS, Reader
from tests.fuzz.watched import Watched

SECONDS = 25.0
"""`make fuzz` reads for an hour."""


@pytest.fixture(scope="module")
def watched() -> Iterator[Watched]:
    process = Watched()
    yield process
    process.close()


@pytest.mark.slow
def test_files_of_the_corpus_are_read_or_refused(watched: Watched) -> None:
    assert corpus_findings(watched) == []


@pytest.mark.parametrize("name", READERS)
def test_files_of_the_corpus_are_sound_unless_told_otherwise(name: str, tmp_path: Path) -> None:
    """A damaged seed is refused at its damage: no damage behind it is ever reached."""
    reader = READERS[name]
    for number, seed in enumerate(reader.sound(name)):
        place = tmp_path / str(number) / f"file{seed.suffix}"
        place.parent.mkdir()
        shutil.copyfile(seed, place)
        assert reader.read(place) is not None, seed.name


@pytest.mark.slow
def test_damaged_files_are_read_or_refused(watched: Watched) -> None:
    count, found = fuzz(watched, SECONDS, seed=1)
    assert [(f.reader, f.what.splitlines()[-1]) for f in found] == []
    # A reader that is seldom asked is not tested: one that is slow would stop the others.
    assert min(count.values()) > 8


@pytest.mark.slow
@pytest.mark.parametrize(
    ("what", "told"),
    [
        ("raise KeyError(str(path))", "KeyError"),
        ("raise ValueError('')", "refuses without a word"),
        ("open('/tmp/beside', 'w')", "open of /tmp/beside"),
        ("import subprocess; subprocess.run(['true'])", "subprocess.Popen"),
        ("import os; os._exit(3)", "exit code 3"),
        ("while True: pass", "hangs"),
    ],
)
def test_what_a_reader_must_not_do_is_found(
    watched: Watched, monkeypatch: pytest.MonkeyPatch, what: str, told: str
) -> None:
    monkeypatch.setattr("tests.fuzz.watched.LIMIT_S", 60.0 if "hangs" not in told else 1.0)
    path_data = what.encode()
    assert told in watched.finding("probe", path_data, ".py")


def test_damage_is_the_same_each_time_and_seldom_none() -> None:
    for name, reader in READERS.items():
        data = reader.seeds(name)[0].read_bytes()
        first = [mutated(data, [data], random.Random(n)) for n in range(50)]
        again = [mutated(data, [data], random.Random(n)) for n in range(50)]
        assert first == again
        assert sum(damaged != data for damaged in first) > 35, name


def test_every_reader_has_files_and_every_folder_a_reader() -> None:
    from tests.fuzz.readers import CORPUS

    assert {path.name for path in CORPUS.iterdir() if path.is_dir()} == set(READERS)
    assert all(isinstance(r, Reader) and r.seeds(name) for name, r in READERS.items())

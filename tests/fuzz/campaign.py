"""A campaign: every file of the corpus, then damaged ones until the time is up.

``python -m tests.fuzz.campaign --minutes 60`` runs a long one and keeps what it finds.
"""

from __future__ import annotations

import argparse
import itertools
import random
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from sandmould.digest import digest
from tests.fuzz.mutate import mutated
from tests.fuzz.readers import READERS
from tests.fuzz.watched import Watched


@dataclass(frozen=True)
class Finding:
    """A file that a reader did not take in order."""

    reader: str
    data: bytes
    suffix: str
    what: str


def corpus_findings(watched: Watched, names: tuple[str, ...] = tuple(READERS)) -> list[Finding]:
    """Read every file of the corpus: sound ones, and those that once were findings."""
    found = []
    for name in names:
        for seed in READERS[name].seeds(name):
            if what := watched.finding(name, seed.read_bytes(), seed.suffix):
                found.append(Finding(name, seed.read_bytes(), seed.suffix, what))
    return found


def fuzz(
    watched: Watched,
    seconds: float,
    seed: int,
    tell: Callable[[Finding], None] = lambda _: None,
) -> tuple[dict[str, int], list[Finding]]:
    """Damage files of all readers in turn until the time is up, and tell of each finding at once.

    Returns
    -------
    (dict of reader to files read, list of Finding)
    """
    chance = random.Random(seed)
    end_s = time.monotonic() + seconds
    seeds = {
        name: [(p.read_bytes(), p.suffix) for p in r.seeds(name)] for name, r in READERS.items()
    }
    count, found = dict.fromkeys(READERS, 0), []
    for name in itertools.cycle(READERS):
        if time.monotonic() > end_s:
            break
        data, suffix = chance.choice(seeds[name])
        data = mutated(data, [other for other, _ in seeds[name]], chance)
        count[name] += 1
        if what := watched.finding(name, data, suffix):
            found.append(Finding(name, data, suffix, what))
            tell(found[-1])
    return count, found


def keep(finding: Finding, folder: Path) -> Path:
    """Write a finding's file and what happened beside it."""
    place = folder / finding.reader
    place.mkdir(parents=True, exist_ok=True)
    path = place / f"{digest(finding.data)[:12]}{finding.suffix}"
    path.write_bytes(finding.data)
    path.with_suffix(".txt").write_text(finding.what, encoding="utf-8")
    return path


def main() -> int:
    """Run a campaign from the command line."""
    parser = argparse.ArgumentParser(description="Read damaged files until the time is up.")
    parser.add_argument("--minutes", type=float, default=60.0)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--out", type=Path, default=Path("results/fuzz"))
    options = parser.parse_args()

    def tell(finding: Finding) -> None:
        print(f"{keep(finding, options.out)}: {finding.what.splitlines()[-1]}", flush=True)

    watched = Watched()
    found = corpus_findings(watched)
    for finding in found:
        tell(finding)
    count, more = fuzz(watched, 60.0 * options.minutes, options.seed, tell)
    watched.close()
    for name, files in count.items():
        print(f"{name}: {files} damaged files")
    return 1 if found or more else 0


if __name__ == "__main__":
    raise SystemExit(main())

"""Who works in a folder, as every machine sees it that shares the file system.

``flock`` reaches as far as one machine on many of the file systems of clusters, and is missing on
some. So whoever holds it also claims the folder by a file that names its machine, process and job:
a hard link makes it, which one of several takers gets on any file system, and its time is renewed
while its owner lives. Nothing but the standard library is loaded here.
"""

from __future__ import annotations

import contextlib
import json
import math
import os
import secrets
import socket
import sys
import threading
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path

CLAIM_FILE = "lock_owner"
BEAT_S = 15.0
"""Between two renewals."""
STALE_S = 180.0
"""After so long without one the owner counts as gone: a client of NFS may see a time a minute
late, and a busy machine may renew it late."""
_POLL_S = 2.0


@dataclass(frozen=True)
class Owner:
    """Who claimed a folder."""

    host: str
    boot: str
    """Of the machine since it was started: two may have one name."""
    pid: int
    job: str
    """Number of the job of a cluster, empty outside of one."""
    token: str

    @property
    def here(self) -> bool:
        """Whether it is a process of this machine."""
        return self.boot == _boot()

    def text(self) -> str:
        """As a person would say it."""
        return f"job {self.job} on {self.host}" if self.job else f"{self.host}, process {self.pid}"


class Claim:
    """A claim to a folder, held until it is let go or its process ends."""

    def __init__(self, folder: Path, alone: bool, lost: Callable[[], None] = lambda: None) -> None:
        """Wait until nobody else claims the folder, and claim it.

        Parameters
        ----------
        alone : bool
            Whether no other process of this machine works there, since the caller holds its flock:
            whoever of this machine claimed it has ended then.
        lost : callable
            Called, in a thread, when another has taken over from this process: it was stopped for
            longer than ``STALE_S``, and must not write into the folder any more.

        Raises
        ------
        OSError
            Where the folder takes no file.
        """
        folder = folder.absolute()  # an engine may work in another folder while it is renewed
        self._path = folder / CLAIM_FILE
        self._lost = lost
        job = os.environ.get("SLURM_JOB_ID", "")
        token = secrets.token_hex(8)
        self._owner = Owner(socket.gethostname(), _boot(), os.getpid(), job, token)
        self._own = folder / f"{CLAIM_FILE}.{token}"
        self._own.write_text(json.dumps(asdict(self._owner)), encoding="utf-8")
        try:
            self._wait(folder, alone)
        finally:
            self._own.unlink(missing_ok=True)
        self._over = threading.Event()
        threading.Thread(target=self._renew, daemon=True).start()

    def let_go(self) -> None:
        """Let others claim the folder."""
        self._over.set()
        if self._is_ours():
            self._path.unlink(missing_ok=True)

    def _wait(self, folder: Path, alone: bool) -> None:
        said = False
        while not self._made():
            owner, age_s = _look(self._path, self._now_s())
            if owner is not None and owner.here and (alone or _has_ended(owner.pid)):
                age_s = math.inf
            if age_s > STALE_S:
                self._take_over(owner)
                continue
            if not said and owner is not None:
                print(f"{folder}: waiting for {owner.text()}, which works there", file=sys.stderr)
                said = True
            time.sleep(_POLL_S)

    def _made(self) -> bool:
        """Whether our file is the folder's now."""
        try:
            os.link(self._own, self._path)
        except FileExistsError:
            return False
        except OSError:  # a file system without links
            try:
                with self._path.open("x", encoding="utf-8") as file:
                    file.write(self._own.read_text(encoding="utf-8"))
            except FileExistsError:
                return False
        return True

    def _now_s(self) -> float:
        """Time as the file system has it, to compare with times of its files."""
        os.utime(self._own)
        return self._own.stat().st_mtime

    def _take_over(self, judged: Owner | None) -> None:
        """Move a dead owner's file away; of several takers one gets it.

        Whoever moved that of a new owner, made since the dead one was judged, puts it back.
        """
        aside = self._own.with_suffix(".aside")
        with contextlib.suppress(FileNotFoundError):
            os.rename(self._path, aside)
            if _look(aside, 0.0)[0] != judged:
                with contextlib.suppress(FileExistsError):
                    os.link(aside, self._path)
            aside.unlink()

    def _is_ours(self) -> bool:
        return _look(self._path, 0.0)[0] == self._owner

    def _renew(self) -> None:
        while not self._over.wait(BEAT_S):
            if not self._is_ours():
                if not self._over.is_set():
                    self._lost()
                return
            with contextlib.suppress(OSError):
                os.utime(self._path)


def owner_of(folder: Path, here: bool = False) -> Owner | None:
    """Who claims a folder and has renewed that lately; None where nobody has.

    ``here``: whether processes of this machine count. Where flock works, that is the better answer:
    one that was killed just now does not hold it.
    """
    owner, age_s = _look(folder / CLAIM_FILE, time.time())
    if owner is None or age_s > STALE_S:
        return None
    return owner if not owner.here or (here and not _has_ended(owner.pid)) else None


def _look(path: Path, now_s: float) -> tuple[Owner | None, float]:
    """Owner that a file names and how old the file is; None for one that is damaged.

    Where there is no file any more its age is 0: nobody takes over from it.
    """
    try:
        if path.is_fifo():  # to open it would never end
            return None, now_s - path.stat().st_mtime
        with path.open(encoding="utf-8") as file:  # opened, a file of NFS shows its newest time
            age_s = now_s - os.fstat(file.fileno()).st_mtime
            text = file.read()
    except OSError:
        return None, 0.0
    try:
        return Owner(**json.loads(text)), age_s
    except (ValueError, TypeError):
        return None, age_s


def _has_ended(pid: int) -> bool:
    """Whether no process of this machine has a number."""
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return True
    except PermissionError:  # somebody else's
        return False
    return False


def _boot() -> str:
    """What tells this machine, as it runs now, from others."""
    with contextlib.suppress(OSError):
        return Path("/proc/sys/kernel/random/boot_id").read_text(encoding="ascii").strip()
    return socket.gethostname()

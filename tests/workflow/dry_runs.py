"""Dry runs of Snakemake, each in a fork of one process that has imported all that they need.

Two thirds of a dry run of a small study are imports.
"""

from __future__ import annotations

import multiprocessing
import os
import sys
import tempfile
from pathlib import Path
from subprocess import CompletedProcess

from sandmould import ROOT

_FORKS = multiprocessing.get_context("forkserver")
_FORKS.set_forkserver_preload(
    [
        "snakemake.api", "snakemake.cli", "snakemake.workflow", "sandmould.execution.run_study",
        *(f"sandmould.kinds.{kind}.planning" for kind in ("sand", "flow", "solidification")),
        __name__,
    ]
)  # fmt: skip
LIMIT_S = 300.0


def dry_run(*arguments: str, folder: Path) -> CompletedProcess[str]:
    """Call ``snakemake --dry-run`` in a folder, with further arguments.

    Raises
    ------
    TimeoutError
    """
    command = ["snakemake", "--dry-run", "--snakefile", str(ROOT / "Snakefile"), *arguments]
    with tempfile.TemporaryDirectory() as name:
        said = [Path(name, stream) for stream in ("stdout", "stderr")]
        cache = os.environ["XDG_CACHE_HOME"]  # the server of forks has that of an earlier test
        arguments = (command, folder.absolute(), cache, *said)
        process = _FORKS.Process(target=_snakemake, args=arguments)
        process.start()
        process.join(LIMIT_S)
        if process.exitcode is None:
            process.kill()
            raise TimeoutError(" ".join(command))
        return CompletedProcess(command, process.exitcode, *(path.read_text() for path in said))


def _snakemake(command: list[str], folder: Path, cache: str, stdout: Path, stderr: Path) -> None:
    os.environ["XDG_CACHE_HOME"] = cache
    for number, path in ((1, stdout), (2, stderr)):
        os.dup2(os.open(path, os.O_WRONLY | os.O_CREAT), number)
    os.chdir(folder)
    sys.argv = command
    from snakemake.cli import main

    main()

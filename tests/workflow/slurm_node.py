"""A Slurm of one node, started for a test from Debian's packages, without systemd."""

from __future__ import annotations

import os
import secrets
import shutil
import socket
import subprocess
import time
from pathlib import Path

NEEDED = ("slurmctld", "slurmd", "munged", "sbatch", "squeue", "scancel")
_CONF = """\
ClusterName=test
SlurmctldHost={host}(127.0.0.1)
SlurmctldPort={ports[0]}
SlurmdPort={ports[1]}
SlurmUser={user}
SlurmdUser={user}
AuthType=auth/munge
AuthInfo=socket={folder}/munge/socket,cred_expire=10
CredType=cred/munge
StateSaveLocation={folder}/state
SlurmdSpoolDir={folder}/spool
SlurmctldPidFile={folder}/slurmctld.pid
SlurmdPidFile={folder}/slurmd.pid
SlurmctldLogFile={folder}/slurmctld.log
SlurmdLogFile={folder}/slurmd.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
JobAcctGatherType=jobacct_gather/none
AccountingStorageType=accounting_storage/none
SwitchType=switch/none
MpiDefault=none
ReturnToService=2
SelectType=select/cons_tres
SelectTypeParameters=CR_Core_Memory
SchedulerParameters=sched_interval=2,bf_interval=2,sched_min_interval=0
CommunicationParameters=NoCtldInAddrAny,NoInAddrAny
MailProg=/bin/true
MinJobAge=3600
KillWait=2
NodeName={host} NodeAddr=127.0.0.1 CPUs={cpus} RealMemory={memory_mb} State=UNKNOWN
PartitionName=main Nodes={host} Default=YES MaxTime=INFINITE State=UP
PartitionName=short Nodes={host} MaxTime=5 State=UP
"""
UP_S = 30.0


def missing() -> list[str]:
    """Programs of Slurm that are not installed."""
    path = f"{os.environ['PATH']}:/usr/sbin"
    return [name for name in NEEDED if shutil.which(name, path=path) is None]


class SlurmNode:
    """Controller, node and key daemon in a folder of their own."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        for name in ("state", "spool", "munge"):
            (folder / name).mkdir(parents=True)
        conf = folder / "slurm.conf"
        conf.write_text(
            _CONF.format(
                folder=folder,
                host=socket.gethostname().split(".")[0],
                ports=_free_ports(2),
                user=_user(),
                cpus=os.cpu_count(),
                memory_mb=os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") // 2**21,
            )
        )
        # Snakemake's jobs hide SLURM_CONF from these, which then look at the cluster's usual place.
        programs = folder / "bin"
        programs.mkdir()
        for name in ("srun", "sbatch", "squeue", "scancel"):
            (programs / name).write_text(
                f'#!/bin/sh\nSLURM_CONF={conf} exec {shutil.which(name)} "$@"\n'
            )
            (programs / name).chmod(0o755)
        self.environment = os.environ | {
            "SLURM_CONF": str(conf),
            "PATH": f"{programs}:{os.environ['PATH']}:/usr/sbin",
        }

    def start(self) -> None:
        """Start all daemons and wait for the node."""
        key = self.folder / "munge" / "key"
        key.write_bytes(secrets.token_bytes(1024))
        key.chmod(0o400)
        munge = self.folder / "munge"
        self._run(
            "munged", "--force", f"--key-file={key}", f"--socket={munge}/socket",
            f"--pid-file={self.folder}/munged.pid", f"--seed-file={munge}/seed",
            f"--log-file={munge}/log",
        )  # fmt: skip
        self._run("slurmctld")
        self._run("slurmd")
        deadline = time.monotonic() + UP_S
        while self._run("sinfo", "-h", "-o", "%t").strip() != "idle":
            assert time.monotonic() < deadline, self._logs()
            time.sleep(0.2)

    def jobs(self) -> dict[str, str]:
        """State of every job that has not ended, by its number."""
        lines = self._run("squeue", "-h", "-o", "%i %T").splitlines()
        known = dict(line.split() for line in lines)
        return {job: state for job, state in known.items() if state in ("PENDING", "RUNNING")}

    def told(self, field: str) -> dict[str, str]:
        """What squeue says of every job that has not ended, such as ``%l``, by its number."""
        lines = self._run("squeue", "-h", "-o", f"%i {field}").splitlines()
        return dict(line.split(maxsplit=1) for line in lines)

    def submit(self, *options: str) -> str:
        """Submit a job that does nothing; gives its number."""
        return self._run("sbatch", "--parsable", *options, "--wrap=true").strip()

    def take_jobs(self, state: str) -> None:
        """Let the node begin jobs (``resume``) or not (``drain``)."""
        node = self._run("sinfo", "-h", "-o", "%n").strip()
        self._run("scontrol", "update", f"nodename={node}", f"state={state}", "reason=test")

    def requeue(self, job: str) -> None:
        """End a job and put it into the queue again, as after the loss of its node."""
        self._run("scontrol", "requeue", job)

    def cancel(self, job: str) -> None:
        """Cancel a job, as a user or an operator does."""
        self._run("scancel", job)

    def stop(self) -> None:
        """End all jobs and daemons."""
        self._run("scancel", "--user", _user())
        for name in ("slurmd", "slurmctld", "munged"):
            pid = self.folder / f"{name}.pid"
            if pid.is_file():
                subprocess.run(["kill", pid.read_text().strip()], check=False)
                deadline = time.monotonic() + 10.0
                while pid.is_file() and time.monotonic() < deadline:
                    time.sleep(0.1)

    def _run(self, *command: str) -> str:
        ran = subprocess.run(
            command, env=self.environment, capture_output=True, text=True, timeout=60
        )
        assert ran.returncode == 0, f"{command}: {ran.stderr}\n{self._logs()}"
        return ran.stdout

    def _logs(self) -> str:
        logs = sorted(self.folder.glob("*.log"))
        return "\n".join(f"{log.name}: {log.read_text()[-2000:]}" for log in logs)


def _user() -> str:
    return subprocess.run(["id", "-un"], capture_output=True, text=True, check=True).stdout.strip()


def _free_ports(number: int) -> list[int]:
    sockets = [socket.socket() for _ in range(number)]
    for one in sockets:
        one.bind(("127.0.0.1", 0))
    ports = [int(one.getsockname()[1]) for one in sockets]
    for one in sockets:
        one.close()
    return ports

"""A Slurm of two nodes on this machine alone, out of Debian's packages."""

from __future__ import annotations

import os
import socket
import subprocess
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path

from foreign_systems import program

NODES = ("node1", "node2")
_PACKAGES = ("slurm-wlm", "munge")
_PROGRAMS = ("munged", "slurmctld", "slurmd", "sbatch", "squeue", "sinfo", "scontrol", "scancel")
_PATIENCE = 60.0  # seconds in which all nodes must be there, or free

# cred_expire: for so long a task that was requeued waits, and 120 seconds is the least otherwise. The communication is
# on this machine alone.
_CONFIGURATION = """\
ClusterName=tried
SlurmctldHost={host}(127.0.0.1)
SlurmctldPort={ports[0]}
CommunicationParameters=NoCtldInAddrAny,NoInAddrAny
AuthType=auth/munge
AuthInfo=socket={folder}/munge.socket,cred_expire=5
SlurmUser=root
StateSaveLocation={folder}/state
SlurmdSpoolDir={folder}/%n
SlurmctldPidFile={folder}/slurmctld.pid
SlurmdPidFile={folder}/%n.pid
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
MpiDefault=none
SchedulerParameters=sched_interval=2,bf_interval=2
ReturnToService=2
NodeName={nodes[0]} NodeHostname={host} NodeAddr=127.0.0.1 Port={ports[1]}
NodeName={nodes[1]} NodeHostname={host} NodeAddr=127.0.0.1 Port={ports[2]}
PartitionName=all Nodes=ALL Default=YES MaxTime=INFINITE State=UP
"""


@contextmanager
def slurm() -> Iterator[dict[str, str]]:
    """Slurm while it runs; what its commands want in their environment. Each node takes one task at a time.

    Raises Unavailable where it cannot be installed. SystemExit where it does not start."""
    for name in _PROGRAMS:
        program(name, *_PACKAGES)
    # Its settings bear no spaces, and names of sockets are short.
    with tempfile.TemporaryDirectory(prefix="slurm-", dir="/tmp") as place, ExitStack() as running:
        folder = Path(place)
        others = {name: value for name, value in os.environ.items() if not name.startswith(("SLURM_", "SBATCH_"))}
        environment = {**others, "SLURM_CONF": str(_configured(folder))}
        own = [f"--{kind}-file={folder}/munge.{kind}" for kind in ("pid", "log", "seed", "key")]
        bus = folder / "munge.socket"
        munged = ["munged", "--foreground", "--force", f"--socket={bus}", *own]
        daemons = {"munged": munged, "slurmctld": ["slurmctld", "-D"]}
        daemons |= {node: ["slurmd", "-D", "-N", node] for node in NODES}
        for name, words in daemons.items():
            running.enter_context(_daemon(words, environment, folder / f"{name}.log"))
            _wait_until(bus.exists, folder)
        _wait_until(lambda: _idle(environment), folder)
        try:
            yield environment
        finally:  # what still runs outlives the daemons
            _say(environment, "scancel", "--full", "--user", "root")
            _wait_until(lambda: not _say(environment, "squeue", "--noheader"), folder)


def _configured(folder: Path) -> Path:
    """The file of its settings, beside which there is all that it names."""
    key, configuration = folder / "munge.key", folder / "slurm.conf"
    (folder / "state").mkdir()
    key.write_bytes(os.urandom(128))
    key.chmod(0o600)
    host = socket.gethostname().partition(".")[0]
    filled = {"host": host, "folder": folder, "nodes": NODES, "ports": _free_ports(1 + len(NODES))}
    configuration.write_text(_CONFIGURATION.format(**filled), encoding="utf-8")
    return configuration


@contextmanager
def _daemon(words: Sequence[str], environment: dict[str, str], log: Path) -> Iterator[None]:
    with log.open("wb") as out:
        process = subprocess.Popen(words, env=environment, stdout=out, stderr=out, stdin=subprocess.DEVNULL)
    try:
        yield
    finally:
        process.terminate()
        try:
            process.wait(10.0)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()


def _idle(environment: dict[str, str]) -> bool:
    return _say(environment, "sinfo", "-hN", "-o", "%T").split() == ["idle"] * len(NODES)


def _say(environment: dict[str, str], *words: str) -> str:
    """What a command of Slurm's says."""
    return subprocess.run(words, env=environment, capture_output=True, text=True).stdout


def _wait_until(there: Callable[[], bool], folder: Path) -> None:
    end = time.monotonic() + _PATIENCE
    while not there():
        if time.monotonic() > end:
            logs = "\n".join(log.read_text(errors="replace") for log in sorted(folder.glob("*.log")))
            raise SystemExit(f"FAILED: Slurm is there and does not start, or end:\n{logs}")
        time.sleep(0.2)


def _free_ports(count: int) -> list[int]:
    with ExitStack() as held:
        sockets = [held.enter_context(socket.socket()) for _ in range(count)]
        for each in sockets:
            each.bind(("127.0.0.1", 0))
        return [each.getsockname()[1] for each in sockets]

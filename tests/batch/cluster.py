"""Twenty tiny jobs on Slurm with two virtual nodes on this machine; one dies during conditions, one during distill.

    python -m tests.batch.cluster [--jobs 20] [--folder FOLDER]

A node is a slurmd of its own; it dies by SIGKILL, with everything that runs on it, and comes back half a minute later. Needs
root and Debian's slurmctld, slurmd, slurm-client and munge; writes /etc/slurm/slurm.conf, where no other cluster may be, and
removes it again.
"""

import argparse
import contextlib
import os
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

from dreammat_cli.jobs import read
from stages.batch.jobs import Job
from stages.batch.summary import outputs, run_logs, summarise
from stages.core.artifact import intact, read_json, read_manifest
from stages.core.schemas import ASSET, CONDITIONS
from tests.batch import campaign
from tests.batch.campaign import ROOT, TINY, artefacts, by_hand, environment, times, write_jobs
from tests.pipeline import cube_sphere

VIEWS = 24
LONG = {"conditions": f"--views {VIEWS} --size 64 --env overcast --quality draft", "distill": "--steps 2000"}
"""Of the job in whose midst nodes die: the distillation takes longer than a minute, after which there is a checkpoint."""

CONF = Path("/etc/slurm/slurm.conf")
NODES = ("n1", "n2")
SETTINGS = """ClusterName=virtual
SlurmctldHost={host}
AuthType=auth/munge
AuthInfo=socket={folder}/munge.socket
CredType=cred/munge
SlurmUser=root
StateSaveLocation={folder}/state
SlurmdSpoolDir={folder}/%n
SlurmctldPidFile={folder}/slurmctld.pid
SlurmdPidFile={folder}/%n.pid
SlurmctldLogFile={folder}/slurmctld.log
SlurmdLogFile={folder}/%n.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
JobAcctGatherType=jobacct_gather/none
AccountingStorageType=accounting_storage/none
MpiDefault=none
SwitchType=switch/none
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU_Memory
SlurmdTimeout=10
ReturnToService=2
MinJobAge=600
NodeName=n[1-2] NodeHostname={host} Port=[17001-17002] CPUs=2 RealMemory=6000 State=UNKNOWN
PartitionName=all Nodes=n[1-2] Default=YES MaxTime=INFINITE State=UP
"""


@contextlib.contextmanager
def slurm(folder: Path) -> Iterator[Path]:
    """The cluster, whose own files are in a folder; every daemon that was started is ended."""
    needed = ("munged", "mungekey", "slurmctld", "slurmd", "sbatch")
    missing = [name for name in needed if not shutil.which(name, path="/usr/sbin:/usr/bin")]
    if missing or os.geteuid() != 0:
        sys.exit(f"needs root, and {', '.join(missing) or 'nothing more'}: apt-get install slurmctld slurmd slurm-client munge")
    if CONF.exists():
        sys.exit(f"{CONF}: this machine belongs to a cluster already; not touched")
    for name in ("state", *NODES):
        (folder / name).mkdir(parents=True)
    folder.chmod(0o755)
    CONF.write_text(SETTINGS.format(folder=folder, host=socket.gethostname().split(".")[0]))
    try:
        run("mungekey", "--create", f"--keyfile={folder}/munge.key")
        files = [f"--{name}={folder}/munge.{name.split('-')[0]}" for name in ("socket", "pid-file", "log-file", "seed-file")]
        run("munged", "--force", f"--key-file={folder}/munge.key", *files)
        run("slurmctld")
        for node in NODES:
            run("slurmd", "-N", node)
        yield folder
    finally:
        for name in (*NODES, "slurmctld", "munge"):
            with contextlib.suppress(OSError, ValueError):
                end(int((folder / f"{name}.pid").read_text()))
        CONF.unlink()


def end(daemon: int) -> None:
    """Ask a daemon to end, and wait until it has."""
    os.kill(daemon, signal.SIGTERM)
    for _ in range(60):
        os.kill(daemon, 0)  # raises once it is gone
        time.sleep(0.5)


def run(*words: str) -> str:
    """What a program says. Raises: CalledProcessError."""
    return subprocess.run(words, check=True, capture_output=True, text=True).stdout


def on_node(node: str) -> list[int]:
    """Processes of jobs that run on a node, and Slurm's own that watch them."""
    jobs = set(run("squeue", "-h", "-w", node, "-o", "%A").split())
    found = []
    for entry in Path("/proc").iterdir():
        with contextlib.suppress(OSError, ValueError):
            pid = int(entry.name)
            words = (entry / "cmdline").read_bytes().replace(b"\0", b" ").decode(errors="replace")
            watching = words.startswith("slurmstepd: [") and words[13:].split(".")[0] in jobs
            if watching or f"\0SLURMD_NODENAME={node}\0".encode() in (entry / "environ").read_bytes():
                found.append(pid)
    return found


def kill(node: str, folder: Path) -> list[str]:
    """A node dies, and comes back later. Returns: the jobs that ran on it, by Slurm's numbers."""
    jobs = run("squeue", "-h", "-w", node, "-o", "%A").split()
    doomed = [int((folder / f"{node}.pid").read_text()), *on_node(node)]
    for pid in doomed:
        with contextlib.suppress(ProcessLookupError):
            os.kill(pid, signal.SIGKILL)
    return jobs


def node_of(words: str) -> str:
    """The node on which a command with these words runs, "" while there is none."""
    for entry in Path("/proc").iterdir():
        with contextlib.suppress(OSError):
            if words in (entry / "cmdline").read_bytes().replace(b"\0", b" ").decode(errors="replace"):
                there = (entry / "environ").read_bytes().split(b"\0")
                found = [one.decode().partition("=")[2] for one in there if one.startswith(b"SLURMD_NODENAME=")]
                if found:
                    return found[0]
    return ""


def engine(jobs: Path) -> list[str]:
    """The workflow's command line, its state asked of squeue, since there is no accounting here."""
    words = campaign.engine(jobs)
    words[words.index("--profile") + 1] = str(ROOT / "profiles/slurm")
    quick = ["--slurm-status-command", "squeue", "--slurm-no-account", "--slurm-init-seconds-before-status-checks", "5"]
    return [*words[:3], *quick, *words[3:]]


def through_deaths(jobs: Path, folder: Path) -> str:
    """Run the workflow while nodes die. Returns: what it said."""
    out, log = jobs.with_suffix(""), jobs.with_name("log.txt")
    with open(log, "w") as stream:
        process = subprocess.Popen(engine(jobs), env=environment(), stdout=stream, stderr=stream)
        for command, begun in {
            "conditions": "shapes/long-*/*.part/view_005",
            "distill": "long/material.npz.checkpoint",
        }.items():
            while process.poll() is None:
                node = node_of(f"dreammat_cli {command} {out}/shapes/long-")
                if node and any(out.glob(begun)):
                    break
                time.sleep(0.5)
            assert process.poll() is None, f"the workflow ended before {command} was seen:\n{log.read_text()[-2000:]}"
            print(f"node {node} killed during {command}, with Slurm's jobs {', '.join(kill(node, folder))} on it", flush=True)
            time.sleep(30)  # longer than Slurm waits for a node
            run("slurmd", "-N", node)
        process.wait()
    return log.read_text()


def check(jobs: Path, every: list[Job], folder: Path) -> None:
    """All done, every manifest complete and every file as its manifest says; a sample has the bytes that it has by hand."""
    out = jobs.with_suffix("")
    told = summarise(*read(jobs), out)
    assert told.startswith(f"{len(every)} done;"), told
    files = 0
    for job in every:
        there = outputs(job, out)
        for path, schema in ((there["conditions"].parent, CONDITIONS), (there["bake"].parent, ASSET)):
            _, listed = read_manifest(path, schema)
            files += sum(bool(intact(path, name, listed)) for name in listed)
    runs = run_logs(every[-1], out)
    views, step = read_json(runs["conditions"])["views_made"], read_json(runs["distill"])["resumed"]
    print(f"{told}\n{files} files as their manifests say", flush=True)
    print(f"after the deaths {views} of {VIEWS} views were left to make, and step {step} was the first", flush=True)
    assert views <= VIEWS - 5 and step > 0
    sample = every[-2:]
    by_hand(sample, folder / "by_hand")
    found, expected = artefacts(out), artefacts(folder / "by_hand")
    differing = [name for name, digest in expected.items() if found.get(name) != digest]
    assert not differing, f"other bytes than by hand: {', '.join(differing[:5])}"
    print(f"{len(expected)} files of {len(sample)} jobs have the bytes that they have by hand", flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--jobs", type=int, default=20)
    parser.add_argument("--folder", type=Path, help="where the jobs are; kept afterwards")
    chosen = parser.parse_args()
    with tempfile.TemporaryDirectory() as scratch, slurm(Path(scratch) / "slurm") as folder:
        work = (chosen.folder or Path(scratch) / "work").resolve()
        work.mkdir(parents=True, exist_ok=True)
        jobs = write_jobs(work, chosen.jobs - 1, broken=False)
        cube_sphere(work / "long.obj", 3)
        row = ["long", "long.obj", "oak", "0", TINY["prep"], LONG["conditions"], LONG["distill"], TINY["bake"]]
        jobs.write_text(jobs.read_text() + ",".join(row) + "\n")
        every, _ = read(jobs)
        by_hand(every[-1:], Path(scratch) / "warm")  # compiles what all others load: afresh, last bits may differ
        log = through_deaths(jobs, folder)
        before = times(jobs)
        check(jobs, every, work)
        assert times(jobs) == before
        print(f"{log.count('has been submitted')} jobs submitted for {len(before)} files; all {len(every)} done", flush=True)


if __name__ == "__main__":
    main()

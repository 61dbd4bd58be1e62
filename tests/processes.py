"""Commands in processes of their own that have nothing to import: a server that has done so forks them."""

import multiprocessing
import os
import signal
import sys
import tempfile
from collections.abc import Sequence
from multiprocessing.context import ForkServerProcess
from pathlib import Path
from subprocess import CompletedProcess

FORKED = multiprocessing.get_context("forkserver")
FORKED.set_forkserver_preload(
    ["dreammat_cli.main", "stages.prep.stage", "stages.conditions.stage", "stages.distill.stage", "stages.bake.stage"]
)


class Command:
    """A dreammat command that runs. cwd: where."""

    def __init__(self, arguments: Sequence[object], cwd: Path | None = None) -> None:
        self.folder = tempfile.TemporaryDirectory()
        self.arguments = [str(word) for word in arguments]
        self.process: ForkServerProcess = FORKED.Process(
            target=_main, args=(self.arguments, str(cwd or Path.cwd()), self.folder.name)
        )
        self.process.start()

    def done(self, seconds: float = 300) -> CompletedProcess[str] | None:
        """What it said and its exit code, or None where it still runs after that time."""
        self.process.join(seconds)
        if self.process.exitcode is None:
            return None
        with self.folder as folder:
            said = [(Path(folder) / name).read_text() if (Path(folder) / name).exists() else "" for name in ("out", "err")]
        return CompletedProcess(self.arguments, self.process.exitcode, *said)

    def send(self, how: signal.Signals) -> None:
        """Send a signal."""
        if self.process.pid is not None and self.process.is_alive():
            os.kill(self.process.pid, how)


def _main(arguments: list[str], cwd: str, folder: str) -> None:
    from dreammat_cli.main import main

    signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell's background jobs may have been told to ignore it
    for number, name in enumerate(("out", "err"), 1):
        os.dup2(os.open(f"{folder}/{name}", os.O_WRONLY | os.O_CREAT, 0o600), number)
    os.chdir(cwd)
    sys.argv = ["dreammat", *arguments]
    main()

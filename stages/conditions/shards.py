"""Views divided over machines: the I-th of N parts has every N-th view, in a folder of its own; merging brings them together.

A part holds the files of its views and what they were asked for, and is complete with its shard.json. Views do not know each
other, so the merged folder has the bytes of one that was never divided.
"""

import errno
import os
import shutil
from pathlib import Path

from stages.core.artifact import Provenance, Schema, intact, read_manifest, written_atomically
from stages.core.errors import ArtifactError

SHARD = Schema("dreammat.conditions_shard", 1, extra=("shard",), manifest="shard.json")
"""A part. shard: [I, N]."""


def views_of(shard: tuple[int, int], views: int) -> range:
    """Numbers of a part's views."""
    part, parts = shard
    return range(part - 1, views, parts)


def merge(folders: tuple[Path, ...], out: Path, request: Provenance) -> None:
    """Bring the views of all parts into a folder, each file once its bytes are known to be those that its part wrote.

    Raises: ArtifactError that names the part which is damaged, or of another run, or the one that is missing.
    """
    found: dict[int, tuple[Path, dict[str, str]]] = {}
    count = 0
    for folder in folders:
        made, files = read_manifest(folder, SHARD)
        if not made.same_request(request):
            raise ArtifactError(f"{folder}: a part of another run: {difference(made, request)}; give what it was made with")
        part, parts = made.extra["shard"]
        count = count or parts
        if parts != count:
            raise ArtifactError(f"{folder}: part {part}/{parts}, but {folders[0]} is one of {count}; give parts of one run")
        if part in found:
            raise ArtifactError(f"{folder}: part {part}/{parts}, as {found[part][0]} is; expected each part once")
        found[part] = folder, files
    if absent := [f"{part}/{count}" for part in range(1, count + 1) if part not in found]:
        missing = ", ".join(absent[:8])
        raise ArtifactError(f"{out}: part {missing} is not among those to merge; make it with --shard {absent[0]}")
    for folder, files in found.values():
        for name in files:
            bring(intact(folder, name, files), out / name)


def difference(made: Provenance, request: Provenance) -> str:
    """The first thing that two runs were asked for differently."""
    for name, wanted in [*request.options.items(), *request.inputs.items()]:
        had = made.options.get(name, made.inputs.get(name, "nothing"))
        if had != wanted:
            return f"its {name} is {str(had)[:40]}, expected {str(wanted)[:40]}"
    return "it has more inputs"


def bring(source: Path, target: Path) -> None:
    """The same file in another place: a second name where the file system gives one, a copy elsewhere. Raises: OutputError."""
    with written_atomically(target) as temporary:
        try:
            os.link(source, temporary)
        except OSError as error:
            if error.errno not in (errno.EXDEV, errno.EPERM, errno.ENOTSUP, errno.EMLINK):
                raise
            shutil.copyfile(source, temporary)

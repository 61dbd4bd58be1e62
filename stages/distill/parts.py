"""Which surface each `--part` means: names looked up, and who has a place that several claim."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from stages.asset.parts import LabelledPart, find, listed
from stages.core.errors import InputError
from stages.material.evaluate import owners

LEAST_SHARED = 0.005
"""Share of a part that must show another's texels to be worth a line."""


@dataclass(frozen=True)
class Claim:
    """number: among those asked for, from 0. name: as it was called. prompt: its words. labels: of its surface, without what a
    later claim has."""

    number: int
    name: str
    prompt: str
    labels: tuple[int, ...]


def claimed(
    asked: Sequence[tuple[str, str]], parts: list[LabelledPart], carried: Sequence[tuple[str, str]] = ()
) -> tuple[list[Claim], list[str]]:
    """What each prompt of a part is for, and a line wherever two claimed the same.

    Args: asked: name and prompt of each. carried: likewise, before them, of another mesh; this one need not have them.
    Raises: InputError: nothing is called so, or it has no area, or no prompt.
    """
    claims: list[Claim] = []
    lines = []
    for number, (name, prompt) in enumerate([*carried, *asked]):
        if number < len(carried) and not _is_there(name, parts):
            lines.append(f"part {name}: this mesh has none; {prompt} is left out")
            continue
        if not prompt.strip():
            raise InputError(f"--part {name}: its prompt is empty; say what it is made of, such as \"navy velvet\"")
        labels = frozenset(label for part in _with_area(name, parts) for label in part.labels)
        for row, earlier in enumerate(claims):
            if both := labels.intersection(earlier.labels):
                left = tuple(label for label in earlier.labels if label not in both)
                what = "some of it" if left else "all of it"
                lines.append(f"part {earlier.name}: {what} is {prompt} by the later --part {name}")
                claims[row] = replace(earlier, labels=left)
        claims.append(Claim(number, name, prompt, tuple(sorted(labels))))
    return [claim for claim in claims if claim.labels], lines


def _is_there(name: str, parts: list[LabelledPart]) -> bool:
    try:
        return sum(part.share for part in find(parts, name)) > 0
    except InputError:
        return False


def _with_area(name: str, parts: list[LabelledPart]) -> list[LabelledPart]:
    try:
        found = find(parts, name)
    except InputError as error:
        raise InputError(f"--{error}") from error
    if not sum(part.share for part in found) > 0:
        others = listed([part for part in parts if part.share > 0])
        raise InputError(f"--part {name}: it has no area, so nothing can be seen of it; expected {others}")
    return found


def shared(claims: Sequence[Claim], pairs: Sequence[tuple[int, int, float]]) -> list[str]:
    """A line for every two prompts that would lie on the same texels: what represents a texel decides.

    Args: pairs: a label, the label that represents it in texels that both share, and the share of the first's area.
    """
    names = ["what is no part", *(f"part {claim.name}" for claim in claims)]
    of = [claim.labels for claim in claims]
    told: dict[str, None] = {}
    for own, other, share in pairs:
        mine, theirs = owners(of, np.array([own, other])).tolist()
        if mine != theirs and share >= LEAST_SHARED:
            told[f"{names[mine]} shows texels that {names[theirs]} has too: these look like {names[theirs]}"] = None
    return list(told)

"""All looks by name, and what the rest of the program must know of each."""

from stages.material.looks import (
    ceramics,
    even,
    grounds,
    leathers,
    masonry,
    metals,
    organics,
    papers,
    plasters,
    plastics,
    rusts,
    stones,
    textiles,
    woods,
)

_ROOMS = (
    ceramics, even, grounds, leathers, masonry, metals, organics, papers, plasters, plastics, rusts, stones, textiles, woods,
)  # fmt: skip

LOOKS = {name: look for room in _ROOMS for name, look in room.LOOKS.items()}
"""Name → the function of a place."""

METRES = {name: size for room in _ROOMS for name, size in room.METRES.items()}
"""Name → the longest edge, in metres, that a thing of unknown size is taken to have, so that the structure can be seen."""

ALONG_GRAIN = frozenset(woods.LOOKS)
"""Looks that are sawn along the longest direction of each piece."""

"""Which items of a manifest: ranges of their numbers, or one of several equal shares."""

from __future__ import annotations

import re
from collections.abc import Iterable
from itertools import groupby

from ..base.errors import InputError

_SHARE = re.compile(r"(\d+)/(\d+)")
_RANGE = re.compile(r"(\d+)(?:-(\d+))?")


def chosen_items(text: str, count: int) -> list[int]:
    """The numbers that a text means, of items 0 to count - 1: "0-99,120", "7", or the third of twenty shares, "3/20",
    where neither needs to know how many there are. Raises InputError for anything else, and for an item out of range.
    """
    if share := _SHARE.fullmatch(text.strip()):
        number, shares = int(share[1]), int(share[2])
        if not 1 <= number <= shares:
            raise InputError(f"--items {text}: there is no such share; the first of three is 1/3, the last 3/3")
        return list(range(count * (number - 1) // shares, count * number // shares))
    found: dict[int, None] = {}
    for word in text.split(","):
        ends = _RANGE.fullmatch(word.strip())
        if ends is None:
            raise InputError(f"--items {text}: give numbers and ranges, as 0-99,120, or a share, as 3/20")
        first, last = int(ends[1]), int(ends[2] or ends[1])
        if last < first:
            raise InputError(f"--items {text}: {first}-{last} goes down; give the lower number first")
        if last >= count:
            there = f"0 to {count - 1}" if count else "none"
            raise InputError(f"--items {text}: the manifest has {count} items, {there}; give some of these")
        found.update(dict.fromkeys(range(first, last + 1)))
    return list(found)


def told_items(numbers: Iterable[int]) -> str:
    """The text that means these numbers, which are in order."""
    runs = [[number for _, number in run] for _, run in groupby(enumerate(numbers), lambda pair: pair[1] - pair[0])]
    return ",".join(f"{run[0]}-{run[-1]}" if len(run) > 1 else str(run[0]) for run in runs)

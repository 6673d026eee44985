"""Which objects are baked from others: one from those named for it, or pairs by their names."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field

import bpy

from ...core.base.errors import InputError

_LOW, _HIGH, _CAGE = (
    re.compile(rf"(?:(?P<base>.*?)[ ._-])?{ending}", re.IGNORECASE) for ending in ("low", r"high(?![a-z]).*", "cage")
)


@dataclass(frozen=True)
class HighNames:
    """What an object is baked from: the names of meshes, of a cage where there is one, else how far they are looked
    for, in scene units; None: by the object's size (core/texels/high_to_low.py)."""

    names: tuple[str, ...]
    cage: str = ""
    extrusion: float | None = None


@dataclass(frozen=True)
class Pairing:
    """Who is baked: targets' names, what some of them are baked from, and who then blocks no light."""

    targets: tuple[str, ...]
    highs: Mapping[str, HighNames] = field(default_factory=dict)
    excluded: frozenset[str] = frozenset()


def paired_with(low: str, highs: Sequence[str], cage: str, extrusion: float | None) -> Pairing:
    """One object from others. Raises InputError where there is none."""
    names = tuple(name for name in highs if name not in (low, cage))
    if not names:
        raise InputError(f"{low}: nothing to bake it from; select the high meshes first, and {low} last")
    return Pairing((low,), {low: HighNames(names, cage, extrusion)}, frozenset({low, cage} - {""}))


def paired_by_name(objects: Iterable[bpy.types.Object], chosen: Sequence[str], extrusion: float | None) -> Pairing:
    """Each `…_low` of the objects that is chosen, or one of whose `…_high` is; those may be several, and go on after
    `high`, as `Rock_high.001`. A `…_cage` beside them is its cage. Chosen objects that are no part of a pair are baked
    as they are.

    Raises InputError for a chosen low mesh without a high one.
    """
    meshes = [obj.name for obj in objects if obj.type == "MESH"]
    lows, highs, cages = (_by_base(pattern, meshes) for pattern in (_LOW, _HIGH, _CAGE))
    pairs: dict[str, HighNames] = {}
    for base, names in lows.items():
        for low in names:
            if low in chosen and base not in highs:
                stem = low[: len(base)]
                raise InputError(f"{low}: no mesh named {stem}_high to bake it from; name one so, or choose another")
            if base in highs and not {low, *highs[base]}.isdisjoint(chosen):
                pairs[low] = HighNames(tuple(highs[base]), cages.get(base, [""])[0], extrusion)
    low_parts = {name for part in (lows, cages) for base, names in part.items() if base in highs for name in names}
    high_parts = {name for base, names in highs.items() if base in lows for name in names}
    plain = [name for name in chosen if name not in low_parts | high_parts]
    return Pairing((*plain, *pairs), pairs, frozenset(low_parts))


def _by_base(pattern: re.Pattern[str], names: Iterable[str]) -> dict[str, list[str]]:
    found: dict[str, list[str]] = {}
    for name in names:
        if match := pattern.fullmatch(name):
            found.setdefault((match["base"] or "").casefold(), []).append(name)
    return found

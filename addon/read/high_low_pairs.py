"""Which objects are baked from others: one from those named for it, or pairs by their names."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field

import bpy

from ...core.base.errors import InputError
from .block_ref import BlockRef, refs_of

_LOW, _HIGH, _CAGE = (
    re.compile(rf"(?:(?P<base>.*?)[ ._-])?{ending}", re.IGNORECASE) for ending in ("low", r"high(?![a-z]).*", "cage")
)


@dataclass(frozen=True)
class HighMeshes:
    """What an object is baked from: meshes, a cage where there is one, else how far they are looked for, in scene
    units; None: by the object's size (core/texels/high_to_low.py)."""

    meshes: tuple[BlockRef, ...]
    cage: BlockRef | None = None
    extrusion: float | None = None


@dataclass(frozen=True)
class Pairing:
    """Who is baked, what some of them are baked from, and the session_uids of those who then block no light."""

    targets: tuple[BlockRef, ...]
    highs: Mapping[BlockRef, HighMeshes] = field(default_factory=dict)
    excluded: frozenset[int] = frozenset()


def paired_with(low: BlockRef, highs: Sequence[BlockRef], cage: BlockRef | None, extrusion: float | None) -> Pairing:
    """One object from others. Raises InputError where there is none."""
    meshes = tuple(ref for ref in highs if ref not in (low, cage))
    if not meshes:
        raise InputError(
            f"{low.label}: nothing to bake it from; select the high meshes first, and {low.label} last (--highs: name "
            "others than it and its cage)"
        )
    return Pairing((low,), {low: HighMeshes(meshes, cage, extrusion)}, frozenset(ref.uid for ref in (low, cage) if ref))


def paired_by_name(objects: Iterable[bpy.types.Object], chosen: Sequence[BlockRef], extrusion: float | None) -> Pairing:
    """Each `…_low` of the objects that is chosen, or whose `…_cage` is, or one of whose `…_high`; those may be several,
    and go on after `high`, as `Rock_high.001`. A `…_cage` beside them is its cage. Those of the low mesh's own file,
    or library, go before those of others. Chosen objects that are no part of a pair are baked as they are.

    Raises InputError for a chosen low mesh without a high one.
    """
    meshes = [obj for obj in objects if obj.type == "MESH"]
    named = list(zip(refs_of(meshes), meshes, strict=True))
    lows, highs, cages = (_by_base(pattern, named) for pattern in (_LOW, _HIGH, _CAGE))
    pairs: dict[BlockRef, HighMeshes] = {}
    low_parts, members = set[BlockRef](), set[BlockRef]()  # of all pairs, those of the chosen or not
    for base, parts in lows.items():
        for low in parts:
            if low.ref in chosen and base not in highs:
                stem = low.name[: len(base)]
                raise InputError(
                    f"{low.ref.label}: no mesh named {stem}_high to bake it from; name one so, or choose another"
                )
            above = _beside(low, highs.get(base, []))
            cage = _beside(low, cages.get(base, []))
            pair = {low.ref, *above, *cage} if above else set()
            members |= pair
            low_parts |= pair - set(above)
            if not pair.isdisjoint(chosen):
                pairs[low.ref] = HighMeshes(tuple(above), cage[0] if cage else None, extrusion)
    plain = [ref for ref in chosen if ref not in members]
    return Pairing((*plain, *pairs), pairs, frozenset(ref.uid for ref in low_parts))


@dataclass(frozen=True)
class _Part:
    """A mesh that is called as a part of a pair."""

    ref: BlockRef
    name: str
    library: bpy.types.Library | None


def _by_base(pattern: re.Pattern[str], named: Iterable[tuple[BlockRef, bpy.types.Object]]) -> dict[str, list[_Part]]:
    found: dict[str, list[_Part]] = {}
    for ref, obj in named:
        if match := pattern.fullmatch(obj.name):
            found.setdefault((match["base"] or "").casefold(), []).append(_Part(ref, obj.name, obj.library))
    return found


def _beside(low: _Part, parts: Sequence[_Part]) -> list[BlockRef]:
    """Of parts of the same name those that come from where it comes from; where none does, all."""
    near = [part.ref for part in parts if part.library == low.library]
    return near or [part.ref for part in parts]

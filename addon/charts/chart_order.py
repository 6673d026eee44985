"""One layout that is to be made, and whether the one made before still fits."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import bpy

from ...core.base.errors import InputError
from ..read.block_ref import BlockRef
from .chart_marks import mark_of
from .chart_parts import Part, fingerprint, parts_of
from .chart_request import ChartRequest


@dataclass(frozen=True, eq=False)
class ChartOrder:
    """title: what it is called. refs: the objects that it is for. parts: their meshes, as they were."""

    title: str
    refs: list[BlockRef]
    parts: list[Part]
    request: ChartRequest

    @cached_property
    def made_for(self) -> str:
        """What a mark says of such a layout, and the number of the part after it."""
        return fingerprint(self.parts, self.request, by_blender=self.request.by_blender)

    def parts_now(self, context: bpy.types.Context) -> list[Part]:
        """The same, as they are now. Raises InputError where they are not as they were: the artist, or an undo, may
        have been at them."""
        wanted = {part.ref: part.source for part in self.parts}
        now = parts_of(context, wanted, in_world=bool(self.request.atlas))
        if fingerprint(now, self.request, by_blender=self.request.by_blender) != self.made_for:
            raise InputError(f"{self.title}: it was changed while its charts were made; start again")
        return now


def stands(parts: Sequence[Part], request: ChartRequest) -> bool:
    """Whether charts made before still fit. An artist may have been at them."""
    marks = [mark_of(part.mesh, request.layer) for part in parts]
    if None in marks:
        return False
    made_for = [fingerprint(parts, request, by_blender=by_blender) for by_blender in request.accepted]
    return any(all(mark and mark.made_for == f"{each}{i}" for i, mark in enumerate(marks)) for each in made_for)

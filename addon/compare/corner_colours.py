"""The corners of a mesh's faces by Cycles: the same parts of the faces that our colour attributes are means over."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import bpy
import numpy as np

from ...core.base.arrays import Flags, Floats
from ...core.finish.baked import BakedMap
from ...core.scene.scene import HighPoly, Instance
from ...core.scene.world_mesh import bounds_of
from ...core.texels.vertex_bake import FineCells, corner_texels, corner_values, shared_values
from .cycles import CyclesSettings, Surroundings
from .projected import bake_projected, projection_onto

_SIDE, _SMALLER, _MANY = 8, 4, 1 << 16  # of a triangle's cell, and for so many triangles and more
_HAIR = 2.0**-14  # of the object's diagonal: how far above its own surface rays that look for it start


def bake_corners(
    context: bpy.types.Context,
    target: Instance,
    highs: HighPoly | None,
    seen: Sequence[bpy.types.Object],
    ours: BakedMap,
    settings: CyclesSettings,
    around: Surroundings,
) -> tuple[Floats, Floats, Flags, float]:
    """Ours and Cycles' colours of the corners as an image like ours each, which texels of it are corners that both
    have, and Cycles' seconds. seen: the high meshes, or the target's own object. ours: what the corners were baked into
    (core/texels/vertex_bake.py).

    Cycles' own bake into colour attributes looks from the corners themselves; here it bakes the triangles, laid out one
    beside the other, onto the object. Raises as `bake_projected`.
    """
    mesh = target.mesh
    cells = FineCells(len(mesh.triangles), _SIDE if len(mesh.triangles) < _MANY else _SMALLER)
    samples = math.ceil(settings.samples / cells.texels_of_a_corner)
    projection = projection_onto(replace(target, mesh=replace(mesh, uv=cells.uv)), highs or _itself(target))
    baked = bake_projected(context, projection, seen, replace(settings, size=cells.size, samples=samples), around)
    values = shared_values(cells.parts(baked.values, baked.coverage), mesh)
    return (*_pictures(target, ours, values), baked.seconds)


def _itself(target: Instance) -> HighPoly:
    low, high = bounds_of(target)
    return HighPoly([target], extrusion=_HAIR * float(np.linalg.norm(high - low)))


def _pictures(target: Instance, ours: BakedMap, cycles: Floats) -> tuple[Floats, Floats, Flags]:
    """Both in an image like ours, and its texels that are corners whose values both know."""
    texels = corner_texels(ours.values.shape[1], len(target.mesh.triangles))
    shown, beside, mask = ours.values.copy(), np.zeros_like(ours.values), np.zeros_like(ours.covered)
    shown[texels] = corner_values(ours.values, target.mesh)
    beside[texels], mask[texels] = cycles, np.isfinite(cycles) & ours.covered[texels]
    return shown, beside, mask

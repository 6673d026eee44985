"""AO by Cycles from selected to active: what is seen from triangles that are laid out as is asked for."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace

import bpy
import numpy as np
from mathutils import Matrix

from ...core.base.arrays import Doubles, Floats
from ...core.charts.udim import in_tile
from ...core.scene.scene import HighPoly, Instance
from ...core.scene.world_mesh import centre_of, mirrors
from ...core.texels.high_to_low import corner_starts
from ..read.bake_operator import with_texture
from ..read.blender_state import bake_override, passing_object
from ..typed import mesh_of, scene_in, view_layer_in
from .cycles import (
    WHOLE_SCENE,
    CyclesBake,
    CyclesSettings,
    Surroundings,
    baked_into,
    new_mesh,
    run_bake,
    seen_as_it_is,
    set_up,
)

_NAME = "Occlusion Bake"
_PARTS, _MOST = 4, 1 << 20  # of a triangle's side, and of all triangles
_SLACK = 1.0 + 1e-5  # what is as far below the triangles as rays start above them is still seen


@dataclass(frozen=True, eq=False)
class Projection:
    """Triangles to bake onto. name: for messages. corners: (T, 3, 3) float32 about `origin`; starts: of the same shape,
    where rays towards them begin, each of which ends as far behind as the farthest begins before. uv: (T, 3, 2)."""

    name: str
    corners: Floats
    starts: Floats
    origin: Doubles
    uv: Floats

    @property
    def reach(self) -> float:
        """How far a ray goes."""
        longest = np.linalg.norm((self.corners - self.starts).astype(np.float64), axis=2).max(initial=0.0)
        return 2.0 * _SLACK * float(longest)


def projection_onto(target: Instance, highs: HighPoly, tile: int | None = None) -> Projection:
    """A target's triangles, with rays as our bake from high meshes has them. tile: of a UDIM layout. Raises InputError
    for a cage that is none."""
    uv, origin = in_tile(target, tile).mesh.uv, centre_of(target)
    assert uv is not None  # it has been baked
    corners, starts = corner_starts(target, highs, origin)
    whole = Projection(target.name, corners, starts, origin, uv[:, [0, 2, 1]] if mirrors(target) else uv)
    return whole if highs.cage is not None else _of_one_distance(whole)


def _of_one_distance(whole: Projection) -> Projection:
    """The triangles in parts, at whose corners rays start as far above as at the triangles' own, as ours do everywhere:
    between corners whose normals part Cycles' would start lower."""
    along = max(1, min(_PARTS, int(np.sqrt(_MOST / max(len(whole.corners), 1)))))
    weights = _parts(along)

    def cut(values: Floats) -> Doubles:
        parts: Doubles = np.einsum("pcw,twk->tpck", weights, values.astype(np.float64))
        return parts.reshape(-1, 3, values.shape[2])

    ways = cut(whole.starts - whole.corners)
    length = np.linalg.norm(ways, axis=2, keepdims=True)
    corners = cut(whole.corners)
    starts = corners + 0.5 * whole.reach / _SLACK * ways / np.maximum(length, 1e-300)
    return replace(whole, corners=_rounded(corners), starts=_rounded(starts), uv=_rounded(cut(whole.uv)))


def _parts(along: int) -> Doubles:
    """(along², 3, 3): the corners of a triangle's equal parts, by their weights of its own corners."""
    up = [[(i, j), (i + 1, j), (i, j + 1)] for i in range(along) for j in range(along - i)]
    down = [[(i + 1, j), (i + 1, j + 1), (i, j + 1)] for i in range(along) for j in range(along - i - 1)]
    second_third = np.array(up + down, dtype=np.float64) / along
    weights: Doubles = np.concatenate([1.0 - second_third.sum(axis=2, keepdims=True), second_third], axis=2)
    return weights


def _rounded(values: Doubles) -> Floats:
    return values.astype(np.float32)


def bake_projected(
    context: bpy.types.Context,
    projection: Projection,
    seen: Sequence[bpy.types.Object],
    settings: CyclesSettings,
    around: Surroundings = WHOLE_SCENE,
) -> CyclesBake:
    """The ambient occlusion of what is seen of these mesh objects: Cycles looks from a texel's centre, and at the first
    face that it meets. Everything is put back, also after a failure. Raises InputError, a line naming the projection,
    where Cycles refuses or is not enabled."""
    scene, view_layer = scene_in(context), view_layer_in(context)
    with set_up(context, projection.name, settings, around) as (stack, image):
        low = stack.enter_context(_standing(scene, projection.corners, projection))
        cage = stack.enter_context(_standing(scene, projection.starts, projection))
        cage.visible_shadow = False
        material = with_texture(None, image)
        stack.callback(bpy.data.materials.remove, material)
        mesh_of(low).materials.append(material)
        for obj in seen:
            seen_as_it_is(stack, obj)
        stack.enter_context(bake_override(context, low, scene, view_layer, seen))
        seconds = run_bake(
            projection.name,
            use_selected_to_active=True,
            use_cage=True,
            cage_object=cage.name,
            max_ray_distance=projection.reach,
        )
        return baked_into(image, seconds)


@contextmanager
def _standing(scene: bpy.types.Scene, corners: Floats, of: Projection) -> Iterator[bpy.types.Object]:
    """Loose triangles as an object of the scene, for the time."""
    numbers = np.arange(3 * len(corners), dtype=np.int32).reshape(-1, 3)
    mesh = new_mesh(_NAME, corners.reshape(-1, 3), numbers)
    mesh.uv_layers.new(name=_NAME).uv.foreach_set("vector", np.ascontiguousarray(of.uv, np.float32).reshape(-1))
    with passing_object(scene, mesh) as obj:
        obj.matrix_world = Matrix.Translation(of.origin.tolist())
        yield obj

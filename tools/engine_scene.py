"""What try_engines.py shows: Suzanne on a floor, AO baked by the button, exported as .glb; and what AO there is where.

The floor is baked onto its own UV map, which is the mesh's first, and Suzanne onto charts in a second one.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import bpy
import numpy as np
import occlusion_bake
from mathutils.bvhtree import BVHTree
from numpy.typing import NDArray

SIZE = 256  # texels a side
FLOOR, HEAD = "Floor", "Suzanne"

Doubles = NDArray[np.float64]

# With the extension installed there is more than the stubs of Blender know.
context: Any = bpy.context
ops: Any = bpy.ops


def make_glb(path: Path) -> Occlusion:
    """Make the scene, bake and export it."""
    occlusion_bake.register()
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.mesh.primitive_plane_add(size=4.0)
    context.object.name = FLOOR
    bpy.ops.mesh.primitive_monkey_add(location=(0.0, 0.0, 0.98))
    context.object.name = HEAD
    bpy.ops.object.shade_smooth()
    _bake(FLOOR, uv="ACTIVE")
    _bake(HEAD, uv="CHARTS")
    bpy.ops.export_scene.gltf(filepath=str(path), export_format="GLB")
    return Occlusion([_Triangles(name) for name in (FLOOR, HEAD)])


def _bake(name: str, **panel: str) -> None:
    """As an artist does: with *glTF Occlusion* on."""
    chosen: Any = context.scene.occlusion_bake
    chosen.width = chosen.height = SIZE
    chosen.use_gltf = True
    for key, value in panel.items():
        setattr(chosen, key, value)
    bpy.ops.object.select_all(action="DESELECT")
    bpy.data.objects[name].select_set(True)
    context.view_layer.objects.active = bpy.data.objects[name]
    if ops.occlusion_bake.bake() != {"FINISHED"}:
        raise RuntimeError(f"{name} was not baked")


class _Triangles:
    """A baked object: corners (T, 3, 3) in world space, uv (T, 3, 2), image (h, w) with its bottom row first."""

    def __init__(self, name: str) -> None:
        obj: Any = bpy.data.objects[name]
        images: Any = bpy.data.images
        mesh, image = obj.data, images[f"{name} AO"]
        mesh.calc_loop_triangles()
        count = len(mesh.loop_triangles)
        vertices, matrix = _read(mesh.vertices, "co", len(mesh.vertices), 3), np.array(obj.matrix_world)
        self.corners = (vertices @ matrix[:3, :3].T + matrix[:3, 3])[_read_ints(mesh, "vertices", count)]
        layer = mesh.uv_layers.get("Occlusion Bake") or mesh.uv_layers.active
        self.uv = _read(layer.uv, "vector", len(mesh.loops), 2)[_read_ints(mesh, "loops", count)]
        width, height = image.size
        self.image = np.array(image.pixels[:], dtype=np.float64).reshape(height, width, 4)[..., 0]


class Occlusion:
    """The AO that was baked, by points of the world."""

    def __init__(self, parts: Sequence[_Triangles]) -> None:
        self._parts = parts
        corners = np.concatenate([part.corners for part in parts])
        faces = np.arange(3 * len(corners)).reshape(-1, 3)
        self._tree: Any = BVHTree.FromPolygons(corners.reshape(-1, 3).tolist(), faces.tolist())

    def at(self, points: Doubles) -> tuple[Doubles, NDArray[np.int64]]:
        """(N, 3) points of glTF's world, Y up, on the surfaces → their AO, (N,), and whose it is: 0 floor, 1 head."""
        blender = np.stack([points[:, 0], -points[:, 2], points[:, 1]], axis=1)
        nearest = np.array([self._tree.find_nearest(point)[2] for point in blender.tolist()])
        values, owners = np.empty(len(points)), np.zeros(len(points), dtype=np.int64)
        first = 0
        for owner, part in enumerate(self._parts):
            mine = (nearest >= first) & (nearest < first + len(part.corners))
            values[mine] = _looked_up(part, nearest[mine] - first, blender[mine])
            owners[mine] = owner
            first += len(part.corners)
        return values, owners


def _looked_up(part: _Triangles, triangles: NDArray[np.int64], points: Doubles) -> Doubles:
    weights = barycentric(part.corners[triangles], points)
    return bilinear(part.image, np.einsum("nk,nki->ni", weights, part.uv[triangles]))


def barycentric(corners: Doubles, points: Doubles) -> Doubles:
    """(N, 3, 3) triangles and (N, 3) points in their planes → weights of the corners, (N, 3)."""
    edge1, edge2 = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    to_point = points - corners[:, 0]
    normal = np.cross(edge1, edge2)
    area = np.einsum("ni,ni->n", normal, normal)
    second = np.einsum("ni,ni->n", np.cross(to_point, edge2), normal) / area
    third = np.einsum("ni,ni->n", np.cross(edge1, to_point), normal) / area
    return np.stack([1.0 - second - third, second, third], axis=1)


def bilinear(image: Doubles, uv: Doubles) -> Doubles:
    """An image, (h, w) with its bottom row first, at (N, 2) UVs; it goes on beyond its edges, as textures repeat."""
    height, width = image.shape
    x, y = uv[:, 0] * width - 0.5, uv[:, 1] * height - 0.5
    left, low = np.floor(x).astype(np.int64), np.floor(y).astype(np.int64)
    across, up = x - left, y - low
    rows = [image[(low + row) % height] for row in (0, 1)]
    index = np.arange(len(uv))
    mixed = [row[index, left % width] * (1.0 - across) + row[index, (left + 1) % width] * across for row in rows]
    between: Doubles = mixed[0] * (1.0 - up) + mixed[1] * up
    return between


def _read(collection: Any, name: str, count: int, width: int) -> Doubles:
    values = np.empty(count * width, dtype=np.float32)
    collection.foreach_get(name, values)
    return values.reshape(count, width).astype(np.float64)


def _read_ints(mesh: Any, name: str, count: int) -> NDArray[np.int32]:
    values = np.empty(3 * count, dtype=np.int32)
    mesh.loop_triangles.foreach_get(name, values)
    return values.reshape(count, 3)

"""Maps at the corners of a mesh's faces in place of texels: for colour attributes.

Each triangle gets a cell of 2 x 2 texels of an image of its own, so laid out that three of them are the triangle's
parts nearest to each corner, in which one of the two barycentric weights, or neither, is over a half. A corner's value
is the mean over its part, and a vertex's the mean over the parts around it: an average, where a value at the vertex
alone would miss what happens on the faces (as Kavan et al., "Least squares vertex baking", 2011, have it).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ..base.arrays import Doubles, Flags, Floats, Longs, Reals
from ..base.errors import InputError
from ..scene.scene import Instance, Mesh, Scene

MOST_TRIANGLES = 1 << 28  # the image's sides are at most 65536
_ALIKE = 1e-3  # normals that differ by less are one
_BEYOND = 0.01  # of a texel: so that middles on the edge of a triangle lie within it


def corner_image(triangles: int) -> tuple[int, int]:
    """Width and height of the image that holds the cells of so many triangles: powers of two, so UVs are exact."""
    across = 1 << max(triangles - 1, 0).bit_length() // 2
    down = 1 << max(-(-triangles // across) - 1, 0).bit_length()
    return 2 * across, 2 * down


def check_corners(target: Instance) -> None:
    """Refuse a mesh with too many triangles. Raises InputError."""
    if (count := len(target.mesh.triangles)) > MOST_TRIANGLES:
        raise InputError(f"{target.name}: {count} triangles are too many for colours; bake a texture")


def with_corner_cells(scene: Scene) -> Scene:
    """The scene with each triangle of the targets in a cell of its own, of an image as large as `corner_image` says.

    Targets that `check_corners` refuses stay as they are.
    """
    meshes = (each.mesh for each in scene.targets)
    laid_out = {id(mesh): _with_cells(mesh) for mesh in meshes if len(mesh.triangles) <= MOST_TRIANGLES}

    def of(instances: Sequence[Instance]) -> list[Instance]:
        return [replace(each, mesh=laid_out.get(id(each.mesh), each.mesh)) for each in instances]

    highs = {name: replace(high, meshes=of(high.meshes)) for name, high in scene.highs.items()}
    return replace(scene, targets=of(scene.targets), occluders=of(scene.occluders), highs=highs)


def _with_cells(mesh: Mesh) -> Mesh:
    count = len(mesh.triangles)
    return replace(mesh, uv=_cell_uv(count, *corner_image(count)))


def corner_values(values: Floats, mesh: Mesh) -> Floats:
    """(H, W) of a bake of `with_corner_cells` → (T, 3), one value for all corners that share vertex and normal.

    Corners count by the area of their triangle.
    """
    return shared_values(values[corner_texels(values.shape[1], len(mesh.triangles))], mesh)


def shared_values(parts: Reals, mesh: Mesh) -> Floats:
    """(T, 3) means over the corners' parts → (T, 3), one value for all corners that share vertex and normal."""
    areas = np.linalg.norm(mesh.doubled_areas, axis=1)[:, None].repeat(3, axis=1)
    areas = np.maximum(areas, 1e-30 * max(float(areas.max(initial=0.0)), 1e-30))
    _, group = np.unique(_keys(mesh).reshape(-1), return_inverse=True)
    sums = np.bincount(group, (parts.astype(np.float64) * areas).reshape(-1)) / np.bincount(group, areas.reshape(-1))
    shared: Floats = sums[group].reshape(-1, 3).astype(np.float32)
    return shared


def corner_texels(width: int, triangles: int) -> tuple[Longs, Longs]:
    """Rows and columns, (T, 3) each, of the texels that are the triangles' corners in an image of this width."""
    x, y = _cells(triangles, width)
    return np.stack([y, y, y + 1], axis=1), np.stack([x, x + 1, x], axis=1)


class FineCells:
    """The same corners where a texel is looked at in its middle alone, if at all: in larger cells, of many texels each.

    side: of a cell, in texels, a multiple of two.
    """

    def __init__(self, triangles: int, side: int) -> None:
        width, height = corner_image(triangles)
        self._count, self._side = triangles, side
        self.size = width // 2 * side, height // 2 * side
        self.uv = _cell_uv(triangles, *self.size, side, beyond=_BEYOND)

    @property
    def texels_of_a_corner(self) -> float:
        """How many it is a mean over, at least."""
        return self._side**2 / 8

    def parts(self, values: Floats, covered: Flags) -> Doubles:
        """(H, W) values of an image of this size → (T, 3) means over the covered texels of each corner's part; not
        finite where none is. A texel that the triangle's edge cuts counts half."""
        side, half = self._side, self._side // 2
        across, down = self.size[0] // side, self.size[1] // side
        i, j = np.meshgrid(np.arange(side, dtype=np.int64), np.arange(side, dtype=np.int64))
        weight = np.where(i + j < side - 1, 1.0, np.where(i + j == side - 1, 0.5, 0.0))
        corners = [((i < half) & (j < half)) * weight, (i >= half) * weight, (j >= half) * weight]

        def sums(image: Doubles) -> Doubles:
            cells = image.reshape(down, side, across, side)
            found = [(cells * corner[:, np.newaxis]).sum(axis=(1, 3)) for corner in corners]
            means: Doubles = np.stack(found, axis=2).reshape(-1, 3)[: self._count]
            return means

        with np.errstate(invalid="ignore"):
            means: Doubles = sums(np.where(covered, values, 0.0).astype(np.float64)) / sums(covered.astype(np.float64))
        return means


def _cells(count: int, width: int, side: int = 2) -> tuple[Longs, Longs]:
    """The upper left texel of each triangle's cell."""
    index = np.arange(count, dtype=np.int64)
    return side * (index % (width // side)), side * (index // (width // side))


def _cell_uv(count: int, width: int, height: int, side: int = 2, beyond: float = 0.0) -> Floats:
    """(T, 3, 2) UVs of triangles that are half a cell each. beyond: how much longer their legs are, in texels."""
    x, y = _cells(count, width, side)
    leg = side + beyond
    place = [np.stack([x, x + leg, x], axis=1) / width, 1.0 - np.stack([y, y, y + leg], axis=1) / height]
    uv: Floats = np.stack(place, axis=2).astype(np.float32)
    return uv


def _keys(mesh: Mesh) -> Longs:
    """(T, 3): equal where corners share vertex and normal."""
    normals = mesh.normals
    if normals is None:
        flat = mesh.doubled_areas / np.maximum(np.linalg.norm(mesh.doubled_areas, axis=1, keepdims=True), 1e-300)
        normals = flat[:, None].repeat(3, axis=1)
    steps = np.rint(np.asarray(normals, dtype=np.float64) / _ALIKE).astype(np.int64) + 2048
    packed = (steps[..., 0] << 24) | (steps[..., 1] << 12) | steps[..., 2]
    keys: Longs = (mesh.triangles.astype(np.int64) << 36) | packed
    return keys

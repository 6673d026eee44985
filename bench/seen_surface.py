"""Where a texel of a low mesh and those around it see one smooth surface of the high meshes.

Ours looks at one point a texel. Cycles spreads its samples over the triangle that the texel's middle meets, which is
the same only where nothing else is seen within the texel.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ..core.base.arrays import Flags, Floats, Ints
from ..core.rays.embree import open_device
from ..core.rays.texel_surface import TexelSurface
from ..core.scene.parts import parts_of
from ..core.scene.scene import HighPoly, Instance
from ..core.scene.world_mesh import world_surface
from ..core.texels.high_to_low import onto_high_poly

FARTHEST = 0.5  # how far a neighbour's point may be off the plane of one's face, in sides of a texel
STEEPEST = np.cos(np.radians(35.0))  # of the angle between their faces


def sees_one_surface(target: Instance, highs: HighPoly, owner: Ints) -> Flags:
    """(H, W) bool. owner: (H, W) int32, of the target's texels."""
    part = parts_of(target)[0]
    low = TexelSurface(world_surface(target, part.origin), owner)
    seen = onto_high_poly(target, highs, low, part, open_device())
    mask = seen.covered.copy()
    for axis in (0, 1):
        apart = _are_apart(seen, axis)
        first, second = (_along(mask, axis, end) for end in (0, 1))
        first &= ~apart
        second &= ~apart
    return mask


def _are_apart(seen: TexelSurface, axis: int) -> Flags:
    """Of each two neighbours along an axis that see something: whether it is not one surface."""
    places, faces, spacing = (
        _image(values, seen.owner)
        for values in (seen.mesh.vertices, _known(seen.mesh.faces), _known(seen.mesh.spacing)[:, None])
    )
    here, there = (_along(faces, axis, end) for end in (0, 1))
    step = _along(places, axis, 1) - _along(places, axis, 0)
    off = np.maximum(*(np.abs((step * face).sum(axis=2)) for face in (here, there)))
    limit = FARTHEST * _along(spacing, axis, 0)[..., 0]
    steep = (here * there).sum(axis=2) < STEEPEST
    answer: Flags = np.logical_and(*(_along(seen.covered, axis, end) for end in (0, 1))) & ((off > limit) | steep)
    return answer


def _known(values: Floats | None) -> Floats:
    assert values is not None  # what onto_high_poly gives has them
    return values


def _image(values: Floats, owner: Ints) -> Floats:
    """(H, W, K) of rows, (N, K), that texels own; 0 elsewhere."""
    image = np.zeros((*owner.shape, values.shape[1]), dtype=np.float32)
    image[owner >= 0] = values[owner[owner >= 0]]
    return image


def _along(image: Any, axis: int, end: int) -> Any:
    """A view of the first or of the second of each two neighbours along an axis."""
    rows = [slice(None)] * image.ndim
    rows[axis] = slice(end, image.shape[axis] - 1 + end)
    return image[tuple(rows)]

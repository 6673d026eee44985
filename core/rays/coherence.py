"""Whether rays side by side mostly meet the same triangles, which decides how Embree is asked to trace them."""

from __future__ import annotations

import numpy as np

from ..base.arrays import Doubles, Ints
from ..base.triangles import unit_normals
from .texel_surface import TexelSurface
from .tracer import BLOCK

# Of the faces that a packet's texels lie on: 1 less the length of their mean normal. Above it rays part from the start,
# and are traced 1.2 to 1.6 times as fast one by one (rough reliefs, rods); below it mostly slower (docs/figures.md).
MOST_SPREAD = 0.02
_BLOCKS = 2048  # that are looked at


def are_coherent(surface: TexelSurface, triangles: int, texels: int) -> bool:
    """Whether the rays of texels near one another are. triangles: of all that blocks light; texels: that are owned.

    With more triangles than texels rays of neighbouring texels mostly meet different ones.
    """
    return triangles <= texels and spread_of_faces(surface) <= MOST_SPREAD


def spread_of_faces(surface: TexelSurface) -> float:
    """1 less the length of the mean of the faces' normals, in the mean of some blocks of 4 x 4 texels: 0 of a plane."""
    owners = _some_blocks(surface.owner)
    if not len(owners):
        return 0.0
    which, place = np.unique(owners, return_inverse=True)
    mesh = surface.mesh
    normals = unit_normals(mesh.vertices[mesh.triangles[which]].astype(np.float64))
    if mesh.faces is not None:  # of points that are seen from a low mesh these alone tell
        known = mesh.faces[which].astype(np.float64)
        normals = np.where((known * known).sum(axis=1, keepdims=True) > 0.5, known, normals)
    mean: Doubles = normals[place.reshape(owners.shape)].mean(axis=1)
    return float((1.0 - np.linalg.norm(mean, axis=1)).mean())


def _some_blocks(owner: Ints) -> Ints:
    """(N, 16): the owners of blocks that are owned wholly, evenly spread over the image."""
    height, width = (side // BLOCK for side in owner.shape)
    corners = owner[: height * BLOCK : BLOCK, : width * BLOCK : BLOCK]
    y, x = np.nonzero(corners >= 0)
    chosen = np.linspace(0, len(y) - 1, min(len(y), _BLOCKS)).astype(np.int64)
    rows, columns = (BLOCK * each[chosen, np.newaxis, np.newaxis] for each in (y, x))
    along = np.arange(BLOCK, dtype=np.int64)
    blocks = owner[rows + along[:, np.newaxis], columns + along].reshape(-1, BLOCK**2)
    whole: Ints = blocks[(blocks >= 0).all(axis=1)]
    return whole

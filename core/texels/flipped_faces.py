"""Which share of an object looks at the backs of its own faces: normals turned inwards, and parts buried in others."""

from __future__ import annotations

import numpy as np

from ..base.arrays import Doubles, Floats, Ints
from ..base.triangles import unit_normals
from ..rays.kernel_api import Control
from ..rays.texel_surface import TexelSurface
from ..rays.trace_scene import TraceScene
from ..scene.world_mesh import WorldMesh
from .interior import TOLD, spread

_RAYS = 8  # off a face, all around
_LIFT = 2.0**-19  # of the triangle's largest coordinate: past all that is rounded there
DARK = 2e-3  # a mean below it is that of an object that no light reaches


def flipped_share(scene: TraceScene, surface: TexelSurface, own: int, *, control: Control | None = None) -> float:
    """Share of the owned texels, 0 to 1, whose faces see their own mesh in every direction, and its backs in most.

    own: the number of the surface's own geometry in the scene, -1 none: then 0. A face of a closed mesh that looks
    outwards never sees a back, and of those that are turned round each sees nothing else but one another. Judged by
    the middles of the faces that own at most interior.SAMPLED texels, evenly spread, always the same. Raises Cancelled.
    """
    texels = spread(np.flatnonzero(surface.covered))
    if own < 0 or not len(texels):
        return 0.0
    mesh, faces = surface.mesh, surface.owner.reshape(-1)[texels]
    corners, normals = mesh.vertices[mesh.triangles[faces]].astype(np.float64), _normals(mesh, faces)
    lift = _LIFT * np.abs(corners).max(axis=(1, 2))[:, None]
    starts = (corners.mean(axis=1) + lift * normals).astype(np.float32)
    backs, left = np.zeros(len(faces), dtype=np.int64), np.arange(len(faces))
    for ways in _around(normals):
        along, endless = np.ascontiguousarray(ways[left]), np.full(len(left), np.inf, dtype=np.float32)
        hits = scene.first_hits(starts[left], along, endless, surface.threads, control)
        at_home = hits.geometry == own
        left, along = left[at_home], along[at_home]  # most are open, and done with by the first
        backs[left] += (_normals(mesh, hits.triangle[at_home]) * along).sum(axis=1) > 0.0
    return float(np.count_nonzero(2 * backs[left] > _RAYS)) / len(faces)


def _around(normals: Doubles) -> list[Floats]:
    """For each of the rays its directions, (N, 3) float32, off the faces with these normals: cosine-weighted, by a
    Fibonacci spiral over the disc."""
    across = np.where(np.abs(normals[:, :1]) < 0.7, [[1.0, 0.0, 0.0]], [[0.0, 1.0, 0.0]])
    along = np.cross(normals, across)
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    over = np.cross(normals, along)
    ways = []
    for i in range(_RAYS):
        part, turn = (i + 0.5) / _RAYS, 2.399963229728653 * i
        x, y, z = np.sqrt(part) * np.cos(turn), np.sqrt(part) * np.sin(turn), np.sqrt(1.0 - part)
        ways.append((x * along + y * over + z * normals).astype(np.float32))
    return ways


def _normals(mesh: WorldMesh, faces: Ints) -> Doubles:
    """(N, 3) unit normals of triangles by their corners; z where one has no area."""
    normals = unit_normals(mesh.vertices[mesh.triangles[faces]].astype(np.float64))
    normals[~normals.any(axis=1)] = (0.0, 0.0, 1.0)
    return normals


def warning(name: str, share: float) -> list[str]:
    """The line for an object of which a part worth telling is turned, or none."""
    if share < TOLD:
        return []
    return [
        f"{name}: about {100.0 * share:.0f} % of the texels see the backs of its own faces alone: their normals are "
        "turned inwards (Mesh > Normals > Recalculate Outside), or they are buried in it"
    ]


def dark_warning(name: str, mean: float) -> list[str]:
    """The line for an object whose map is black, or none."""
    if mean >= DARK:
        return []
    return [
        f"{name}: no light reaches it: its normals are turned inwards (Mesh > Normals > Recalculate Outside), or it is "
        "shut in; give it an opening, or limit the distance"
    ]

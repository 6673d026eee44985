"""Why faces get no light: what shuts them in, as they and their backs see it. Nothing is changed, but the artist is
told, and only of what was found so."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from enum import IntEnum

import numpy as np

from ..base.arrays import Doubles, Flags, Floats, Ints
from ..base.elementary import cos, sin
from ..base.kernel_api import Control
from ..base.triangles import unit_normals
from ..rays.texel_surface import TexelSurface
from ..rays.trace_scene import TraceScene
from ..scene.world_mesh import WorldMesh
from .interior import TOLD, spread

_RAYS = 8  # off a face, all around
_LIFT = 2.0**-19  # of the triangle's largest coordinate: past all that is rounded there
_COARSE = 0.125  # of its longest edge: a face that would be lifted farther is not judged
_DARK = 2e-3  # a mean below it is that of an object that no light reaches


class Sight(IntEnum):
    """What a face sees in every direction: something that lets light in; other meshes too; or its own mesh alone, from
    the front or the back in most of them. Of these the face's back sees backs in most directions, or does not."""

    OPEN = 0
    COVERED = 1
    ENCLOSED = 2  # the front: a closed shell, seen from within
    LINING = 3  # the front, and its back sees backs: the inner side of a closed wall that is thick
    FLIPPED = 4  # the back: a face of a closed shell that is turned round
    BURIED = 5  # the back, and its back sees backs: inside another part of the mesh, or where two touch
    MISSHADED = 6  # whatever it is: its shading normals point into it


def sights_of(
    scene: TraceScene, surface: TexelSurface, own: int, *, control: Control | None = None
) -> dict[Sight, float]:
    """Shares of the owned texels, 0 to 1, by what their faces see.

    own: the number of the surface's own geometry in the scene, -1 none. Judged by the middles of the faces that own at
    most interior.SAMPLED texels, evenly spread, always the same. Raises Cancelled.
    """
    texels = spread(np.flatnonzero(surface.covered))
    if not len(texels):
        return dict.fromkeys(Sight, 0.0)
    mesh, faces = surface.mesh, surface.owner.reshape(-1)[texels]
    corners, normals = mesh.vertices[mesh.triangles[faces]].astype(np.float64), _normals(mesh, faces)
    middles, lift = corners.mean(axis=1), _LIFT * np.abs(corners).max(axis=(1, 2))
    edges = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1)
    judged = np.flatnonzero(lift <= _COARSE * edges)

    def look(rows: Ints, side: float) -> _Seen:
        starts = middles[rows] + side * lift[rows, None] * normals[rows]
        return _look(scene, surface, own, starts, side * normals[rows], control)

    sights = np.full(len(faces), Sight.OPEN, dtype=np.int64)
    before = look(judged, 1.0)
    sights[judged[~before.out]] = Sight.COVERED
    shut = judged[~before.out & ~before.others]
    behind = look(shut, -1.0)
    seen = np.array([[Sight.ENCLOSED, Sight.LINING], [Sight.FLIPPED, Sight.BURIED]], dtype=np.int64)
    sights[shut] = seen[before.backs[~before.out & ~before.others].astype(np.int64), behind.backs.astype(np.int64)]
    if mesh.normals is not None:
        sights[(mesh.normals[faces].sum(axis=1) * normals).sum(axis=1) < 0.0] = Sight.MISSHADED
    counts = np.bincount(sights, minlength=len(Sight))
    return {sight: float(counts[sight]) / len(faces) for sight in Sight}


@dataclass(frozen=True, eq=False)
class _Seen:
    """By a face's rays, (N,) bool: some get out, some meet other meshes, most meet backs of its own."""

    out: Flags
    others: Flags
    backs: Flags


def _look(
    scene: TraceScene, surface: TexelSurface, own: int, starts: Doubles, axes: Doubles, control: Control | None
) -> _Seen:
    """From (N, 3) places about (N, 3) axes; no farther where a ray has got out."""
    out, others = np.zeros(len(starts), dtype=np.bool_), np.zeros(len(starts), dtype=np.bool_)
    backs, left, places = (
        np.zeros(len(starts), dtype=np.int64),
        np.arange(len(starts), dtype=np.int64),
        starts.astype(np.float32),
    )
    for ways in _around(axes):
        if not len(left):
            break
        along, endless = np.ascontiguousarray(ways[left]), np.full(len(left), np.inf, dtype=np.float32)
        hits = scene.first_hits(places[left], along, endless, surface.threads, control)
        at_home = hits.met & (hits.geometry == own)
        out[left], others[left] = ~hits.met, others[left] | (hits.met & ~at_home)
        towards = (_normals(surface.mesh, hits.triangle[at_home]) * along[at_home]).sum(axis=1)
        backs[left[at_home]] += towards > 0.0
        left = left[hits.met]  # most are open, and done with by the first
    return _Seen(out, others, 2 * backs > _RAYS)


def _around(normals: Doubles) -> Iterator[Floats]:
    """For each of the rays its directions, (N, 3) float32, off the faces with these normals: cosine-weighted, by a
    Fibonacci spiral over the disc."""
    across = np.where(np.abs(normals[:, :1]) < 0.7, [[1.0, 0.0, 0.0]], [[0.0, 1.0, 0.0]])
    along = np.cross(normals, across)
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    over = np.cross(normals, along)
    for i in range(_RAYS):
        part, turn = (i + 0.5) / _RAYS, 2.399963229728653 * i
        x, y, z = np.sqrt(part) * cos(turn), np.sqrt(part) * sin(turn), np.sqrt(1.0 - part)
        yield (x * along + y * over + z * normals).astype(np.float32)


def _normals(mesh: WorldMesh, faces: Ints) -> Doubles:
    """(N, 3) unit normals of triangles by their corners; z where one has no area."""
    normals = unit_normals(mesh.vertices[mesh.triangles[faces]].astype(np.float64))
    normals[~normals.any(axis=1)] = (0.0, 0.0, 1.0)
    return normals


_TURN = "(Mesh > Normals > Recalculate Outside)"


def warnings(name: str, flipped: float, buried: float) -> list[str]:
    """A line for each share that is worth telling of an object."""
    lines = []
    if flipped >= TOLD:
        lines.append(
            f"{name}: about {100.0 * flipped:.0f} % of the texels see the backs of its own faces alone: their normals "
            f"are turned inwards {_TURN}, or another part of it closes over them"
        )
    if buried >= TOLD:
        lines.append(
            f"{name}: about {100.0 * buried:.0f} % of the texels lie inside other parts of the mesh itself, or where "
            "it touches itself, and get no light; move those parts apart, delete what nobody sees, or leave it so"
        )
    return lines


def dark_warnings(name: str, mean: float, overlapped: float, sights: Mapping[Sight, float]) -> list[str]:
    """The line for an object whose map is black and most of whose faces tell why, or none. overlapped: the share of its
    texels that show one of several faces."""
    sight = max((share, sight) for sight, share in sights.items())[1] if mean < _DARK else Sight.OPEN
    if sights[sight] < 0.5 or sight not in _CAUSES:
        return []
    overlaid = sight is Sight.LINING and overlapped >= 0.5
    return [f"{name}: no light reaches it: {_OVERLAID if overlaid else _CAUSES[sight]}"]


_OVERLAID = (
    "its UVs overlap, and the texels show the inside of a closed shell, as Solidify makes it; switch that off for "
    "renders, or apply it and unwrap the mesh anew"
)
_CAUSES = {
    Sight.ENCLOSED: f"its normals are turned inwards {_TURN}, or it is shut in; give it an opening, or limit the "
    "distance",
    Sight.LINING: "its texels are on the inside of a closed shell; give that an opening, or limit the distance",
    Sight.COVERED: "other objects shut it in; move them apart, hide them from render, or limit the distance",
    Sight.MISSHADED: "its custom normals point into its faces; clear them (Object Data > Geometry Data > Clear "
    "Custom Split Normals Data)",
}

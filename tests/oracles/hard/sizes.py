"""Far away, tiny, huge beside tiny, thin; and transforms that mirror and shear."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ....core.base.arrays import Doubles
from ....core.scene.scene import Instance, Mesh, Scene
from ..shapes import (
    box,
    grid_cells,
    in_cell,
    joined,
    matrix,
    moved,
    plane,
    quad,
    scene,
    skewed,
    sphere,
    turned_over,
)
from . import exact
from .case import Case, View
from .faces import BALL, ball, outer_open, paper_box

HERE = matrix(scale=1.0)


def _stage(under: Doubles) -> Scene:
    """A floor under a ball, beside a wall, with the wall's foot in the floor."""
    wall = quad((1, -2, -0.25), (0, 4, 0), (0, 0, 1.5), name="wall")
    return scene(plane(2.0), ball(), wall, under=under)


def _in_mesh() -> Scene:
    """The stage about (10240, -8192, 4096) in the mesh itself, on steps that float32 still has there."""
    wall = quad((1, -2, -0.25), (0, 4, 0), (0, 0, 1.5), name="wall")
    far = (10240.0, -8192.0, 4096.0)
    block = box((-0.5, -0.5, 0.25), (0.5, 0.75, 0.5), name="block")
    return scene(*(moved(mesh, far) for mesh in (plane(2.0), block, wall)))


def _near_mesh() -> Scene:
    wall = quad((1, -2, -0.25), (0, 4, 0), (0, 0, 1.5), name="wall")
    return scene(plane(2.0), box((-0.5, -0.5, 0.25), (0.5, 0.75, 0.5), name="block"), wall)


TINY = 1e-5


def _mixed_scale() -> Scene:
    """A floor of a few 1e-5 under a ball of its size, before a wall of 1."""
    spot = plane(2.0)
    wall = quad((-1, -1e3, 0), (0, 2e3, 0), (0, 0, 1), name="wall")
    small = matrix(scale=TINY)
    turned = skewed((7, 8, 9))
    instances = [Instance("floor", spot, turned @ small), Instance("ball", ball(), turned @ small)]
    return Scene(instances[:1], [*instances, Instance("wall", wall, turned)])


def _mixed_exact(view: View) -> Doubles:
    """Ball and wall do not overlap as seen from texels on the ball's -x side: the sum of what they block."""
    points = view.local
    wall = 1.0 - exact.endless_wall(1.0 + TINY * points[..., 0], 1.0)
    right = exact.ball_above_floor(points, *BALL) - wall
    apart = points[..., 0] < BALL[0][0] - 0.62
    return np.where(apart, right, np.nan)


def _one_mesh() -> Scene:
    """A closed room of side 2 in the corner of a mesh of side 2e5."""
    left, right = grid_cells(2, 1)
    room = moved(box(cell=left, inward=True), (99000, 99000, 2))
    plain = plane(1e5, height=-1.0)
    assert plain.uv is not None
    plain = replace(plain, uv=in_cell(plain.uv.astype(np.float64), right, 0.05).astype(np.float32))
    return scene(joined([room, plain], "both"))


def _room_closed(view: View) -> Doubles:
    """0 in the room; the plain is open but for the one texel that the room stands on."""
    near = np.linalg.norm(view.local - np.array([99000.0, 99000.0, 0.0]), axis=-1) < 3e4
    return np.where(view.owner < 12, 0.0, np.where(near, np.nan, 1.0))


def _strewn(*strays: Mesh) -> Scene:
    """A floor under a ball in one mesh with what strays from it, which owns no texel."""
    floor, under = plane(2.0), [replace(each, uv=np.full_like(each.uv, 0.5)) for each in strays]
    return scene(joined([replace(floor, normals=None), *under]), ball())


STRAYS = (
    quad((1e6, -2e6, 5e5), (0.1, 0, 0), (0, 0.1, 0)),
    quad((-1e6, 0.0, 3e6), (0.1, 0, 0), (0, 0.1, 0)),
)

MIRROR = np.diag([-1.0, 1.0, 1.0, 1.0])
SHEAR = np.array([(1.0, 0.5, 0.25, 0), (0, 1, -0.75, 0), (0, 0, 1, 0), (0, 0, 0, 1.0)])


def _mirrored() -> Scene:
    return _stage(MIRROR)


def _mirrored_in_data() -> Scene:
    """The same with the mirroring in the vertices, and the winding put right."""
    original = _stage(HERE)

    def through(mesh: Mesh) -> Mesh:
        mirrored = turned_over(replace(mesh, vertices=mesh.vertices * np.array([-1, 1, 1], np.float32)))
        return replace(mirrored, normals=None)

    return scene(*(through(instance.mesh) for instance in original.occluders))


def _ellipsoid(in_data: bool) -> Scene:
    """A smooth ball sheared to an ellipsoid, under a lid; by its matrix, or in its data with its true normals."""
    made = sphere(segments=48)
    lid = quad((-1.5, -1.5, 1.25), (3, 0, 0), (0, 3, 0), name="lid")
    if not in_data:
        return Scene([Instance("sphere", made, SHEAR)], [Instance("sphere", made, SHEAR), Instance("lid", lid, HERE)])
    assert made.normals is not None
    vertices = (made.vertices.astype(np.float64) @ SHEAR[:3, :3].T).astype(np.float32)
    normals = made.normals.astype(np.float64) @ np.linalg.inv(SHEAR[:3, :3])
    normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
    return scene(replace(made, vertices=vertices, normals=normals.astype(np.float32)), lid)


def _twin_at_origin() -> Scene:
    return _stage(HERE)


CASES = (
    Case(
        "huge coordinates, by the transform",
        "1e6 away from the origin: the bits of the scene at the origin.",
        "It traces in world space, where floats are 0.06 apart: a bright diagonal and a dark column, each a face that "
        "blocks itself or lets rays by.",
        lambda: _stage(matrix((1e6, -2e6, 5e5))),
        twin=_twin_at_origin,
        bits=True,
    ),
    Case(
        "huge coordinates, turned and scaled",
        "1e6 away, turned and 3.7 times as large: the scene at the origin, within noise.",
        "A bright diagonal, for the same reason.",
        lambda: _stage(skewed((1e6, -2e6, 5e5), 3.7)),
        twin=_twin_at_origin,
    ),
    Case(
        "huge coordinates, in the mesh",
        "1e4 away in the vertices, on steps that float32 has there: the bits of the scene at the origin.",
        "",
        _in_mesh,
        twin=_near_mesh,
        bits=True,
    ),
    Case(
        "tiny objects",
        "A scene and a ray distance 2^-13 (1.2e-4) times as large: the same bits.",
        "",
        lambda: _stage(matrix(scale=2.0**-13)),
        twin=_twin_at_origin,
        bits=True,
        distance=2.0**-13 * 1.5,
        twin_distance=1.5,
    ),
    Case(
        "tiny and turned",
        "A scene 1e-4 times as large, turned: the scene as it was, within noise.",
        "",
        lambda: _stage(skewed((0.3, 0.2, 0.1), 1e-4)),
        twin=_twin_at_origin,
    ),
    Case(
        "huge next to tiny",
        "A ball and its floor of 1e-5 before a wall of 1 (2000 long): exactly what the two block together.",
        "A bright diagonal: at 10 units from the origin floats are a fortieth of this object apart.",
        _mixed_scale,
        expected=_mixed_exact,
        slack=8e-3,
        mean_slack=1e-3,
    ),
    Case(
        "huge and tiny in one mesh",
        "A closed room of side 2 in the corner of a mesh of side 2e5: 0 in the room, 1 on the plain.",
        "",
        _one_mesh,
        expected=_room_closed,
    ),
    Case(
        "a stray part far away",
        "A floor in one mesh with faces 1e6 of its sizes away: the bits of the floor without them.",
        "",
        lambda: _strewn(*STRAYS),
        twin=_strewn,
        bits=True,
    ),
    Case(
        "thin walls, 1e-3",
        "A closed box with walls 1e-3 thick: 1 outside, 0 inside.",
        "",
        lambda: scene(paper_box(1e-3), under=skewed((3, 2, 1), 0.8)),
        expected=outer_open,
        rays=32,
    ),
    Case(
        "thin walls, 1e-5",
        "A closed box with walls 1e-5 thick: 1 outside, 0 inside.",
        "",
        lambda: scene(paper_box(1e-5), under=skewed((3, 2, 1), 0.8)),
        expected=outer_open,
        rays=32,
    ),
    Case(
        "negative scale",
        "Mirrored by a scale of -1: the bits of the mesh mirrored in its vertices.",
        "",
        _mirrored,
        twin=_mirrored_in_data,
        bits=True,
    ),
    Case(
        "shear",
        "A smooth ball sheared by its matrix: the ellipsoid with its true normals, within noise.",
        "",
        lambda: _ellipsoid(in_data=False),
        twin=lambda: _ellipsoid(in_data=True),
    ),
)

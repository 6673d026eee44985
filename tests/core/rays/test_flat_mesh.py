"""Large triangles that pass near a part are split, and nothing else changes."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace

import numpy as np
import pytest
from occlusion_bake.core.bake import bake
from occlusion_bake.core.base.arrays import Doubles
from occlusion_bake.core.rays.embree import open_device
from occlusion_bake.core.rays.flat_mesh import flat_mesh
from occlusion_bake.core.rays.occluders import Occluders
from occlusion_bake.core.scene.cutout import Alpha, Cutout
from occlusion_bake.core.scene.parts import parts_of
from occlusion_bake.core.scene.scene import Instance, Mesh, Scene
from occlusion_bake.tests.oracles import shapes
from occlusion_bake.tests.oracles.settings import flat_settings

pytestmark = pytest.mark.usefixtures("unmeasured")
LEANING = shapes.skewed((30.0, -2.0, 1.0))
MIRRORED = LEANING @ np.diag([-1.0, 1.0, 1.0, 1.0])
GAP = 1e-3


def plate(half: float, cutout: Cutout | None = None, under: Doubles = LEANING) -> Instance:
    """A square a hair below the origin that faces up, its middle off to a side."""
    mesh = shapes.quad((-half, -1.3 * half, -GAP), (2 * half, 0, 0), (0, 2 * half, 0), name="plate")
    return replace(shapes.instance(mesh, under), cutout=cutout)


def half_open(half: float) -> Cutout:
    """Clear where the plate's x is below 0; a texture of two texels, laid about the middle."""
    mesh = plate(half).mesh
    place = mesh.vertices[mesh.triangles][:, :, :2]
    alpha = Alpha(np.array([[0.0, 1.0]], dtype=np.float32), linear=False)
    return Cutout([alpha], np.zeros(2, dtype=np.int32), np.float32(0.5) + place / np.float32(2.2 * 1.3 * half))


def asset(under: Doubles = LEANING) -> Instance:
    """A patch of floor that looks down, of side 2, and one beside it that looks up."""
    down = shapes.turned_over(shapes.quad((-1, -1, 0), (2, 0, 0), (0, 2, 0), (0.0, 0.0, 0.5, 1.0)))
    up = shapes.quad((-1, 1, 0), (2, 0, 0), (0, 2, 0), (0.5, 0.0, 1.0, 1.0))
    return shapes.instance(shapes.joined([down, up], "asset"), under)


@pytest.mark.parametrize("half", [1e2, 1e5, 1e9])
def test_pieces_are_rounded_by_a_share_of_how_far_off_they_are(half: float) -> None:
    target, ground = asset(), plate(half)
    (part,) = parts_of(target)
    flat = flat_mesh(ground, part)
    corners = flat.vertices[flat.triangles].astype(np.float64)
    far = np.linalg.norm(corners, axis=2).max(axis=1)
    near = np.linalg.norm(corners.mean(axis=1), axis=1)
    assert np.all(far <= 16.0 * np.maximum(part.radius, near))
    areas = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    assert areas.sum() == pytest.approx(2.0 * (2.0 * half) ** 2, rel=1e-5)
    assert flat.whole is not None and len(flat.whole) == len(flat.triangles) < 1000
    assert set(flat.whole) == {0, 1}


def test_pieces_stay_closed_to_the_bit() -> None:
    """Each side within the plate is two pieces' own, once each way; they share their corners' bits."""
    half = 1e6
    (part,) = parts_of(asset())
    flat = flat_mesh(plate(half), part)
    corners = [[corner.tobytes() for corner in triangle] for triangle in flat.vertices[flat.triangles]]
    sides = Counter((one[i], one[(i + 1) % 3]) for one in corners for i in range(3))
    alone = [side for side in sides if side[::-1] not in sides]
    assert max(sides.values()) == 1
    lengths = [float(np.linalg.norm(np.subtract(*(np.frombuffer(end, np.float32) for end in side)))) for side in alone]
    assert sum(lengths) == pytest.approx(8.0 * half, rel=1e-5)  # the rim of the square


@pytest.mark.parametrize(
    "target", [asset(), replace(asset(), mesh=shapes.sphere()), asset(MIRRORED)], ids=["patches", "ball", "mirrored"]
)
def test_what_is_near_and_what_is_level_stays_whole(target: Instance) -> None:
    (part,) = parts_of(target)
    assert flat_mesh(target, part).whole is None
    assert flat_mesh(plate(1e6, under=np.eye(4)), part).whole is None


def baked(target: Instance, *others: Instance) -> Doubles:
    (made,) = bake(Scene([target], [target, *others]), flat_settings(width=32, height=16, margin=0, rays=64))
    return made.maps["ao"].values.astype(np.float64)


@pytest.mark.parametrize("under", [LEANING, MIRRORED], ids=["leaning", "mirrored"])
@pytest.mark.parametrize("half", [1e5, 1e7])
def test_a_plate_is_where_it_is_however_wide(half: float, under: Doubles) -> None:
    """What stands a thousandth above it looks at it, and what is beside that at the sky; joined or not."""
    target = asset(under)
    for made in (
        baked(target, plate(half, under=under)),
        baked(replace(target, mesh=joined_to(target.mesh, plate(half).mesh))),
    ):
        assert made[2:14, 2:14].max() < 0.01
        assert made[2:14, 18:30].min() > 0.99


def joined_to(mesh: Mesh, other: Mesh) -> Mesh:
    """The other's texture is a corner of the first one's."""
    assert other.uv is not None
    return shapes.joined([mesh, replace(other, uv=0.01 * other.uv)])


@pytest.mark.parametrize("under", [LEANING, MIRRORED], ids=["leaning", "mirrored"])
def test_what_is_cut_out_of_a_wide_plate_stays_where_it_is(under: Doubles) -> None:
    half = 1e4
    made = baked(asset(under), plate(half, half_open(half), under))[2:14]
    few = baked(asset(under), plate(40.0, half_open(40.0), under))[2:14]
    assert few[:, 2:14].min() < 0.01 and few[:, 2:14].max() > 0.99
    assert np.abs(made - few)[:, 2:14].mean() < 0.01


def test_hits_name_the_triangle_that_was_split() -> None:
    target, ground = asset(), plate(1e6)
    frame = Occluders(open_device(), [target, ground]).frame_for(target)
    down = -LEANING[:3, 2]
    above = np.array([(0, 50, 1), (0, -50, 1), (50, -50, 1), (-50, 50, 1)]) @ LEANING[:3, :3].T
    starts = np.ascontiguousarray(above + LEANING[:3, 3] - frame.origin, dtype=np.float32)
    along = np.tile(down, (4, 1)).astype(np.float32)
    hits = frame.scene.first_hits(starts, along, np.full(4, np.inf, dtype=np.float32))
    assert hits.met.all() and set(hits.triangle) <= {0, 1}

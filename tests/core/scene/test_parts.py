"""A target is parted where float32 would not hold it about one origin, and nowhere else."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from occlusion_bake.core.bake import bake
from occlusion_bake.core.base.arrays import Doubles
from occlusion_bake.core.scene.parts import SIZES, Part, parts_of
from occlusion_bake.core.scene.scene import Instance, Mesh, Scene
from occlusion_bake.tests.oracles import shapes, whole_bakes
from occlusion_bake.tests.oracles.settings import flat_settings

pytestmark = pytest.mark.usefixtures("unmeasured")
ASSET = shapes.sphere(segments=24)  # its triangles' sides are 0.13 at most
STRAY = Mesh(
    "stray",
    0.1 * np.eye(3, dtype=np.float32),
    np.arange(3, dtype=np.int32).reshape(1, 3),
    np.zeros((1, 3, 2), dtype=np.float32),
)


def grown(mesh: Mesh, factor: float) -> Mesh:
    return replace(mesh, vertices=mesh.vertices * np.float32(factor))


def terrain_with_skirt(reach: float) -> Mesh:
    """A square of 64 x 64 cells of side 1, and a rim that goes down and out from its borders, of one piece with it."""
    lines = np.array([-reach, *np.arange(-32.0, 33.0), reach])
    x, y = np.meshgrid(lines, lines)
    z = np.where(np.maximum(np.abs(x), np.abs(y)) > 32.0, -reach, 0.0)
    corner = np.arange(x.size, dtype=np.int32).reshape(x.shape)
    a, b, c, d = (each.ravel() for each in (corner[:-1, :-1], corner[:-1, 1:], corner[1:, 1:], corner[1:, :-1]))
    triangles = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
    return Mesh("terrain", np.stack([x, y, z], axis=-1).reshape(-1, 3).astype(np.float32), triangles)


def around(count: int, radius: float) -> list[Mesh]:
    angles = np.linspace(0.0, 2.0 * np.pi, count, endpoint=False)
    return [shapes.moved(STRAY, (radius * np.cos(a), radius * np.sin(a), 0.0)) for a in angles]


def joined(*others: Mesh, at: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> Mesh:
    """The asset first, moved."""
    return shapes.joined([replace(each, normals=None) for each in (shapes.moved(ASSET, at), *others)])


JOINED = {
    "triangle, 1e3": joined(shapes.moved(STRAY, (1e3, 0, 0))),
    "triangle, 1e6": joined(shapes.moved(STRAY, (0, -1e6, 1e5))),
    "triangle, 1e9": joined(shapes.moved(grown(STRAY, 1e4), (1e9, 0, 0))),
    "asset away from the mesh's origin": joined(STRAY, at=(4e3, 0, 0)),
    "two strays, either side": joined(shapes.moved(STRAY, (1e5, 0, 0)), shapes.moved(STRAY, (-3e5, 0, 0))),
    "ring of few": joined(*around(8, 1e6)),
    "ring of many": joined(*around(200, 1e5)),
    "ground plate": joined(shapes.moved(grown(shapes.plane(), 1e6), (7e5, 0, -1))),
    "sky dome": joined(shapes.moved(grown(ASSET, 1e5), (4e4, 0, 0))),
    "both, and strays": joined(grown(shapes.plane(), 1e7), grown(ASSET, 1e5), *around(5, 1e6), at=(5e3, 0, 0)),
}
UNDER = {"as it is": np.eye(4), "moved and small": shapes.matrix((1e7, 5.0, -1e3), 0.01, turned=True)}


def reach_of(part: Part, target: Instance, triangles: slice) -> float:
    """How far from the part's origin, along an axis, those of its triangles are that are listed."""
    assert part.triangles is not None
    mine = np.flatnonzero(part.triangles[triangles])
    if not len(mine):
        return 0.0
    corners: Doubles = target.mesh.vertices[target.mesh.triangles[triangles][mine]].astype(np.float64)
    world = corners @ target.matrix[:3, :3].T + target.matrix[:3, 3]
    return float(np.abs(world - part.origin).max())


@pytest.mark.parametrize("under", UNDER)
@pytest.mark.parametrize("name", JOINED)
def test_an_asset_keeps_its_precision_whatever_is_joined_to_it(name: str, under: str) -> None:
    """Rays start off by 2^-20 of the distance from the origin: a thousandth of a triangle, at most."""
    target = Instance("target", JOINED[name], UNDER[under])
    parts = parts_of(target)
    size = 0.13 * np.linalg.norm(target.matrix[:3, 0])
    assert max(reach_of(part, target, slice(len(ASSET.triangles))) for part in parts) <= SIZES * size
    held = np.sum([part.triangles for part in parts], axis=0)
    assert np.all(held == 1)


@pytest.mark.parametrize("reach", [1e5, 1e7])
def test_a_skirt_takes_nothing_from_its_terrain(reach: float) -> None:
    target = Instance("target", terrain_with_skirt(reach), np.eye(4))
    parts = parts_of(target)
    assert len(parts) == 2
    inner = np.abs(target.mesh.vertices[target.mesh.triangles]).max(axis=(1, 2)) <= 32.0
    assert np.array_equal(parts[0].triangles, inner)
    assert np.abs(parts[0].origin).max() < 1.0


@pytest.mark.parametrize(
    "mesh",
    [
        shapes.plane(),
        whole_bakes.plane(whole_bakes.SPLIT),
        ASSET,
        shapes.sphere(segments=300),
        joined(shapes.moved(STRAY, (20.0, 0, 0))),
        shapes.joined([shapes.moved(ASSET, (4.0 * x, 4.0 * y, 0)) for x in range(12) for y in range(12)]),
    ],
    ids=["plane", "needles", "ball", "fine ball", "near stray", "field"],
)
def test_an_ordinary_mesh_is_one_part(mesh: Mesh) -> None:
    (part,) = parts_of(Instance("target", mesh, UNDER["moved and small"]))
    assert part.triangles is None


def test_what_owns_no_texel_parts_nothing() -> None:
    target = Instance("target", JOINED["triangle, 1e6"], np.eye(4))
    counted = np.arange(len(target.mesh.triangles), dtype=np.int64) < len(ASSET.triangles)
    (part,) = parts_of(target, counted)
    assert np.abs(part.origin).max() < 1e-6


def test_parts_are_put_together_to_one_map() -> None:
    """Two rooms of three walls, 1e6 apart in one mesh: each as it is alone, and the margin once."""
    room = shapes.room(("-x", "+x", "-z"))
    halves = [replace(room, uv=room.uv * np.float32([0.5, 1.0]) + np.float32([left, 0.0])) for left in (0.0, 0.5)]
    both = shapes.joined([halves[0], shapes.moved(halves[1], (1e6, 0, 0))])
    settings = flat_settings(width=64, height=32, rays=64, margin=2)

    def baked(mesh: Mesh) -> np.ndarray:
        target = shapes.instance(mesh)
        (made,) = bake(Scene([target], [target]), settings)
        assert made.texels == np.count_nonzero(made.maps["ao"].covered)
        return made.maps["ao"].values

    together = baked(both)
    assert 0.2 < together.mean() < 0.8
    for half, left in zip(halves, (slice(0, 30), slice(34, 64)), strict=True):  # but for what the margins share
        assert np.abs(together[:, left] - baked(half)[:, left]).max() <= 2 / 64


FLOOR = shapes.quad((-1, -1, 0), (2, 0, 0), (0, 2, 0), (0.0, 0.0, 0.8, 1.0))
BESIDE = (0.9, 0.0, 1.0, 1.0)
ENCLOSING = {
    "stray": lambda r: shapes.quad((r, r, r), (1, 0, 0), (0, 1, 0), BESIDE),
    "plate": lambda r: shapes.quad((-0.3 * r, -r, -1), (2 * r, 0, 0), (0, 2 * r, 0), BESIDE),
    "four clusters": lambda r: shapes.joined(
        [
            shapes.quad((r * np.cos(turn), r * np.sin(turn), 0.1), (0.1, 0, 0), (0, 0.1, 0), BESIDE)
            for turn in (0.0, 1.5, 3.0, 4.5)
        ]
    ),
}


@pytest.mark.parametrize("reach", [40.0, 300.0, 2e3])
@pytest.mark.parametrize("what", ENCLOSING)
def test_a_gap_much_thinner_than_the_triangles_stays_open(what: str, reach: float) -> None:
    """A lid at 10^-4 over a floor of two triangles: dark below it, whatever is joined to them."""
    lid = shapes.turned_over(shapes.quad((-0.5, -0.5, 1e-4), (1, 0, 0), (0, 1, 0), (0.82, 0.0, 0.88, 1.0)))
    target = shapes.instance(shapes.joined([FLOOR, lid, ENCLOSING[what](reach)]))
    (made,) = bake(Scene([target], [target]), flat_settings(width=40, height=32, margin=0, rays=32))
    below = made.maps["ao"].values[10:22, 10:22]
    assert below.max() < 0.01


def test_scattered_parts_of_a_body_stay_with_it() -> None:
    """Bolts on a plate that is not empty: no cluster is alone."""
    bolts = [shapes.moved(grown(ASSET, 0.2), (x, y, 0.0)) for x in range(-9, 10, 3) for y in range(-9, 10, 3)]
    body = shapes.grid(10.0, 40)
    (part,) = parts_of(Instance("target", joined(body, *bolts), np.eye(4)))
    assert part.triangles is None


def test_parts_about_one_origin_are_each_traced_among_what_is_near_them() -> None:
    """A patch in the middle of a wide box, and a lid that is near the top of the box alone."""
    patch = shapes.grid(0.5, 4)
    walls = shapes.block(half=1e5)
    beside = [replace(each, uv=0.45 * each.uv + np.float32([left, 0.0])) for each, left in ((patch, 0.0), (walls, 0.5))]
    target = shapes.instance(shapes.joined(beside))
    parts = parts_of(target)
    assert len(parts) == 2 and np.array_equal(parts[0].origin, parts[1].origin)
    lid = shapes.instance(shapes.turned_over(shapes.plane(1e6, 1e5 + 1.0, name="lid")))
    (made,) = bake(
        Scene([target], [target, lid]), flat_settings(width=64, height=32, margin=0, rays=16, distance=100.0)
    )
    values = made.maps["ao"].values[made.maps["ao"].covered]
    assert np.count_nonzero(values < 0.5) > 20

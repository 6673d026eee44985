"""The whole way from a scene to finished maps: what must not change the picture, and what must be refused."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_array_equal
from occlusion_bake.core.bake import bake
from occlusion_bake.core.base.errors import InputError
from occlusion_bake.core.rays.map_spec import AO, reflection, sampled
from occlusion_bake.core.scene.scene import Camera, Instance, Mesh, Scene
from occlusion_bake.core.settings import MAX_SIZE
from occlusion_bake.core.solve.goal import MAX_RAYS
from occlusion_bake.tests.oracles import shapes
from occlusion_bake.tests.oracles.bakes import assert_mean, bake_one, means_of
from occlusion_bake.tests.oracles.settings import flat_settings

OFFSETS = (0.0, 1e3, 1e5)
SCALES = (1e-3, 1.0, 1e3)
MAPS = (AO, reflection(10))
EVERYWHERE = replace(sampled(AO, "uniform_sphere"), name="ao uniform_sphere")  # tries the directions of a leak as well
SIDES = ("-x", "+x", "-y", "+y", "-z", "+z")


def moved(offset: float, scale: float = 1.0, turned: bool = False) -> np.ndarray:
    """A matrix with an offset along no axis."""
    matrix: np.ndarray = shapes.matrix((offset, -offset, 0.7 * offset), scale, turned)
    return matrix


def stage(matrix: np.ndarray | None = None, camera: Camera | None = None) -> Scene:
    """A floor under a sphere, beside a wall."""
    others = (shapes.sphere((0.2, 0.1, 0.7), 0.6, 48), shapes.quad((1, -2, 0), (0, 4, 0), (0, 0, 1.5), name="wall"))
    scene: Scene = shapes.scene(shapes.plane(2.0, name="floor"), *others, under=matrix, camera=camera)
    return scene


def with_junk(mesh: Mesh) -> Mesh:
    """The mesh twice, and triangles without an area."""
    flat = shapes.quad(mesh.vertices[0], mesh.vertices[6] - mesh.vertices[0], mesh.vertices[6] - mesh.vertices[0])
    point = shapes.quad(mesh.vertices[2], (0, 0, 0), (0, 0, 0))
    joined: Mesh = shapes.joined([mesh, mesh, flat, point], mesh.name)
    return joined


@pytest.mark.usefixtures("unmeasured")
@pytest.mark.parametrize("turned", [False, True])
@pytest.mark.parametrize("scale", SCALES)
@pytest.mark.parametrize("offset", OFFSETS)
def test_no_ray_leaves_a_closed_box(offset: float, scale: float, turned: bool) -> None:
    scene = shapes.scene(shapes.room(), under=moved(offset, scale, turned))
    baked = bake_one(scene, maps=(*MAPS, EVERYWHERE), size=64, seed=5)
    assert baked.rays > 700_000
    for result in baked.maps.values():
        assert np.count_nonzero(result.values) == 0


@pytest.mark.usefixtures("unmeasured")
@pytest.mark.parametrize("turned", [False, True])
def test_no_ray_leaves_a_closed_sphere(turned: bool) -> None:
    ball = shapes.sphere(segments=32, smooth=False)
    inside = Mesh("inside", ball.vertices, ball.triangles[:, ::-1].copy(), ball.uv[:, ::-1].copy())
    baked = bake_one(shapes.scene(inside, under=moved(1e3, 3.3, turned)), maps=MAPS, size=64, rays=128)
    for result in baked.maps.values():
        assert np.count_nonzero(result.values) == 0


@pytest.mark.usefixtures("unmeasured")
def test_no_ray_leaves_a_box_full_of_junk() -> None:
    matrix = moved(1e5, 1e-3, turned=True)
    room = shapes.instance(with_junk(shapes.room()), matrix)
    lost = replace(shapes.plane(1.0), vertices=np.full((4, 3), np.nan, np.float32), name="lost")
    baked = bake_one(Scene([room], [room, shapes.instance(lost, matrix)]), maps=MAPS, size=64)
    for result in baked.maps.values():
        assert np.count_nonzero(result.values) == 0
    assert baked.warnings[0] == "lost: triangles with non-finite vertices do not occlude"
    assert baked.warnings[1] == "room: 4 triangles have zero area and are left out"
    assert any(warning.startswith("room: UVs overlap") for warning in baked.warnings)


@pytest.mark.usefixtures("unmeasured")
@pytest.mark.parametrize("side", SIDES)
def test_a_box_with_a_side_open_leaks_there(side: str) -> None:
    """The check of the checks above: the sides that remain all see the missing one."""
    result = bake_one(shapes.scene(shapes.room([each for each in SIDES if each != side])), size=48).maps["ao"]
    assert np.mean(result.values[result.covered] > 0) > 0.95
    assert abs(result.mean - 0.2) < 0.005  # what leaves the open side comes from five of its size


@pytest.mark.usefixtures("unmeasured")
@pytest.mark.parametrize("turned", [False, True])
@pytest.mark.parametrize("scale", SCALES)
@pytest.mark.parametrize("offset", OFFSETS)
def test_a_level_floor_of_many_triangles_is_open(offset: float, scale: float, turned: bool) -> None:
    """Rounding tilts the triangles of a turned floor against each other; no ray may notice."""
    steps = np.arange(20, dtype=np.int64) / 20
    tiles = [
        shapes.quad((3 * x, 3 * y, 0), (0.15, 0, 0), (0, 0.15, 0), (x, y, x + 0.05, y + 0.05))
        for x in steps
        for y in steps
    ]
    scene = shapes.scene(shapes.joined(tiles), under=moved(offset, scale, turned))
    baked = bake_one(scene, maps=MAPS, size=32, rays=64)
    for result in baked.maps.values():
        assert result.covered.all()
        assert np.all(result.values == 1.0)


@pytest.mark.usefixtures("unmeasured")
@pytest.mark.parametrize("offset", [1e3, 1e5, -12345.678])
def test_moving_everything_changes_next_to_nothing(offset: float) -> None:
    here, there = (bake_one(stage(moved(by)), size=64).maps["ao"].values for by in (0.0, offset))
    assert np.mean(here != there) < 0.002  # float64 rounds 1e5 at 1e-11, and a few vertices change their last bit
    assert np.abs(here - there).max() <= 1 / 64


@pytest.mark.parametrize("power", [-20, -3, 1, 20])
@pytest.mark.parametrize("distance", [None, 1.3])
def test_scaling_by_a_power_of_two_changes_no_bit(distance: float | None, power: int) -> None:
    factor = 2.0**power
    scaled = bake_one(
        stage(shapes.matrix(scale=factor)), size=64, distance=None if distance is None else distance * factor
    )
    plain = bake_one(stage(), size=64, distance=distance)
    assert_array_equal(plain.maps["ao"].values, scaled.maps["ao"].values)
    assert plain.maps["ao"].error == scaled.maps["ao"].error


@pytest.mark.usefixtures("unmeasured")
def test_turning_or_mirroring_everything_changes_noise_alone() -> None:
    settings = {"maps": MAPS, "size": 32, "rays": 64}
    plain = means_of(stage(), **settings)
    for matrix in (shapes.matrix(turned=True), shapes.matrix(scale=(-2, -2, -2))):
        other = means_of(stage(matrix), **settings)
        for name in plain:
            assert_mean(np.subtract(plain[name], other[name]), 0.0)


def test_threads_change_no_bit() -> None:
    one, *others = (bake_one(stage(), maps=MAPS, size=60, rays=48, threads=threads) for threads in (1, 2, 3))
    for other in others:
        for name, result in one.maps.items():
            assert_array_equal(result.values, other.maps[name].values)
            assert_array_equal(result.coverage, other.maps[name].coverage)
            assert (result.error, result.mean) == (other.maps[name].error, other.maps[name].mean)


def row_of_balls(places: tuple[float, ...]) -> list[Instance]:
    return [shapes.instance(shapes.sphere(segments=32), shapes.matrix((x, 0, 0)), f"at {x}") for x in places]


@pytest.mark.usefixtures("unmeasured")
def test_objects_baked_together_have_the_bits_of_each_alone() -> None:
    """The first of several near ones, and every far one, has a frame of its own either way."""
    settings = flat_settings(width=48, height=48, rays=32, margin=2)
    balls = row_of_balls((0.0, 2.1, 40.0))
    together = {baked.name: baked for baked in bake(Scene(balls, balls), settings)}
    assert list(together) == ["at 0.0", "at 2.1", "at 40.0"]
    for target in (balls[0], balls[2]):
        (alone,) = bake(Scene([target], balls), settings)
        assert_array_equal(alone.maps["ao"].values, together[target.name].maps["ao"].values)
    (alone,) = bake(Scene([balls[1]], balls), settings)  # together it was traced about the middle of its neighbour
    difference = alone.maps["ao"].values - together["at 2.1"].maps["ao"].values
    assert np.mean(difference != 0) < 0.01 and np.abs(difference).max() <= 2 / 32


@pytest.mark.usefixtures("unmeasured")
def test_a_far_occluder_costs_the_near_ones_no_precision() -> None:
    scene = stage()
    far = shapes.instance(shapes.plane(1.0), shapes.matrix((1e6, 1e6, -1.0)), "far")
    below = bake_one(Scene(scene.targets, [*scene.occluders, far]), size=64).maps["ao"].values
    assert_array_equal(below, bake_one(scene, size=64).maps["ao"].values)


@pytest.mark.usefixtures("unmeasured")
def test_a_scene_far_off_is_as_tight_as_one_here() -> None:
    """A gap of a hundredth of a millimetre, a hundred kilometres away: a float32 of 1e5 steps by 8 mm."""
    gap, matrix = 1e-5, moved(1e5)
    scene = shapes.scene(shapes.plane(0.5, name="floor"), shapes.plane(0.5, gap, up=-1.0, name="lid"), under=matrix)
    assert np.mean(bake_one(scene, size=64).maps["ao"].values > 0) < 0.01
    assert bake_one(scene, size=64, distance=gap / 2).maps["ao"].mean > 0.7  # 1 - 0 but for rays within half the gap
    assert np.all(bake_one(scene, size=64, distance=gap * 0.9).maps["ao"].values == 1.0)


@pytest.mark.parametrize("rays", [1, 5, 64, 300])
def test_values_lie_between_0_and_1(rays: int) -> None:
    camera = Camera((1.0, -4.0, 3.0), (0.0, 0.0, -1.0))
    maps = (*MAPS, replace(reflection(10, from_camera=True), name="from camera"))
    scene = Scene([shapes.instance(shapes.sphere((0.2, 0.1, 0.7), 0.6, 32))], stage().occluders, camera)
    (baked,) = bake(scene, flat_settings(maps, width=48, height=40, rays=rays, margin=4))
    for result in baked.maps.values():
        assert result.values.dtype == np.float32 and result.values.shape == (40, 48)
        assert result.values.min() >= 0 and result.values.max() <= 1
        assert 0 <= result.mean <= 1 and result.error >= 0
        assert np.all(result.coverage[~result.covered] == 0) and result.coverage.max() <= 1


def test_texels_that_face_away_from_the_camera_are_not_covered() -> None:
    both = (AO, reflection(10, from_camera=True))
    for height, seen in ((3.0, True), (-3.0, False)):
        scene = stage(camera=Camera((0.1, 0.2, height), (0.0, 0.0, -1.0)))
        maps = bake_one(scene, maps=both, size=24).maps
        assert maps["ao"].covered.all()
        assert np.all(maps["ro_10"].covered == seen)
        assert np.all((maps["ro_10"].coverage > 0) == seen)
    assert np.all(maps["ro_10"].values == 1.0)  # no texel at all: open


def test_the_camera_goes_with_the_scene() -> None:
    near = stage(camera=Camera((1.0, -1.0, 3.0), (0.0, 0.0, -1.0)))
    far = stage(moved(1e5), Camera((1e5 + 1.0, -1e5 - 1.0, 0.7e5 + 3.0), (0.0, 0.0, -1.0)))
    maps = (reflection(10, from_camera=True),)
    here, there = (bake_one(scene, maps=maps, size=48).maps["ro_10"].values for scene in (near, far))
    assert np.mean(here != there) < 0.01 and np.abs(here - there).max() <= 2 / 64


def test_a_result_tells_what_was_done() -> None:
    baked = bake_one(stage(), maps=MAPS, size=32, rays=8)
    assert (baked.name, baked.size) == ("floor", (32, 32))
    assert baked.texels == 32 * 32 and baked.rays == 32 * 32 * 8 * 2
    assert [result.rays for result in baked.maps.values()] == [32 * 32 * 8] * 2
    assert list(baked.maps) == ["ao", "ro_10"]
    assert set(baked.seconds) == {"inputs", "texels", "build", "inside", "trace", "solve", "probe", "finish"}
    assert all(seconds >= 0 for seconds in baked.seconds.values())
    assert baked.warnings == []
    values = baked.maps["ao"].values
    assert baked.maps["ao"].mean == pytest.approx(float(values.mean(dtype=np.float64)))


def test_margins_are_filled_and_not_covered() -> None:
    floor = shapes.quad((-2, -2, 0), (4, 0, 0), (0, 4, 0), cell=(0.25, 0.25, 0.75, 0.75), name="floor")
    (baked,) = bake(shapes.scene(floor, shapes.plane(4.0, 1.0)), flat_settings(width=32, height=32, rays=16, margin=4))
    result = baked.maps["ao"]
    assert result.covered.sum() == 16 * 16 == baked.texels
    assert np.all(result.coverage == result.covered)
    assert_array_equal(result.values[7, 9:23], [row.mean(dtype=np.float32) for row in neighbours(result.values[8])])


def neighbours(row: np.ndarray) -> list[np.ndarray]:
    """The three texels below each of the first ring's, but at its ends."""
    return [row[x - 1 : x + 2] for x in range(9, 23)]


@pytest.mark.parametrize(
    ("settings", "cause"),
    [
        ({"maps": ()}, "nothing to bake"),
        ({"maps": (AO, sampled(AO, "uniform_sphere"))}, "ao, ao two have the same name"),
        ({"width": 0}, "size 0x1024"),
        ({"height": -3}, "size 1024x-3"),
        ({"width": MAX_SIZE + 1}, "size 65537x1024"),
        ({"rays": 0}, "rays 0"),
        ({"rays": MAX_RAYS + 1}, "rays 1048577"),
        ({"distance": 0.0}, "distance 0"),
        ({"distance": -1.0}, "distance -1"),
        ({"distance": float("nan")}, "distance nan"),
        ({"distance": float("inf")}, "distance inf"),
        ({"margin": -1}, "margin -1"),
        ({"threads": -2}, "threads -2"),
    ],
)
def test_settings_out_of_range_are_refused(settings: dict[str, Any], cause: str) -> None:
    with pytest.raises(InputError, match=cause) as refusal:
        flat_settings(**settings)
    assert "\n" not in str(refusal.value)


def test_the_ends_of_the_ranges_are_taken() -> None:
    settings = flat_settings(width=1, height=MAX_SIZE, rays=MAX_RAYS, margin=0, distance=1e-30)
    assert settings.rays.reach == 1e-30
    assert flat_settings().rays.reach == np.inf


def test_r_from_a_camera_needs_one() -> None:
    with pytest.raises(InputError, match="camera"):
        bake_one(stage(), maps=(reflection(10, from_camera=True),))


@pytest.mark.parametrize(
    "broken",
    [
        Camera((0.0, np.nan, 3.0), (0.0, 0.0, -1.0)),
        Camera((0, 1e39, 3), (0, 0, -1)),
        Camera((0, 0, 3), (0, 0, np.inf), True),
    ],
)
def test_r_from_a_camera_needs_a_finite_one(broken: Camera) -> None:
    with pytest.raises(InputError, match=r"camera: .* not finite.*; clear it"):
        bake_one(stage(camera=broken), maps=(reflection(10, from_camera=True),))
    bake_one(stage(camera=broken))  # AO does not look through it


@pytest.mark.parametrize(
    ("break_it", "cause"),
    [
        (lambda mesh: replace(mesh, uv=None), "no UV map"),
        (lambda mesh: replace(mesh, triangles=mesh.triangles[:0], uv=mesh.uv[:0]), "no faces"),
        (lambda mesh: replace(mesh, vertices=mesh.vertices * np.float32(np.nan)), "not finite"),
        (lambda mesh: replace(mesh, vertices=mesh.vertices * np.float32(0)), "zero area"),
        (lambda mesh: replace(mesh, uv=mesh.uv + np.float32(3)), "outside the 0-1 square"),
    ],
)
def test_objects_that_cannot_be_baked_are_named(break_it: Any, cause: str) -> None:
    target = shapes.instance(break_it(shapes.plane(1.0)), name="Rock.003")
    with pytest.raises(InputError, match=cause) as refusal:
        bake_one(Scene([target], []))
    assert str(refusal.value).startswith("Rock.003: ")
    assert "\n" not in str(refusal.value)


def test_warnings_on_occluders_stand_once() -> None:
    lost = shapes.instance(replace(shapes.plane(1.0), vertices=np.full((4, 3), np.nan, np.float32)), name="lost")
    balls = row_of_balls((0.0, 3.0))
    first, second = bake(Scene(balls, [*balls, lost]), flat_settings(width=64, height=64, rays=1))
    assert first.warnings == ["lost: triangles with non-finite vertices do not occlude"]
    assert second.warnings == []

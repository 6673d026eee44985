"""What artists may set of occlusion, each where its answer is known: a plate over a floor, a disc, a wall."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from occlusion_bake.core.bake import bake
from occlusion_bake.core.base.errors import InputError
from occlusion_bake.core.maps.light import LightMap
from occlusion_bake.core.rays.map_spec import AO, light, reflection
from occlusion_bake.core.rays.ray_options import Falloff, RayOptions
from occlusion_bake.core.rays.texel_surface import TexelSurface
from occlusion_bake.core.scene.cutout import Alpha, Cutout
from occlusion_bake.core.scene.ground_plane import ground_below
from occlusion_bake.core.scene.image_texture import Wrap
from occlusion_bake.core.scene.scene import Mesh, Scene
from occlusion_bake.core.solve.directional import DirectionalSettings
from occlusion_bake.core.spherical.directional_format import DirectionalFormat
from occlusion_bake.tests.oracles import shapes
from occlusion_bake.tests.oracles.bakes import assert_mean, bake_one, means_of
from occlusion_bake.tests.oracles.settings import flat_settings

pytestmark = pytest.mark.usefixtures("unmeasured")
HEIGHT, DISTANCE = 0.5, 2.0
RATIO = HEIGHT / DISTANCE
EXACT = {
    Falloff.NONE: RATIO**2,
    Falloff.LINEAR: 2 * RATIO - RATIO**2,
    Falloff.SMOOTH: 4 * RATIO**3 - 3 * RATIO**2 - 6 * RATIO**2 * np.log(RATIO),
}


def plate_scene(up: float = -1.0) -> Scene:
    """A floor, and a plate without end above it that faces down, or up."""
    return shapes.scene(shapes.patch(), shapes.plane(4096.0, HEIGHT, name="plate", up=up))


@pytest.mark.parametrize("falloff", Falloff)
def test_a_plate_blocks_the_less_the_farther_it_is(falloff: Falloff) -> None:
    """V is 1 or f(h / (d cos)) by the angle; its mean by the cosine is an integral over one variable."""
    means = means_of(plate_scene(), rays=64, size=8, distance=DISTANCE, falloff=falloff)
    assert_mean(means["ao"], EXACT[falloff], slack=1e-5)


@pytest.mark.parametrize("width", [1, 4, 8, 16])
def test_falloff_in_every_packet_width(width: int) -> None:
    from occlusion_bake.core.rays.embree import open_device
    from occlusion_bake.core.rays.trace_scene import TraceScene
    from occlusion_bake.core.rays.tracer import TraceOptions, trace
    from occlusion_bake.core.scene.world_mesh import world_mesh

    scene, floor = TraceScene(open_device(0)), shapes.patch()
    for instance in plate_scene().occluders:
        copy = world_mesh(instance, np.zeros(3))
        scene.add(copy.vertices, copy.triangles)
    scene.commit()
    owner = np.zeros((16, 16), dtype=np.int32)
    rays = TraceOptions(256, occlusion=RayOptions(DISTANCE, falloff=Falloff.LINEAR), packet_width=width)
    sums = trace(scene, TexelSurface(world_mesh(shapes.instance(floor), np.zeros(3)), owner), [AO], rays)
    assert sums.all.mean() / 256 == pytest.approx(EXACT[Falloff.LINEAR], abs=1e-3)


def test_what_is_nearer_than_the_nearest_distance_does_not_block() -> None:
    nearest = 0.8
    means = means_of(plate_scene(), rays=64, size=8, distance=DISTANCE, nearest=nearest)
    assert_mean(means["ao"], 1 - (HEIGHT / nearest) ** 2 + RATIO**2, slack=1e-5)


@pytest.mark.parametrize("exponent", [1.0, 10.0])
@pytest.mark.parametrize("spread", [60.0, 120.0, 180.0])
def test_a_spread_keeps_rays_in_a_cone(spread: float, exponent: float) -> None:
    """A cap of 20 degrees about the zenith is hidden; of the lobe within the cone, that is a known share."""
    cap, half = np.radians(20.0), np.radians(0.5 * spread)
    ring = np.linspace(0, 2 * np.pi, 721)[:-1]
    rim = np.stack([np.cos(ring) * np.tan(cap), np.sin(ring) * np.tan(cap), np.ones(720)], axis=1)
    following = (np.arange(720, dtype=np.int64) + 1) % 720 + 1
    triangles = np.stack([np.zeros(720, dtype=np.int64), np.arange(720, dtype=np.int64) + 1, following], axis=1)
    disc = Mesh("disc", np.vstack([[0, 0, 1], rim]).astype(np.float32), triangles.astype(np.int32))
    estimator = AO if exponent == 1.0 else reflection(exponent)
    means = means_of(shapes.scene(shapes.patch(), disc), rays=64, size=8, spread=spread, maps=(estimator,))
    power = exponent + 1.0
    hidden = (1 - np.cos(cap) ** power) / (1 - max(np.cos(half), 0.0) ** power)
    assert_mean(means[estimator.name], 1 - hidden, slack=3e-4)


@pytest.mark.parametrize("turned", [False, True])
@pytest.mark.parametrize("mirrored", [False, True])
def test_front_faces_alone_block(turned: bool, mirrored: bool) -> None:
    matrix = shapes.matrix((3, 1, -2), (1, 1, -1) if mirrored else 1.0, turned)
    for up, seen in ((-1.0, 0.0), (1.0, 1.0)):
        scene = plate_scene(up)
        instances = [replace(each, matrix=matrix) for each in scene.occluders]
        scene = Scene(instances[:1], instances)
        assert bake_one(scene, rays=64, front_only=True).maps["ao"].mean == pytest.approx(seen, abs=2e-3)
        assert bake_one(scene, rays=64).maps["ao"].mean == pytest.approx(0.0, abs=2e-3)


def checker(values: np.ndarray, wrap: Wrap = Wrap.REPEAT, repeats: float = 4096.0, linear: bool = False) -> Cutout:
    """A cutout for a plane of two triangles, its picture repeated."""
    uv = np.float32([[(0, 0), (1, 0), (1, 1)], [(0, 0), (1, 1), (0, 1)]]) * np.float32(repeats)
    alpha = Alpha(np.ascontiguousarray(values, dtype=np.float32), linear, wrap)
    return Cutout([alpha], np.zeros(2, dtype=np.int32), uv)


def cut_scene(cutout: Cutout | None, copies: int = 1) -> Scene:
    scene = plate_scene()
    plate = replace(scene.occluders[1], cutout=cutout)
    more = []
    for copy in range(copies):
        matrix = np.eye(4)
        matrix[2, 3] = 0.25 * copy
        more.append(replace(plate, matrix=matrix, name=f"plate {copy}"))
    return replace(scene, occluders=[scene.occluders[0], *more])


@pytest.mark.parametrize("opacity", [0.0, 0.3, 1.0])
def test_a_plate_of_some_opacity_lets_the_rest_through(opacity: float) -> None:
    """Each of two layers blocks that share of the rays that reach it."""
    for copies in (1, 2):
        means = means_of(cut_scene(checker(np.array([[opacity]])), copies), rays=64, size=32)
        assert_mean(means["ao"], (1 - opacity) ** copies, slack=1e-5)


def test_holes_are_where_the_picture_is_clear() -> None:
    """The half of a plate over x > 0 is clear: beside its edge half of the light comes through, as beside a wall."""
    picture = np.array([[1.0, 0.0]])
    (ao,) = (bake_one(cut_scene(checker(picture, wrap, 1.0)), rays=1024).maps["ao"].mean for wrap in (Wrap.EXTEND,))
    assert ao == pytest.approx(0.5, abs=5e-3)


def test_a_cutout_that_is_opaque_changes_nothing() -> None:
    scene = shapes.scene(shapes.plane(2.0, name="floor"), shapes.plane(0.7, 0.5, name="plate"))
    cut = replace(scene.occluders[1], cutout=checker(np.ones((2, 2))))
    plain = bake_one(scene, rays=64).maps["ao"].values
    np.testing.assert_array_equal(
        bake_one(replace(scene, occluders=[scene.occluders[0], cut]), rays=64).maps["ao"].values, plain
    )


def test_an_upright_wall_on_the_ground_sees_half() -> None:
    wall = shapes.instance(shapes.quad((0, -1, 0), (0, 2, 0), (0, 0, 2), name="wall"))
    on_ground = Scene([wall], [wall, ground_below([wall])])
    assert_mean(means_of(on_ground, rays=256, size=8)["ao"], 0.5, slack=2e-4)  # under the ground's rim


@pytest.mark.parametrize(
    ("wrong", "line"),
    [
        ({"nearest": -1.0}, "minimum distance -1"),
        ({"nearest": 2.0, "distance": 1.0}, "minimum distance 2"),
        ({"nearest": float("nan")}, "minimum distance nan"),
        ({"falloff": Falloff.LINEAR}, "falloff linear: it needs a distance"),
        ({"spread": 0.0}, "spread 0"),
        ({"spread": 181.0}, "spread 181"),
        (
            {"spread": 60.0, "code": DirectionalSettings(DirectionalFormat("sh", 3))},
            "spread 60: a directional code is of whole lobes",
        ),
        ({"spread": 60.0, "maps": (LightMap(),)}, "spread 60: the light itself"),
        (
            {"spread": 60.0, "divide_horizon": True, "maps": (reflection(10.0, from_camera=True),)},
            "spread 60: dividing by the horizon",
        ),
    ],
)
def test_wrong_settings_are_refused(wrong: dict[str, Any], line: str) -> None:
    with pytest.raises(InputError, match=line):
        flat_settings(**wrong)
    assert flat_settings(spread=60.0, maps=(light(),)).rays.spread == 60.0  # the share has a meaning within a cone
    assert flat_settings(spread=60.0, divide_horizon=True).rays.spread == 60.0  # of AO there is nothing to divide


def test_an_occluder_behind_another_is_met_through_its_hole() -> None:
    scene = cut_scene(checker(np.array([[0.0]])))
    solid = shapes.instance(shapes.plane(4096.0, 2 * HEIGHT, name="solid"))
    (baked,) = bake(replace(scene, occluders=[*scene.occluders, solid]), flat_settings(width=8, height=8, rays=64))
    assert baked.maps["ao"].mean == pytest.approx(0.0, abs=2e-3)


def test_a_cutout_of_another_mesh_is_refused() -> None:
    wrong = replace(checker(np.zeros((1, 1))), alpha=np.zeros(3, dtype=np.int32), uv=np.zeros((3, 3, 2), np.float32))
    with pytest.raises(InputError, match="a cutout of 3 triangles is laid over a mesh of 2"):
        bake_one(cut_scene(wrong))

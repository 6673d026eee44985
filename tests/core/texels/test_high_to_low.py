"""A low mesh baked from high ones: where the answer is known, at any size and place, and what is refused."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from occlusion_bake.core.bake import Baked, Settings, bake
from occlusion_bake.core.base.errors import InputError
from occlusion_bake.core.scene.scene import HighPoly, Instance, Mesh, Scene
from occlusion_bake.core.texels import high_to_low as module
from occlusion_bake.core.texels.high_to_low import AUTOMATIC, extrusion_of
from occlusion_bake.tests.oracles import shapes
from occlusion_bake.tests.oracles.settings import flat_settings

SETTINGS = flat_settings(width=48, height=32, rays=64, margin=0)


def baked(low: Instance, *highs: Instance, settings: Settings = SETTINGS, others: Any = (), **options: Any) -> Baked:
    scene = Scene([low], [*highs, *others], highs={low.name: HighPoly(highs, **options)})
    (one,) = bake(scene, settings)
    return one


def bowl(segments: int, name: str) -> Mesh:
    """The lower half of a ball, seen from within."""
    ball = shapes.turned_over(shapes.sphere(segments=segments, name=name))
    low = np.flatnonzero(ball.vertices[ball.triangles][..., 2].max(axis=1) < 1e-6)
    normals = None if ball.normals is None else ball.normals[low]
    return replace(ball, triangles=ball.triangles[low], uv=ball.uv[low], normals=normals)  # type: ignore[index]


@pytest.mark.parametrize(("offset", "scale"), [(0.0, 1.0), (1e4, 1e-2), (1e5, 1.0), (-3e3, 1e3)])
@pytest.mark.parametrize("mirror", [1.0, -1.0])
def test_a_ball_is_open_and_its_inside_shut(offset: float, scale: float, mirror: float) -> None:
    """From a ball of a few faces onto one of many: not one ray meets what it started from."""
    matrix = shapes.matrix((offset, -offset, offset), (scale, mirror * scale, scale), turned=True)
    low, high = (shapes.sphere(segments=n, name=name, smooth=False) for n, name in ((12, "low"), (192, "high")))
    for side, wanted in ((lambda mesh: mesh, 1.0), (shapes.turned_over, 0.0)):
        made = baked(shapes.instance(side(low), matrix), shapes.instance(side(high), matrix), extrusion=0.1 * scale)
        ao = made.maps["ao"]
        assert ao.covered.mean() > 0.9  # but for the triangles that are missing at the poles
        assert np.all(ao.values[ao.covered] == wanted)


def test_a_bowl_sees_half_of_the_sky_from_everywhere() -> None:
    """Within a sphere every part of it takes its share of the cosine-weighted sky: a hemisphere, the half."""
    settings = flat_settings(width=48, height=32, rays=1024, margin=0)
    low, high = shapes.instance(bowl(16, "low")), shapes.instance(bowl(384, "high"))
    ao = baked(low, high, settings=settings, extrusion=0.08).maps["ao"]
    values = ao.values[ao.covered]
    assert values.mean() == pytest.approx(0.5, abs=2e-3)
    assert np.abs(values - 0.5).max() < 0.03  # of 1024 rays a texel; nothing at the joints of the low mesh


def test_what_the_high_mesh_has_shows_on_the_low_one() -> None:
    """A trench as deep as half of its width, across a plane: on its floor's middle line the cosine-weighted sky between
    its edges is sin 45 degrees; the low mesh has none of it."""
    low = shapes.instance(shapes.plane(1.0, name="low"))
    floor = shapes.quad((-0.25, -200, -0.25), (0.5, 0, 0), (0, 400, 0), name="floor")
    left = shapes.quad((-0.25, -200, 0), (0, 0, -0.25), (0, 400, 0), name="left")
    right = shapes.quad((0.25, -200, -0.25), (0, 0, 0.25), (0, 400, 0), name="right")
    banks = [shapes.quad((x, -200, 0), (20, 0, 0), (0, 400, 0), name=f"bank {x}") for x in (-20.25, 0.25)]
    highs = [shapes.instance(each) for each in (floor, left, right, *banks)]
    settings = flat_settings(width=65, height=65, rays=1024, margin=0)
    made = baked(low, *highs, settings=settings, extrusion=0.3)
    ao = made.maps["ao"].values
    assert ao[:, 32].mean() == pytest.approx(np.sqrt(0.5), abs=3e-3)
    assert np.all(ao[:, :20] == 1.0) and np.all(ao[:, -20:] == 1.0)
    assert made.surface.interior == 0.0


def test_a_ray_goes_through_the_backs_of_faces() -> None:
    """It starts within another part of the high mesh, or behind a lid, and finds the face that looks at it."""
    low, floor = shapes.instance(shapes.plane(1.0, name="low")), shapes.instance(shapes.plane(1.0, name="floor"))
    lid = shapes.instance(shapes.plane(1.0, 0.05, name="lid", up=-1.0))
    made = baked(low, floor, lid, extrusion=0.1)
    assert made.maps["ao"].covered.all()
    assert made.maps["ao"].mean < 0.1  # under the lid
    facing = shapes.instance(shapes.plane(1.0, 0.05, name="facing"))
    assert baked(low, floor, facing, extrusion=0.1).maps["ao"].mean == 1.0  # upon it


def test_a_point_on_an_edge_keeps_off_it() -> None:
    """Every texel's middle lies on the line where floor and wall meet: it sees half of the sky, not what is behind."""
    low = shapes.instance(shapes.quad((-1, -1, 0), (2, 0, 0), (0, 2, 0), name="low"))
    floor = shapes.quad((0, -200, 0), (200, 0, 0), (0, 400, 0), name="floor")
    wall = shapes.quad((0, -200, 0), (0, 400, 0), (0, 0, 200), name="wall")
    corner = shapes.joined([floor, wall], "corner")
    settings = flat_settings(width=1, height=8, rays=4096, margin=0)
    for turned in (False, True):
        matrix = shapes.matrix(turned=turned)
        made = baked(replace(low, matrix=matrix), shapes.instance(corner, matrix), settings=settings, extrusion=0.1)
        values = made.maps["ao"].values[made.maps["ao"].covered]
        assert len(values)  # rounding may take a ray past the edge
        np.testing.assert_allclose(values, 0.5, atol=0.03)


def test_texels_that_see_nothing_are_told_and_filled() -> None:
    low = shapes.instance(shapes.plane(1.0, name="low"))
    half = shapes.instance(shapes.quad((-1, -1, 0.01), (1, 0, 0), (0, 2, 0), name="half"))
    made = baked(low, half, settings=flat_settings(width=48, height=32, rays=64, margin=64))
    ao = made.maps["ao"]
    assert ao.covered[:, :24].all() and not ao.covered[:, 24:].any()
    assert np.all(ao.values == 1.0)
    assert [line for line in made.warnings if line.startswith("low: 50 % of its texels see no high mesh")]


def test_a_cage_says_where_to_look() -> None:
    """The extrusion is too short for this one; blown up by hand it is not."""
    low = shapes.instance(shapes.plane(1.0, name="low"))
    high = shapes.instance(shapes.plane(2.0, 0.4, name="high"))
    with pytest.raises(InputError, match="none of its texels sees a high mesh"):
        baked(low, high)
    cage = shapes.instance(low.mesh, shapes.matrix((0, 0, 0.5)), "cage")
    assert baked(low, high, cage=cage).maps["ao"].mean == 1.0
    with pytest.raises(InputError, match="low: ball has other faces"):
        baked(low, high, cage=shapes.instance(shapes.sphere(segments=8, name="ball")))


def test_a_cage_may_be_cut_along_other_diagonals() -> None:
    """As Blender cuts faces that are not flat; but a corner must be of the same vertex."""
    corners = np.array([(0, 1, 2), (0, 2, 3)], dtype=np.int32)
    low = replace(shapes.plane(1.0, name="low"), corners=corners)
    assert np.array_equal(low.triangles, corners)
    high, up = shapes.instance(shapes.plane(2.0, 0.4, name="high")), shapes.matrix((0, 0, 0.5))
    other = np.array([(0, 1, 3), (1, 2, 3)], dtype=np.int32)
    cage = replace(low, triangles=other, corners=other, uv=None)
    assert baked(shapes.instance(low), high, cage=shapes.instance(cage, up, "cage")).maps["ao"].mean == 1.0
    with pytest.raises(InputError, match="low: cage has other faces"):
        baked(shapes.instance(low), high, cage=shapes.instance(replace(cage, corners=other[::-1]), up, "cage"))


def test_the_extrusion_follows_the_size() -> None:
    ball = shapes.sphere(segments=16)
    small, large = (extrusion_of(shapes.instance(ball, shapes.matrix(scale=scale))) for scale in (1.0, 50.0))
    assert large == pytest.approx(50.0 * small)
    assert small == pytest.approx(AUTOMATIC * np.sqrt(12.0), rel=1e-2)


def test_parts_of_the_high_mesh_within_one_another_are_no_other_meshes() -> None:
    """A ball half sunk into another of the same mesh lies inside nothing else; in a mesh of its own it would."""
    low = shapes.instance(shapes.sphere(segments=32, name="low"))
    ball, sunk = shapes.sphere(segments=64, smooth=False), shapes.sphere((0.9, 0, 0), 0.5, 64, smooth=False)
    one = shapes.instance(shapes.joined([ball, sunk], "one"))
    assert baked(low, one, extrusion=0.1).surface.interior == 0.0
    around = shapes.instance(shapes.sphere(radius=3.0, segments=32, name="around"))
    assert baked(low, one, extrusion=0.1, others=[around]).surface.interior == 1.0


def test_alone_is_with_its_own_high_meshes() -> None:
    """Two pairs side by side, the one's high mesh a lid over both: alone, it is over its own low one only."""
    lows = [shapes.instance(shapes.plane(1.0, name=f"low {i}")) for i in range(2)]
    floors = [shapes.instance(shapes.plane(1.0, name=f"floor {i}")) for i in range(2)]
    lid = shapes.instance(shapes.plane(50.0, 0.5, name="lid", up=-1.0))
    highs = {"low 0": HighPoly([floors[0], lid]), "low 1": HighPoly([floors[1]])}
    for shared, wanted in ((True, [0.1, 0.1]), (False, [0.1, 1.0])):
        private = () if shared else ("floor 0", "floor 1", "lid")
        scene = Scene(lows, [*floors, lid], private=private, highs=highs)
        means = [each.maps["ao"].mean for each in bake(scene, SETTINGS)]
        assert all((mean < 0.1) == (want < 1.0) for mean, want in zip(means, wanted, strict=True)), means
        assert wanted[1] < 1.0 or means[1] == 1.0


def test_parts_at_a_time_change_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    low, high = (shapes.instance(shapes.sphere(segments=n, name=str(n))) for n in (12, 64))
    floor = shapes.instance(shapes.plane(9.0, -1.0, name="floor"))
    whole = baked(low, high, others=[floor]).maps["ao"].values
    monkeypatch.setattr(module, "_AT_A_TIME", 100)
    np.testing.assert_array_equal(baked(low, high, others=[floor]).maps["ao"].values, whole)


def test_to_an_error_with_the_filter() -> None:
    """Texels of no size are filtered as the low mesh's own would be: the error that is told is the one that is made."""
    low, high = shapes.instance(bowl(16, "low")), shapes.instance(bowl(384, "high"))
    settings = flat_settings(width=256, height=256, error=1 / 255, margin=0)
    ao = baked(low, high, settings=settings, extrusion=0.08).maps["ao"]
    true = float(np.sqrt(np.mean((ao.values[ao.covered].astype(np.float64) - 0.5) ** 2)))
    assert true < 1.25 * ao.error + 1e-3  # the tessellation of the bowl is in it, too
    assert ao.error <= 1.05 / 255 and ao.rays < 64 * ao.covered.sum()


def test_without_faces_there_is_nothing_to_bake_from() -> None:
    low, empty = shapes.instance(shapes.plane(1.0, name="low")), shapes.plane(1.0, name="empty")
    nothing = shapes.instance(replace(empty, triangles=empty.triangles[:0], uv=empty.uv[:0]))
    with pytest.raises(InputError, match="low: what it is baked from has no faces"):
        baked(low, nothing)


@pytest.mark.parametrize("under", [np.eye(4), shapes.SKEW @ np.diag([-1.0, 1.0, 1.0, 1.0])], ids=["level", "leaning"])
def test_a_high_mesh_may_be_much_wider_than_the_low_one(under: np.ndarray) -> None:
    """A patch of floor baked from a floor a million times as wide, beside a wall that stands on that: to a half of a
    ray what it is by a floor ten times as wide."""

    def baked(half: float) -> np.ndarray:
        floor = shapes.quad((-half, -1.2 * half, 2e-4), (2 * half, 0, 0), (0, 2 * half, 0), name="floor")
        wall = shapes.quad((0, -1, 0.01), (0, 2, 0), (0, 0, 2), name="wall")
        highs = [shapes.instance(each, under) for each in (floor, wall)]
        low = shapes.instance(shapes.plane(), under, "low")
        scene = Scene([low], highs, highs={"low": HighPoly(highs, extrusion=0.05)})
        (made,) = bake(scene, flat_settings(width=16, height=16, margin=0, rays=64))
        assert not made.warnings
        return made.maps["ao"].values

    assert np.abs(baked(1e6) - baked(10.0)).max() <= 0.5 / 64

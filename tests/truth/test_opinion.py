"""The kernel against another tracer, with other points and directions; that tracer against every triangle in turn."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest
from numpy.typing import ArrayLike, NDArray
from occlusion_bake.core.rays import occluders
from occlusion_bake.core.rays.map_spec import AO, MapSpec, reflection
from occlusion_bake.core.scene.scene import Camera, Instance, Mesh, Scene
from occlusion_bake.core.texels.rasterize import rasterize
from occlusion_bake.tests.oracles import second_opinion
from occlusion_bake.tests.oracles.second_opinion import Agreement, Estimate, Texels, Tracer, ask

# By chance exceeded with p = 1e-5: Student's t of 16 seeds, and a mean of squares over some 200 texels, which leans.
BIAS_BOUND, EXCESS_BOUND = 6.5, 6.0
SIZE, TEXELS = 256, 192
TILT = np.array([[1.0, 0.3, 0.0], [0.0, -0.8, 0.4], [0.2, 0.0, 1.1]])  # shears, and mirrors
CAMERA = Camera((1.0, -3.0, 2.5), (-0.2, 0.7, -0.6))


def hills(cells: int = 10) -> Mesh:
    """Rolling ground over [-1, 1]² with smooth normals, so coarse that they lean far from the triangles' own."""
    along = np.linspace(-1.0, 1.0, cells + 1)
    x, y = (each.ravel() for each in np.meshgrid(along, along))
    vertices = np.column_stack([x, y, 0.25 * np.sin(4 * x) * np.cos(5 * y)])
    slope = np.column_stack([-np.cos(4 * x) * np.cos(5 * y), 1.25 * np.sin(4 * x) * np.sin(5 * y), np.ones_like(x)])
    a = (np.arange(cells, dtype=np.int64)[:, np.newaxis] * (cells + 1) + np.arange(cells, dtype=np.int64)).ravel()
    b, c, d = a + 1, a + cells + 2, a + cells + 1
    triangles = np.concatenate([np.column_stack([a, b, c]), np.column_stack([a, c, d])])
    uv = np.column_stack([x, y]) / 2 + 0.5
    normals = slope / np.linalg.norm(slope, axis=1, keepdims=True)
    return mesh_of("hills", vertices, triangles, uv[triangles], normals[triangles])


def gem() -> Mesh:
    """An octahedron of radius 1 shaded like a ball, each face a chart."""
    corners = np.array([(x, y, z) for x in (1, -1) for y in (1, -1) for z in (1, -1)])
    axes = np.eye(3)[np.newaxis] * corners[:, :, np.newaxis]  # a face has the three corners of its octant
    mirrored = corners.prod(axis=1) < 0
    axes[mirrored] = axes[mirrored][:, [0, 2, 1]]
    chart = np.array([(0.1, 0.1), (0.9, 0.1), (0.1, 0.9)]) * (0.25, 0.5)
    cells = np.array([(0.25 * column, 0.5 * row) for row in range(2) for column in range(4)])
    return mesh_of(
        "gem", axes.reshape(-1, 3), np.arange(24, dtype=np.int64).reshape(8, 3), cells[:, np.newaxis] + chart, axes
    )


def mesh_of(name: str, vertices: ArrayLike, triangles: ArrayLike, uv: ArrayLike, normals: ArrayLike) -> Mesh:
    floats = [np.ascontiguousarray(each, dtype=np.float32) for each in (vertices, uv, normals)]
    return Mesh(name, floats[0], np.ascontiguousarray(triangles, dtype=np.int32), floats[1], floats[2])


def put(mesh: Mesh, name: str, at: Sequence[float], size: float, turn: NDArray[np.float64] = TILT) -> Instance:
    matrix = np.eye(4)
    matrix[:3, :3] = size * turn
    matrix[:3, 3] = at
    return Instance(name, mesh, matrix)


@pytest.fixture(scope="module")
def valley() -> Scene:
    """Hills with gems over them, some mirrored, none upright."""
    stone = gem()
    ground = put(hills(), "hills", (0, 0, 0), 1.0, np.eye(3))
    gems = [put(stone, "near", (0.3, 0.1, 0.45), 0.2), put(stone, "far", (-0.4, 0.3, 0.5), 0.25, -TILT)]
    return Scene([ground, gems[0]], [ground, *gems], CAMERA)


def answers(scene: Scene, target: Instance, estimators: Sequence[MapSpec], distance: float = np.inf) -> list[Agreement]:
    assert target.mesh.uv is not None
    owner = rasterize(target.name, target.mesh.uv, SIZE, SIZE).owner
    return list(ask(scene, target, owner, estimators, count=TEXELS, distance=distance))


def assert_agree(given: list[Agreement]) -> None:
    for answer in given:
        bias, excess = answer.sigmas
        assert answer.texels > TEXELS // 4
        assert answer.facing == 0
        assert answer.bias_error < 1e-3, "too few rays to tell"
        assert abs(bias) < BIAS_BOUND, answer
        assert abs(excess) < EXCESS_BOUND, answer


def test_smooth_ground_under_mirrored_things(valley: Scene) -> None:
    assert_agree(answers(valley, valley.targets[0], [AO, reflection(10.0), reflection(100.0)]))


def test_reflected_from_the_camera(valley: Scene) -> None:
    maps = [reflection(10.0, from_camera=True), reflection(100.0, from_camera=True)]
    assert_agree(answers(valley, valley.targets[0], maps))


def test_a_mirrored_target_with_a_limit_far_from_the_origin(valley: Scene) -> None:
    """The gem is closed, coarse and smooth: rays above its shading horizon and below its faces meet its inside."""
    away = np.array([1e5, -3e4, 2e4])
    there = {each.name: Instance(each.name, each.mesh, shifted(each.matrix, away)) for each in valley.occluders}
    camera = Camera((0.0, 0.0, 0.0), (0.3, 0.2, -0.9), orthographic=True)
    scene = Scene([there["near"]], list(there.values()), camera)
    assert_agree(answers(scene, there["near"], [AO, reflection(10.0, from_camera=True)], distance=0.4))


def shifted(matrix: NDArray[np.float64], away: NDArray[np.float64]) -> NDArray[np.float64]:
    moved = matrix.copy()
    moved[:3, 3] += away
    return moved


def test_instances_of_one_tree(valley: Scene, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(occluders, "MOST_COPIED", 0)
    assert_agree(answers(valley, valley.targets[0], [AO]))


def test_a_slightly_other_lobe_is_noticed(valley: Scene, monkeypatch: pytest.MonkeyPatch) -> None:
    """The bounds mean something: a tenth more in the exponent breaks them."""
    original, other = second_opinion.estimate, MapSpec("other", 1.1)

    def estimate(tracer: Tracer, texels: Texels, _: MapSpec, rng: np.random.Generator, **how: Any) -> Estimate:
        return original(tracer, texels, other, rng, **how)

    monkeypatch.setattr(second_opinion, "estimate", estimate)
    (answer,) = answers(valley, valley.targets[0], [AO])
    assert abs(answer.sigmas[0]) > BIAS_BOUND


@pytest.mark.parametrize("size", [1e-4, 1.0, 1e4])
def test_the_other_tracer_misses_no_triangle(size: float) -> None:
    """By itself libigl takes triangles for edge-on by an absolute bound, and small ones are not hit."""
    rng = np.random.default_rng(3)
    stone = gem()
    spots = size * rng.uniform(-1, 1, (60, 3))
    things = [put(stone, f"gem {i}", spot, 0.15 * size) for i, spot in enumerate(spots)]
    tracer = Tracer(things, np.zeros(3))
    origins, directions = size * rng.uniform(-1, 1, (4000, 3)), rng.normal(size=(4000, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    for distance in (np.inf, 0.5 * size):
        expected = ~hit_by_any(tracer.vertices[tracer.triangles], origins, directions, distance)
        assert 0.1 < expected.mean() < 0.9
        assert np.array_equal(tracer.visible(origins, directions, distance), expected)


def hit_by_any(
    corners: NDArray[np.float64], origins: NDArray[np.float64], directions: NDArray[np.float64], distance: float
) -> NDArray[np.bool_]:
    """Every ray against every triangle: (T, 3, 3), (N, 3), (N, 3) → (N,). By signed volumes."""
    hit = np.zeros(len(origins), dtype=np.bool_)
    for a, b, c in corners:
        normal = np.cross(b - a, c - a)
        down = directions @ normal
        along = ((a - origins) @ normal) / np.where(down == 0.0, np.inf, down)
        point = origins + along[:, np.newaxis] * directions
        inside = np.ones(len(origins), dtype=np.bool_)
        for p, q in ((a, b), (b, c), (c, a)):
            inside &= np.cross(q - p, point - p) @ normal >= 0.0
        hit |= inside & (along > 0.0) & (along < distance)
    return hit

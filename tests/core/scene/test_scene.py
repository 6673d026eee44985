"""What comes in: placement under any matrix, bounds, and the checks on meshes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from occlusion_bake.core.base.errors import InputError
from occlusion_bake.core.scene.checks import check_target, zero_area
from occlusion_bake.core.scene.scene import Instance, Mesh
from occlusion_bake.core.scene.world_mesh import bounds_of, centre_of, world_mesh
from occlusion_bake.tests.oracles import shapes

ORIGIN = np.zeros(3)
SCALES = [(1, 1, 1), (-1, 1, 1), (-2, -3, 1), (-1, -1, -1), (0.2, 1, 5), (1e-3, 1e-3, 2e-3), (1e3, -2e3, 1e3)]


@pytest.mark.parametrize("turned", [False, True])
@pytest.mark.parametrize("scale", SCALES)
def test_the_winding_stays_outward(scale: tuple[float, ...], turned: bool) -> None:
    target = shapes.instance(shapes.sphere(segments=16), shapes.matrix((5, 6, 7), scale, turned))
    result = world_mesh(target, np.array([5.0, 6.0, 7.0]))
    middle = result.vertices[result.triangles].mean(axis=1)
    assert np.all(np.sum(shapes.face_normals(result) * middle, axis=1) > 0)


@pytest.mark.parametrize("turned", [False, True])
@pytest.mark.parametrize("scale", SCALES)
def test_normals_are_those_of_the_ellipsoid(scale: tuple[float, ...], turned: bool) -> None:
    mesh = shapes.sphere(segments=16)
    matrix = shapes.matrix(scale=scale, turned=turned)
    result = world_mesh(shapes.instance(mesh, matrix), ORIGIN)
    order = [0, 2, 1] if np.prod(scale) < 0 else [0, 1, 2]
    on_sphere = mesh.normals[:, order].astype(np.float64)
    exact = on_sphere @ np.linalg.inv(matrix[:3, :3])  # the gradient of |M⁻¹ p|²
    exact /= np.linalg.norm(exact, axis=-1, keepdims=True)
    assert result.normals is not None
    assert_allclose(result.normals, exact, atol=1e-6)


def test_uvs_and_normals_follow_the_corners_of_a_mirrored_mesh() -> None:
    mesh = shapes.sphere(segments=12)
    plain, mirrored = (
        world_mesh(shapes.instance(mesh, shapes.matrix(scale=s)), ORIGIN) for s in ((1, 1, 1), (-1, 1, 1))
    )
    flip = np.float32([-1, 1, 1])
    for corner, other in enumerate((0, 2, 1)):
        assert_array_equal(
            plain.vertices[plain.triangles[:, corner]] * flip, mirrored.vertices[mirrored.triangles[:, other]]
        )
        assert plain.uv is not None and mirrored.uv is not None
        assert plain.normals is not None and mirrored.normals is not None
        assert_array_equal(plain.uv[:, corner], mirrored.uv[:, other])
        assert_allclose(plain.normals[:, corner] * flip, mirrored.normals[:, other], atol=1e-6)


@pytest.mark.parametrize("offset", [1e3, 1e5, 1e9])
def test_nothing_is_rounded_before_the_origin_is_taken_off(offset: float) -> None:
    mesh = shapes.sphere(segments=16)
    at = np.array([offset, -offset, 0.3])
    result = world_mesh(shapes.instance(mesh, shapes.matrix(at)), at)
    assert_array_equal(result.vertices, mesh.vertices)


def test_a_flattening_matrix_leaves_no_normals() -> None:
    result = world_mesh(shapes.instance(shapes.sphere(segments=8), shapes.matrix(scale=(1, 1, 0))), ORIGIN)
    assert result.normals is None
    assert np.all(result.vertices[:, 2] == 0)


def test_a_zero_normal_stays_zero() -> None:
    mesh = shapes.sphere(segments=8)
    normals = mesh.normals.copy()
    normals[3, 1] = 0
    result = world_mesh(shapes.instance(replace(mesh, normals=normals)), ORIGIN)
    assert result.normals is not None
    assert_array_equal(result.normals[3, 1], 0)
    assert_allclose(np.linalg.norm(result.normals.reshape(-1, 3), axis=1).min(), 0)
    assert np.isfinite(result.normals).all()


def test_bounds_enclose_the_placed_mesh() -> None:
    target = shapes.instance(shapes.room(), shapes.matrix((1e5, 2, 3), (2, -3, 4), turned=True))
    low, high = bounds_of(target)
    vertices = world_mesh(target, ORIGIN).vertices
    assert_allclose([low, high], [vertices.min(axis=0), vertices.max(axis=0)], atol=0.02)  # 1e5 in float32
    assert_allclose(centre_of(target), (1e5, 2, 3), atol=1e-9)


def test_a_mesh_without_vertices_has_empty_bounds() -> None:
    low, high = bounds_of(Instance("empty", empty(), np.eye(4)))
    assert np.all(low > high)


def empty() -> Mesh:
    return Mesh("empty", np.zeros((0, 3), np.float32), np.zeros((0, 3), np.int32), np.zeros((0, 3, 2), np.float32))


def broken(mesh: Mesh, value: float, count: int = 1) -> Mesh:
    """The mesh with non-finite vertices."""
    vertices = mesh.vertices.copy()
    vertices[:count, 1] = value
    return replace(mesh, vertices=vertices)


def refusal_of(target: Instance) -> str:
    with pytest.raises(InputError) as refusal:
        check_target(target)
    message = str(refusal.value)
    assert "\n" not in message
    assert message.startswith(f"{target.name}: ")
    return message


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_non_finite_vertices_are_counted(value: float) -> None:
    message = refusal_of(shapes.instance(broken(shapes.room(), value, 3), name="Cube.007"))
    assert "3 vertices are not finite" in message


@pytest.mark.parametrize("place", [(0, 0), (1, 3)])
def test_a_non_finite_transform_is_refused(place: tuple[int, int]) -> None:
    matrix = np.eye(4)
    matrix[place] = np.nan
    assert "transform is not finite" in refusal_of(shapes.instance(shapes.room(), matrix, "Cube.007"))


def test_a_transform_onto_a_line_is_refused_and_onto_a_plane_is_not() -> None:
    line, plane = np.diag([2.0, 0.0, 0.0, 1.0]), np.diag([2.0, 1.0, 0.0, 1.0])
    assert "no area" in refusal_of(shapes.instance(shapes.room(), line, "Cube.007"))
    check_target(shapes.instance(shapes.room(), plane))


def test_no_faces_are_refused() -> None:
    assert "no faces" in refusal_of(Instance("Cube.007", empty(), np.eye(4)))


def test_no_area_at_all_is_refused() -> None:
    flat = shapes.quad((0, 0, 0), (1, 2, 3), (2, 4, 6))
    assert "zero area" in refusal_of(shapes.instance(flat, name="Cube.007"))


def test_some_triangles_without_area_are_a_warning() -> None:
    whole, flat = shapes.plane(1.0), shapes.quad((0, 0, 0), (1, 0, 0), (3, 0, 0))
    mesh = shapes.joined([whole, flat])
    assert_array_equal(zero_area(mesh), [False, False, True, True])
    assert check_target(shapes.instance(mesh, name="Cube.007")) == [
        "Cube.007: 2 triangles have zero area and are left out"
    ]
    assert check_target(shapes.instance(whole)) == []


def test_small_triangles_have_an_area() -> None:
    tiny = shapes.quad((0, 0, 0), (1e-18, 0, 0), (0, 1e-18, 0))
    assert not zero_area(tiny).any()

"""A chart layout covers the mesh, keeps polygons whole, keeps charts apart, and repeats."""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np
import pytest
from occlusion_bake.core.base.errors import InputError
from occlusion_bake.core.charts.stretch import stretch_of
from occlusion_bake.core.charts.unwrap import unwrap
from occlusion_bake.tests.oracles.charts import round_shapes
from occlusion_bake.tests.oracles.charts.hard_surface import cube
from occlusion_bake.tests.oracles.charts.judge import assert_sound, charts_of
from occlusion_bake.tests.oracles.charts.kinds import PLAIN
from occlusion_bake.tests.oracles.charts.organic import waves
from occlusion_bake.tests.oracles.charts.polygon_mesh import PolygonMesh, net, of_faces


@pytest.mark.parametrize("kind", PLAIN)
def test_layout(kind: str) -> None:
    mesh = PLAIN[kind]
    size, padding = 512, 4
    result = unwrap(kind, *mesh, size=size, padding=padding)
    assert_sound(mesh, result, (size, size), padding)
    assert result.padding == padding
    assert result.utilisation > 0.3


def test_cube_has_six_square_faces() -> None:
    result = unwrap("cube", *cube())
    assert result.count == 6
    assert result.stretch.l2 == pytest.approx(1.0, abs=1e-3)
    assert result.stretch.p95 == pytest.approx(1.0, abs=1e-3)
    assert result.stretch.area == pytest.approx(1.0, abs=1e-3)
    assert result.stretch.angle == pytest.approx(1.0, abs=1e-3)
    sides = np.linalg.norm(np.diff(result.uv[::2], axis=1), axis=2)
    assert np.allclose(sides, sides.mean(), rtol=1e-3)
    assert result.utilisation > 0.55


def test_scale_and_place_do_not_matter() -> None:
    vertices, triangles, polygons = waves(20)
    first = unwrap("waves", vertices, triangles, polygons).uv
    for factor in (2.0**40, 2.0**-40):
        scaled = unwrap("waves", vertices * np.float32(factor), triangles, polygons).uv
        assert np.array_equal(first, scaled)
    ball, faces, quad = cube()
    reference = unwrap("cube", ball, faces, quad).uv
    for factor in (1e-6, 0.3, 7.0, 1e6):
        assert np.allclose(unwrap("cube", ball * np.float32(factor), faces, quad).uv, reference, atol=1e-5)
    assert np.allclose(unwrap("cube", ball + np.float32(2**20), faces, quad).uv, reference, atol=1e-5)


def test_same_mesh_same_uvs() -> None:
    mesh = waves(30, noise=0.1)
    assert np.array_equal(unwrap("waves", *mesh).uv, unwrap("waves", *mesh).uv)


def broken(kind: str) -> PolygonMesh:
    vertices, triangles, polygons = cube()
    if kind == "loose vertices":
        far = np.array([[1e30, 0, 0], [np.nan, 0, 0]], np.float32)
        return PolygonMesh(np.concatenate([vertices, far]), triangles, polygons)
    extra = {
        "repeated corner": [[0, 0, 1]],
        "no area": [[0, 0, 0]],
        "duplicate": [triangles[0]],
        "turned duplicate": [triangles[0][::-1]],
        "fins on one edge": [[0, 1, 8], [0, 1, 9], [1, 0, 10]],
        "collinear": [[0, 8, 1]],
        "tiny": [[0, 8, 9]],
    }[kind]
    more = {
        "fins on one edge": [[-3, -2, 0], [-2, -3, 0], [-3, -3, 0]],
        "collinear": [[-1, -1, 0]],
        "tiny": [[-1, -1 - 1e-6, -1], [-1, -1, -1 - 1e-6]],
    }.get(kind, np.empty((0, 3)))
    vertices = np.concatenate([vertices, more]).astype(np.float32)
    triangles = np.concatenate([triangles, extra]).astype(np.int32)
    return PolygonMesh(
        vertices, triangles, np.append(polygons, 6 + np.arange(len(extra), dtype=np.int64)).astype(np.int32)
    )


@pytest.mark.parametrize(
    "kind",
    [
        "loose vertices",
        "repeated corner",
        "no area",
        "duplicate",
        "turned duplicate",
        "fins on one edge",
        "collinear",
        "tiny",
    ],
)
def test_broken_meshes(kind: str) -> None:
    mesh = broken(kind)
    assert_sound(mesh, unwrap(kind, *mesh, size=256), (256, 256), 4)


def test_faces_that_cover_nothing_change_nothing_of_a_curved_mesh() -> None:
    """Each a polygon of its own, numbered between the others: (0, 0, 1) lies at two places."""
    vertices, triangles, _ = waves(40)
    middle = len(triangles) // 2
    more = np.concatenate([triangles[:middle], [[0, 0, 1], [5, 6, 5], [7, 7, 7]], triangles[middle:]]).astype(np.int32)
    uv = unwrap("waves", vertices, more).uv
    assert np.array_equal(np.delete(uv, [middle, middle + 1, middle + 2], axis=0), unwrap("w", vertices, triangles).uv)


def test_what_lies_flat_is_not_cut_for_others() -> None:
    """A bent sheet of many triangles is one chart, whether there is a ball far away that has to be cut or not."""
    side = np.linspace(0.0, 1.0, 50)
    x, y = np.meshgrid(side, side)
    sheet = np.stack([np.sin(x), y, np.cos(x)], axis=2).reshape(-1, 3)
    at = np.arange(49, dtype=np.int64)[:, None] * 50 + np.arange(49, dtype=np.int64)
    faces = np.stack([at, at + 1, at + 51, at, at + 51, at + 50], axis=2).reshape(-1, 3)
    assert unwrap("sheet", sheet, faces).count == 1
    ball = round_shapes.capsule(16, 8)
    triangles = np.concatenate([faces, ball.triangles + len(sheet)]).astype(np.int32)
    both = PolygonMesh(
        np.concatenate([sheet, 0.03 * ball.vertices + 5.0]).astype(np.float32),
        triangles,
        np.arange(len(triangles), dtype=np.int64),
    )
    charts = unwrap("both", *both)
    assert charts.count > 2
    assert len({*charts_of(both, charts.uv)[: len(faces)].tolist()}) == 1


def test_collinear_corner_of_a_polygon_lies_on_its_edge() -> None:
    """A pentagon with a corner in the middle of a side: the triangle without area lies between its neighbours."""
    vertices = np.array([[0, 0, 0], [1, 0, 0], [2, 0, 0], [2, 2, 0], [0, 2, 0]], np.float32)
    triangles = np.array([[0, 1, 2], [0, 2, 3], [0, 3, 4]], np.int32)
    uv = unwrap("plate", vertices, triangles, np.zeros(3, np.int32)).uv
    assert np.allclose(uv[0, 1], 0.5 * (uv[0, 0] + uv[0, 2]), atol=1e-6)
    assert np.array_equal(uv[0, [0, 2]], uv[1, [0, 1]])


def test_single_triangle_and_long_strip() -> None:
    for length in (1.0, 1000.0):
        mesh = of_faces([[0, 0, 0], [length, 0, 0], [0, 1, 0]], [[0, 1, 2]])
        result = unwrap("triangle", *mesh)
        assert_sound(mesh, result, (1024, 1024), 4)
        assert result.count == 1
        assert result.stretch.l2 == pytest.approx(1.0, abs=1e-3)


def test_stretch_of_areas_and_angles_of_a_known_map() -> None:
    """A unit square drawn twice as wide as high: singular values 1/2 and 1, brought to one area by sqrt 2."""
    square = of_faces([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2, 3]])
    stretch = stretch_of(square.corners, square.corners[..., :2] * [2.0, 1.0])
    assert stretch.area == pytest.approx(1.0)
    assert stretch.angle == pytest.approx((2.0 + 0.5) / 2)


def one_line(caught: pytest.ExceptionInfo[InputError], name: str) -> str:
    message = str(caught.value)
    assert message.startswith(name + ": ")
    assert "\n" not in message
    return message


@pytest.mark.parametrize("value", [0.0, np.nan, np.inf])
def test_no_surface(value: float) -> None:
    vertices, triangles, polygons = cube()
    with pytest.raises(InputError) as caught:
        unwrap("Flat", vertices * np.float32(value), triangles, polygons)
    one_line(caught, "Flat")


def test_a_vertex_that_flew_away_is_told() -> None:
    vertices, triangles, polygons = cube()
    vertices[6] = 1e17
    with pytest.raises(InputError) as caught:
        unwrap("Blast", vertices, triangles, polygons)
    assert "so far apart" in one_line(caught, "Blast")


def sheet(cells: int = 8) -> PolygonMesh:
    """Flat, its vertices row by row."""
    x, y = np.meshgrid(np.arange(cells + 1.0), np.arange(cells + 1.0))
    return net(np.stack([x, y, 0.0 * x], axis=-1))


def line(*corners: tuple[int, int], cells: int = 8) -> set[tuple[int, int]]:
    """The edges of a sheet along straight lines from corner to corner, each as its two vertices in rising order."""
    edges = set()
    for (x0, y0), (x1, y1) in itertools.pairwise(corners):
        steps = max(abs(x1 - x0), abs(y1 - y0))
        run = [(cells + 1) * (y0 + (y1 - y0) * i // steps) + x0 + (x1 - x0) * i // steps for i in range(steps + 1)]
        edges |= {(min(pair), max(pair)) for pair in itertools.pairwise(run)}
    return edges


def sides_of(mesh: PolygonMesh) -> Any:
    """(T, 3, 2): the vertices of each triangle's edges, in rising order."""
    return np.sort(np.stack([mesh.triangles, mesh.triangles[:, [1, 2, 0]]], axis=2), axis=2)


def parted(mesh: PolygonMesh, uv: Any) -> set[tuple[int, int]]:
    """The edges with two sides whose UVs differ from one side to the other."""
    ends = np.stack([uv, uv[:, [1, 2, 0]]], axis=2)
    turned = (mesh.triangles > mesh.triangles[:, [1, 2, 0]])[..., None, None]
    ends = np.where(turned, ends[:, :, ::-1], ends)
    seen: dict[tuple[int, int], set[bytes]] = {}
    for pair, where in zip(sides_of(mesh).reshape(-1, 2).tolist(), ends.reshape(-1, 4), strict=True):
        seen.setdefault((pair[0], pair[1]), set()).add(where.tobytes())
    return {pair for pair, places in seen.items() if len(places) > 1}


CLOSED = line((2, 2), (6, 2), (6, 5), (2, 5), (2, 2))


@pytest.mark.parametrize(
    ("marked", "borders"),
    [
        pytest.param(CLOSED, CLOSED, id="closed"),
        pytest.param(line((4, 0), (4, 8)), line((4, 0), (4, 8)), id="from border to border"),
        pytest.param(line((2, 2), (6, 2), (6, 5)), set(), id="open"),
        pytest.param(line((4, 0), (4, 6)), set(), id="from the border inwards"),
        pytest.param(CLOSED | line((6, 5), (6, 7)) | line((3, 3), (5, 3)), CLOSED, id="closed, and open ones"),
    ],
)
def test_seams_are_borders_where_they_close_a_chart(marked: Any, borders: Any) -> None:
    mesh = sheet()
    seams = np.array([[tuple(pair) in marked for pair in sides] for sides in sides_of(mesh).tolist()])
    charts = unwrap("sheet", *mesh, size=256, seams=seams)
    assert parted(mesh, charts.uv) == borders
    assert charts.count == (2 if borders else 1)

"""A chart layout covers the mesh, keeps polygons whole, keeps charts apart, and repeats."""

from __future__ import annotations

import importlib
from typing import Any

import numpy as np
import pytest
from occlusion_bake.core import charts
from occlusion_bake.core.charts import Charts, unwrap
from occlusion_bake.core.errors import InputError

pytest.importorskip("xatlas")

Mesh = tuple[Any, Any, Any]


def quads(vertices: Any, corners: Any) -> Mesh:
    """Vertices, triangles and the polygon of each triangle, from quads (Q, 4)."""
    corners = np.asarray(corners)
    triangles = corners[:, [0, 1, 2, 0, 2, 3]].reshape(-1, 3).astype(np.int32)
    polygons = np.repeat(np.arange(len(corners)), 2).astype(np.int32)
    return np.asarray(vertices, np.float32), triangles, polygons


def cube() -> Mesh:
    corners = [[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]
    return quads(corners, [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]])


def waves(cells: int = 24, noise: float = 0.0) -> Mesh:
    """A curved sheet of quads none of which is flat; noise makes it rough."""
    x, y = np.meshgrid(np.linspace(-3, 3, cells + 1), np.linspace(-3, 3, cells + 1), indexing="ij")
    z = np.sin(2 * x) * np.cos(2 * y) + noise * np.random.default_rng(5).standard_normal(x.shape)
    first = (np.arange(cells)[:, None] * (cells + 1) + np.arange(cells)).ravel()
    corners = np.stack([first, first + cells + 1, first + cells + 2, first + 1], axis=1)
    return quads(np.stack([x, y, z], axis=-1).reshape(-1, 3), corners)


def sphere(columns: int = 24, rows: int = 12) -> Mesh:
    """A UV sphere of quads; those at the poles have two corners in one place, so half of each has no area."""
    theta, phi = np.meshgrid(np.linspace(0, np.pi, rows + 1), 2 * np.pi * np.arange(columns) / columns, indexing="ij")
    points = np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], axis=-1)
    points[0], points[-1] = (0, 0, 1), (0, 0, -1)
    row, column = (grid.ravel() for grid in np.indices((rows, columns)))
    right = (column + 1) % columns
    corners = [row * columns + column, (row + 1) * columns + column, (row + 1) * columns + right, row * columns + right]
    return quads(points.reshape(-1, 3), np.stack(corners, axis=1))


def prism(sides: int = 9) -> Mesh:
    """A closed prism: two n-gons as triangle fans, and quads around."""
    angle = 2 * np.pi * np.arange(sides) / sides
    ring = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    vertices = np.concatenate([np.c_[ring, np.zeros(sides)], np.c_[ring, np.ones(sides)]]).astype(np.float32)
    fan = np.stack([np.zeros(sides - 2), np.arange(1, sides - 1), np.arange(2, sides)], axis=1).astype(np.int32)
    here, after = np.arange(sides), (np.arange(sides) + 1) % sides
    _, around, polygons = quads(vertices, np.stack([here, after, after + sides, here + sides], axis=1))
    triangles = np.concatenate([fan[:, ::-1], fan + sides, around])
    return vertices, triangles, np.concatenate([np.repeat([0, 1], sides - 2), polygons + 2]).astype(np.int32)


def uv_area(uv: Any) -> Any:
    p, q = (uv[:, 1] - uv[:, 0]).astype(np.float64), (uv[:, 2] - uv[:, 0]).astype(np.float64)
    return 0.5 * (p[:, 0] * q[:, 1] - p[:, 1] * q[:, 0])


def surface_area(mesh: Mesh) -> Any:
    a, b, c = (mesh[0].astype(np.float64)[mesh[1][:, corner]] for corner in range(3))
    return 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1)


def chart_of(uv: Any) -> Any:
    """(T,) the chart of each triangle, by the edges whose both ends have the same UVs."""
    corner = np.unique(uv.reshape(-1, 2), axis=0, return_inverse=True)[1].reshape(-1, 3)
    edges = np.sort(np.stack([corner, corner[:, [1, 2, 0]]], axis=2), axis=2).reshape(-1, 2)
    edge = np.unique(edges, axis=0, return_inverse=True)[1].reshape(-1, 3)
    label = np.arange(len(uv))
    while True:
        least = np.full(edge.max() + 1, len(uv))
        np.minimum.at(least, edge.ravel(), np.repeat(label, 3))
        lower = least[edge].min(axis=1)
        if (lower == label).all():
            return np.unique(label, return_inverse=True)[1].ravel()
        label = lower


def cover(uv: Any, label: Any, size: int) -> tuple[Any, Any]:
    """Rasterise at texel centres: how many triangles hold each centre in their inside, and the label of one of them."""
    hits, owner = np.zeros((size, size), int), np.full((size, size), -1)
    for points, name in zip(uv.astype(np.float64) * size, label, strict=True):
        (x0, y0), (x1, y1) = np.floor(points.min(axis=0)).astype(int), np.ceil(points.max(axis=0)).astype(int)
        x, y = np.meshgrid(np.arange(x0, x1) + 0.5, np.arange(y0, y1) + 0.5)
        sides = []
        for a, b in zip(points, points[[1, 2, 0]], strict=True):
            length = max(float(np.hypot(*(b - a))), 1e-12)
            sides.append(((b[0] - a[0]) * (y - a[1]) - (b[1] - a[1]) * (x - a[0])) / length)
        inside = np.minimum.reduce(sides) > 1e-3  # texels; a shared edge is in neither triangle
        hits[y0:y1, x0:x1] += inside
        owner[y0:y1, x0:x1][inside] = name
    return hits, owner


def nearest_strangers(owner: Any, reach: int) -> int:
    """The least Chebyshev distance, up to reach + 1, between texels of different charts."""
    for distance in range(1, reach + 1):
        for dy in range(-distance, distance + 1):
            for dx in range(distance + 1):
                height, width = owner.shape
                here = owner[max(0, -dy) : height - max(0, dy), : width - dx]
                there = owner[max(0, dy) : height - max(0, -dy), dx:]
                if ((here >= 0) & (there >= 0) & (here != there)).any():
                    return distance
    return reach + 1


def check(mesh: Mesh, result: Charts) -> None:
    """What holds for every layout."""
    _, triangles, polygons = mesh
    uv = result.uv
    assert uv.shape == (len(triangles), 3, 2)
    assert uv.dtype == np.float32
    assert uv.min() >= 0.0
    assert uv.max() <= 1.0
    assert np.isfinite(uv).all()
    lost = (surface_area(mesh) > 0.0) & (uv_area(uv) <= 0.0)
    assert lost.sum() == result.collapsed
    corner = np.stack([np.broadcast_to(polygons[:, None], triangles.shape), triangles], axis=2).reshape(-1, 2)
    both = np.unique(np.concatenate([corner, uv.reshape(-1, 2)], axis=1), axis=0)
    assert len(both) == len(np.unique(corner, axis=0)), "a polygon's triangles disagree on a corner"


MESHES = {
    "cube": cube(),
    "sphere": sphere(),
    "prism": prism(),
    "waves": waves(),
    "rough": waves(noise=0.2),
}


@pytest.mark.parametrize("kind", MESHES)
def test_layout(kind: str) -> None:
    mesh = MESHES[kind]
    size, padding = 512, 4
    result = unwrap(kind, *mesh, size=size, padding=padding)
    check(mesh, result)
    assert result.collapsed == 0
    assert result.padding == padding
    hits, owner = cover(result.uv, chart_of(result.uv), size)
    assert hits.max() == 1, "triangles overlap"
    assert nearest_strangers(owner, padding) > padding
    assert result.utilisation == pytest.approx(uv_area(result.uv).sum(), rel=1e-6)
    assert result.utilisation == pytest.approx(hits.mean(), rel=0.05)
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


def test_polygons_are_cut_by_the_draft_and_mended(monkeypatch: pytest.MonkeyPatch) -> None:
    """The draft does cut quads of a curved sheet; the layout does not, and has hardly more charts."""
    mesh, cuts, drafts = waves(40), [], []
    drafted = charts._drafted

    def spy(xatlas: Any, surface: Any) -> Any:
        chart, uv = drafted(xatlas, surface)
        cuts.append(int((chart[::2] != chart[1::2]).sum()))
        drafts.append(len(np.unique(chart)))
        return chart, uv

    monkeypatch.setattr(charts, "_drafted", spy)
    result = unwrap("waves", *mesh)
    assert cuts[0] > 20
    check(mesh, result)
    label = chart_of(result.uv)
    assert (label[::2] == label[1::2]).all()
    assert result.count <= drafts[0] + 0.1 * cuts[0]


def test_a_polygon_that_fits_nowhere_becomes_a_chart(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(charts, "_misfits", lambda surface, chart, nodes, moved: moved)
    mesh = waves(20)
    result = unwrap("waves", *mesh, size=512)
    check(mesh, result)
    assert result.collapsed == 0
    hits, _ = cover(result.uv, chart_of(result.uv), 512)
    assert hits.max() == 1
    monkeypatch.undo()
    assert result.count > unwrap("waves", *mesh).count


@pytest.mark.parametrize(
    ("corner", "fits"),
    [((0, 1), True), ((0.3, 0.9), True), ((0.9, 0.1), False), ((0.5, 0.5), False), ((-4, 4), False)],
    ids=["as on the surface", "bent", "mirrored", "flat", "overstretched"],
)
def test_misfits(corner: tuple[float, float], fits: bool) -> None:
    """A square's second triangle moves into the chart of the first; its last corner lies in different places."""
    side = charts.SIDE
    surface = charts._surface("square", *quads([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2, 3]]))
    nodes = charts._Nodes(4)
    nodes.add(np.zeros(4, int), np.arange(4), side * np.array([[0, 0], [1, 0], [1, 1], corner], float))
    found = charts._misfits(surface, np.zeros(2, int), nodes, np.array([False, True]))
    assert found.tolist() == [False, not fits]


def test_overlap_is_found_and_touching_is_not() -> None:
    """Against a lower triangle: one beside it, one across it, one inside it, one in another chart, one apart."""
    lower = [[0, 0], [1, 0], [0, 1]]
    beside, across, inside = (
        [[1, 0], [1, 1], [0, 1]],
        [[0.2, 0.2], [2, 0.2], [2, 2]],
        [[0.1, 0.1], [0.3, 0.1], [0.1, 0.3]],
    )
    apart = [[5, 5], [6, 5], [5, 6]]
    uv = np.array([lower, across, inside, lower, beside, apart], float)
    chart = np.array([0, 0, 0, 1, 2, 0])
    suspects = np.array([False, True, True, True, True, True])
    uv2, chart2 = np.concatenate([uv, [lower]]), np.append(chart, 2)
    found = charts._overlapping(chart2, uv2, np.append(suspects, False), np.ones(7, bool))
    assert found.tolist() == [False, True, True, False, False, False, False]


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


@pytest.mark.parametrize("size", [64, 1000, 2048, 3000])
def test_sizes(size: int) -> None:
    mesh = sphere()
    result = unwrap("sphere", *mesh, size=size)
    check(mesh, result)
    assert result.collapsed == 0
    if size <= 1000:
        _, owner = cover(result.uv, chart_of(result.uv), size)
        assert nearest_strangers(owner, result.padding) > result.padding


def test_too_many_charts_cost_padding_not_faces() -> None:
    """400 loose triangles on 64 texels a side: the padding shrinks, nothing is lost."""
    rng = np.random.default_rng(3)
    corners = rng.random((400, 1, 3)) * 100 + rng.random((400, 3, 3))
    triangles = np.arange(1200).reshape(-1, 3).astype(np.int32)
    mesh = corners.reshape(-1, 3).astype(np.float32), triangles, np.arange(400, dtype=np.int32)
    result = unwrap("confetti", *mesh, size=64, padding=4)
    check(mesh, result)
    assert result.count == 400
    assert result.padding < 4
    assert result.collapsed == 0


def broken(kind: str) -> Mesh:
    vertices, triangles, polygons = cube()
    if kind == "loose vertices":
        return np.concatenate([vertices, [[1e30, 0, 0], [np.nan, 0, 0]]]).astype(np.float32), triangles, polygons
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
    return vertices, triangles, np.append(polygons, 6 + np.arange(len(extra))).astype(np.int32)


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
    result = unwrap(kind, *mesh, size=256)
    check(mesh, result)
    assert result.collapsed == 0
    hits, _ = cover(result.uv, chart_of(result.uv), 256)
    assert hits.max() == 1


def test_collinear_corner_of_a_polygon_lies_on_its_edge() -> None:
    """A pentagon with a corner in the middle of a side: the triangle without area lies between its neighbours."""
    vertices = np.array([[0, 0, 0], [1, 0, 0], [2, 0, 0], [2, 2, 0], [0, 2, 0]], np.float32)
    triangles = np.array([[0, 1, 2], [0, 2, 3], [0, 3, 4]], np.int32)
    uv = unwrap("plate", vertices, triangles, np.zeros(3, np.int32)).uv
    assert np.allclose(uv[0, 1], 0.5 * (uv[0, 0] + uv[0, 2]), atol=1e-6)
    assert np.array_equal(uv[0, [0, 2]], uv[1, [0, 1]])


def test_single_triangle_and_long_strip() -> None:
    for length in (1.0, 1000.0):
        vertices = np.array([[0, 0, 0], [length, 0, 0], [0, 1, 0]], np.float32)
        mesh = vertices, np.array([[0, 1, 2]], np.int32), np.zeros(1, np.int32)
        result = unwrap("triangle", *mesh)
        check(mesh, result)
        assert result.count == 1
        assert result.stretch.l2 == pytest.approx(1.0, abs=1e-3)


def test_stretch_of_a_known_map() -> None:
    """A unit square drawn twice as wide as high: singular values 1/2 and 1, brought to one area by sqrt 2."""
    mesh = quads([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2, 3]])
    surface = charts._surface("square", *mesh)
    uv = mesh[0][:, :2].astype(float)[mesh[1]] * [2.0, 1.0]
    stretch = charts._stretch(surface, uv)
    assert stretch.l2 == pytest.approx(np.sqrt((0.25 + 1.0) / 2 * 2))
    assert stretch.p95 == pytest.approx(stretch.l2)
    assert stretch.area == pytest.approx(1.0)
    assert stretch.angle == pytest.approx((2.0 + 0.5) / 2)


def one_line(caught: pytest.ExceptionInfo[InputError], name: str) -> str:
    message = str(caught.value)
    assert message.startswith(name + ": ")
    assert "\n" not in message
    return message


def test_without_xatlas(monkeypatch: pytest.MonkeyPatch) -> None:
    real = importlib.import_module

    def missing(name: str, package: str | None = None) -> Any:
        if name == "xatlas":
            raise ModuleNotFoundError("No module named 'xatlas'")
        return real(name, package)

    monkeypatch.setattr(importlib, "import_module", missing)
    with pytest.raises(InputError) as caught:
        unwrap("Suzanne", *cube())
    message = one_line(caught, "Suzanne")
    assert "xatlas" in message
    assert "Smart UV Project" in message


@pytest.mark.parametrize("value", [0.0, np.nan, np.inf])
def test_no_surface(value: float) -> None:
    vertices, triangles, polygons = cube()
    with pytest.raises(InputError) as caught:
        unwrap("Flat", vertices * np.float32(value), triangles, polygons)
    one_line(caught, "Flat")

"""Charts of meshes of many kinds, judged by what can be measured of any layout: see tests/oracles/charts."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from occlusion_bake.core.charts.unwrap import unwrap
from occlusion_bake.tests.oracles.charts import loose_pieces, organic, round_shapes
from occlusion_bake.tests.oracles.charts.defects import DEFECTS
from occlusion_bake.tests.oracles.charts.judge import Judgement, assert_sound, judged, surface_areas
from occlusion_bake.tests.oracles.charts.kinds import KINDS, ChartCase
from occlusion_bake.tests.oracles.charts.polygon_mesh import PolygonMesh
from occlusion_bake.tests.oracles.charts.properties import charts_are_sound
from occlusion_bake.tests.oracles.wild_bakes import WildMesh

SMALL = 24
FINE, COARSE = 2048, 64  # sides
ROUND: dict[str, Callable[[int], PolygonMesh]] = {
    "open tube": round_shapes.tube,
    "closed tube": lambda sides: round_shapes.tube(sides, closed=True),
    "tube of rings": lambda sides: round_shapes.tube(sides, 3.0, rows=5),
    "cone": lambda sides: round_shapes.cone(sides, base=False),
    "cone with base": round_shapes.cone,
    "ring": round_shapes.ring,
    "dome": lambda sides: round_shapes.dome(sides, 4),
    "capsule": lambda sides: round_shapes.capsule(sides, 3),
    "torus": lambda sides: round_shapes.torus(sides, 8),
    "spring": lambda sides: round_shapes.spring(sides, turns=1.5, steps=8),
}
HEAD = organic.scan(3, 0)


def charted(mesh: PolygonMesh, size: int = 256, padding: int = 2, most_stretch: float = 1.1) -> Judgement:
    """Of a layout that is sound."""
    charts = unwrap("target", *mesh, size=size, padding=padding)
    found = assert_sound(mesh, charts, (size, size), padding, most_stretch)
    assert found.charts == charts.count
    return found


@pytest.mark.parametrize("kind", KINDS)
def test_every_kind_is_charted_soundly(kind: str) -> None:
    mesh = ChartCase(kind, SMALL, seed=1).build()
    charts = unwrap("target", *mesh, size=256, padding=2)
    found = assert_sound(mesh, charts, (256, 256), 2)
    assert found.charts <= charts.count  # some may be thinner than is seen


@pytest.mark.parametrize("defect", DEFECTS)
@pytest.mark.parametrize("kind", ["scan", "bevelled box", "tube"])
def test_what_is_wrong_with_a_mesh_is_charted_soundly(kind: str, defect: str) -> None:
    charted(ChartCase(kind, 12, 3, defect).build())


@pytest.mark.parametrize("shape", ROUND)
def test_round_things_have_no_more_charts_however_finely_they_are_cut(shape: str) -> None:
    sides = FINE // 4 if shape == "spring" else FINE  # of each of its rings
    fine, coarse = charted(ROUND[shape](sides), 512), charted(ROUND[shape](COARSE), 512)
    # A ring that bends both ways can be cut in many ways, each as good as the others.
    assert fine.charts <= coarse.charts + (2 if shape in ("torus", "spring") else 0)
    assert fine.used > 0.8 * coarse.used


@pytest.mark.parametrize("length", [20.0, 100.0])
def test_a_cable_takes_its_own_area_from_a_head_and_no_more(length: float) -> None:
    """The image that the head alone fills is shared by both; a cable of many strips takes its padding along."""
    size, padding, circumference = 1024, 4, 8 * 2 * 0.01 * np.sin(np.pi / 8)
    mesh = organic.with_cable(HEAD, length)
    alone, _ = texels_of_head(HEAD, size, padding)
    together, used = texels_of_head(mesh, size, padding)
    area = float(surface_areas(HEAD).sum())
    # alone² area = (cable's strip at scale s, its padding beside it) + s² area, for s
    expected = largest_root(area + length * circumference, padding * length, -(alone**2) * area)
    assert together > 0.9 * expected
    assert used > 0.4


def texels_of_head(mesh: PolygonMesh, size: int, padding: int) -> tuple[float, float]:
    """How many texels a unit of length has on the triangles that are the head's; the share of the image used."""
    charts = unwrap("target", *mesh, size=size, padding=padding)
    found = assert_sound(mesh, charts, (size, size), padding)
    head = len(HEAD.triangles)
    along, up = np.moveaxis(np.diff(charts.uv[:head].astype(np.float64), axis=1), 1, 0)
    flat = 0.5 * np.abs(along[:, 0] * up[:, 1] - along[:, 1] * up[:, 0]).sum() * size**2
    return float(np.sqrt(flat / surface_areas(HEAD).sum())), found.used


def largest_root(a: float, b: float, c: float) -> float:
    return float((-b + np.sqrt(b * b - 4.0 * a * c)) / (2.0 * a))


@pytest.mark.parametrize(
    "mesh",
    [
        pytest.param(loose_pieces.loose_quads(200, 0), id="quads"),
        pytest.param(loose_pieces.loose_quads(200, 1, 20.0), id="quads of many sizes"),
        pytest.param(loose_pieces.loose_triangles(200, 2), id="triangles"),
        pytest.param(loose_pieces.leaves(100, 3), id="leaves"),
        pytest.param(loose_pieces.voxels(5, 4), id="voxels"),
        pytest.param(loose_pieces.checkerboard(16), id="checkerboard"),
        pytest.param(loose_pieces.islands_on_one_point(100, 5), id="100 islands on one point"),
    ],
)
def test_loose_pieces_fill_half_the_image(mesh: PolygonMesh) -> None:
    assert charted(mesh, 512).used >= 0.5


def test_arcs_are_cut_until_they_fill_the_image() -> None:
    """A whole turn of a thread is an almost closed ring, empty within."""
    assert charted(round_shapes.thread(48, 8), 512).used >= 0.5


def test_a_rough_surface_is_no_dust() -> None:
    mesh = organic.terrain(60, 0, 4.0)
    found = charted(mesh, 512)
    assert found.charts < len(mesh.triangles) / 15
    assert found.used >= 0.45


def test_a_polygon_that_lies_on_itself_is_parted() -> None:
    """Two turns about a point, in one plane: the second a little wider, for two corners in one place are one."""
    angle = np.linspace(0.0, 4.0 * np.pi, 17)
    rim = (1.0 + 0.02 * angle)[:, None] * np.stack([np.cos(angle), np.sin(angle), 0.0 * angle], axis=1)
    at = np.arange(16, dtype=np.int64)
    triangles = np.stack([0 * at, at + 1, at + 2], axis=1).astype(np.int32)
    vertices = np.concatenate([np.zeros((1, 3)), rim]).astype(np.float32)
    mesh = PolygonMesh(vertices, triangles, np.zeros(16, np.int32))
    found = judged(mesh, unwrap("target", *mesh, size=256, padding=2).uv, (256, 256), 2)
    assert (found.overlaps, found.mirrored, found.collapsed) == (0, 0, 0)


@pytest.mark.parametrize("size", [(64, 64), (256, 128)])
def test_a_sheet_flattened_to_a_millionth(size: tuple[int, int]) -> None:
    """Its triangles are needles, most of whose height float32 loses."""
    charts_are_sound(WildMesh("grid", 13, 0, ("needle",)), *size)


@pytest.mark.parametrize("size", [(512, 128), (100, 700), (33, 33)])
@pytest.mark.parametrize("kind", ["character", "part", "foliage"])
def test_images_of_any_shape(kind: str, size: tuple[int, int]) -> None:
    mesh = ChartCase(kind, 16).build()
    assert_sound(mesh, unwrap("target", *mesh, size=size, padding=2), size, 2)


def test_a_character_has_few_charts() -> None:
    """Half of the 55 that xatlas makes at its defaults: a few of head, trunk, limbs and feet each."""
    found = charted(organic.character(40), 512)
    assert found.charts <= 27
    assert found.used >= 0.5

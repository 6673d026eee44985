"""Objects that share an image and have UV maps of their own: used where they can be, else laid side by side."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from occlusion_bake.addon.charts.chart_marks import ATLAS_MAP  # noqa: E402
from occlusion_bake.core.finish.image_file import write_image  # noqa: E402
from occlusion_bake.core.texels.rasterize import rasterize  # noqa: E402
from occlusion_bake.tests.oracles import blender  # noqa: E402
from occlusion_bake.tests.oracles.blender import bake_onto, set_panel  # noqa: E402

SQUARE = blender.UNIT_SQUARE


@pytest.fixture(autouse=True)
def scene(registered: None, empty_scene: None, charts_here: None) -> Any:
    return set_panel(width=64, height=64, quality="RAYS", rays=1, margin=2, threads=2, layout="ATLAS", atlas="Set")


def said() -> str:
    return bpy.context.window_manager.occlusion_bake.lines


def quads(name: str, *boxes: Sequence[float], location: Sequence[float] = (0, 0, 0)) -> Any:
    """Squares of side 1 in a row, each with the box of UVs that is given: left, lower, right, upper."""
    vertices, faces, uv = [], [], []
    for x, (left, low, right, high) in enumerate(boxes):
        faces.append(range(len(vertices), len(vertices) + 4))
        vertices += [(2 * x, 0, 0), (2 * x + 1, 0, 0), (2 * x + 1, 1, 0), (2 * x, 1, 0)]
        uv += [(left, low), (right, low), (right, high), (left, high)]
    return blender.mesh(name, vertices, faces, uv, location)


def layout(obj: Any, name: str = ATLAS_MAP) -> Any:
    """(F, 4, 2) UVs of a mesh of quads."""
    return blender.uv_of(obj.data, name).reshape(-1, 4, 2)


def texels(obj: Any, size: int = 64) -> Any:
    """What an object covers in the atlas."""
    uv = layout(obj)[:, [0, 1, 2, 0, 2, 3]].reshape(-1, 3, 2)
    return rasterize(obj.name, np.ascontiguousarray(uv), size, size).covered


def extent(uv: Any) -> Any:
    return uv.max(axis=(0, 1)) - uv.min(axis=(0, 1))


def test_maps_that_each_fill_the_square_are_laid_side_by_side() -> None:
    """Each as large as its object, in a map of its own; the artist's stay as they are, and active."""
    one, two = blender.plane("One"), blender.plane("Two", location=(5, 0, 0))
    two.scale = (2, 2, 2)
    bpy.context.view_layer.update()
    assert bake_onto("One", "Two") == {"FINISHED"}
    assert "Set: 2 charts, those of their own UV maps side by side, in the UV map" in said()
    masks = [texels(obj) for obj in (one, two)]
    assert not (masks[0] & masks[1]).any()
    np.testing.assert_allclose(extent(layout(two)), 2.0 * extent(layout(one)), rtol=1e-4)
    for obj in (one, two):
        assert [layer.name for layer in obj.data.uv_layers] == ["UVMap", ATLAS_MAP]
        assert obj.data.uv_layers.active.name == "UVMap"
        assert layout(obj, "UVMap").reshape(-1, 2).tolist() == [list(map(float, each)) for each in SQUARE]


def test_they_stay_until_something_is_changed() -> None:
    """The same press, the same charts, whichever map is active; other UVs are laid out anew."""
    objects = [blender.plane("One"), blender.plane("Two", location=(5, 0, 0))]
    bake_onto("One", "Two")
    first = [layout(obj) for obj in objects]
    bake_onto("One", "Two")
    assert "charts" not in said()
    for obj in objects:
        obj.data.uv_layers.active = obj.data.uv_layers[ATLAS_MAP]
    bake_onto("One", "Two")
    assert "charts" not in said()
    assert all((layout(obj) == before).all() for obj, before in zip(objects, first, strict=True))
    objects[0].data.uv_layers["UVMap"].uv[1].vector = (0.5, 0.0)
    bake_onto("One", "Two")
    assert "Set: 2 charts" in said() and not (layout(objects[0]) == first[0]).all()


def test_charts_of_some_lie_beside_new_ones_of_the_others() -> None:
    """One has a map with two charts, the other none: the two are kept as they are, six are made."""
    mapped = quads("Mapped", (0, 0, 0.5, 1.0), (0.5, 0, 1, 0.5))
    bare = blender.bare_cube("Bare", location=(0, 5, 0))
    bake_onto("Mapped", "Bare")
    assert "Set: 8 charts, those of 1 of 2 UV maps beside new ones, in the UV map" in said()
    assert not (texels(mapped) & texels(bare)).any()
    wide, high = sorted(extent(layout(mapped)[:1]))
    np.testing.assert_allclose(high, 2.0 * wide, rtol=1e-4)
    areas = [np.prod(extent(layout(mapped)[i : i + 1])) for i in range(2)]
    np.testing.assert_allclose(areas[0], 2.0 * areas[1], rtol=1e-4)
    faces = np.prod([extent(layout(bare)[i : i + 1]) for i in range(6)], axis=1)
    np.testing.assert_allclose(faces.sum() / 24.0, sum(areas) / 2.0, rtol=1e-3)  # texels a square metre


def test_new_charts_are_new_for_all() -> None:
    mapped = quads("Mapped", (0, 0, 0.5, 1.0), (0.5, 0, 1, 0.5))
    blender.bare_cube("Bare", location=(0, 5, 0))
    set_panel(uv="CHARTS")
    bake_onto("Mapped", "Bare")
    assert "Set: 8 charts in the UV map" in said()
    np.testing.assert_allclose(*sorted(extent(layout(mapped)[:1])), rtol=1e-3)  # as square as the face is


@pytest.mark.parametrize("aside", [0, 1])
def test_stacked_charts_stay_stacked_and_others_do_not_join_them(aside: int) -> None:
    """Of one object, where they are or moved aside by a tile, as several at one place are; of two objects never."""
    stacked = quads("Stacked", (0, 0, 0.9, 0.9), *[(aside, 0, aside + 0.9, 0.9)] * 3)
    other = quads("Other", (0, 0, 0.9, 0.9), location=(0, 5, 0))
    bake_onto("Stacked", "Other")
    assert "Set: 2 charts" in said()
    boxes = [(each.min(axis=0), each.max(axis=0)) for each in layout(stacked)]
    np.testing.assert_allclose(boxes, [boxes[0]] * 4, atol=1e-6)
    assert not (texels(stacked) & texels(other)).any()


def test_tiles_of_objects_come_into_the_one_image() -> None:
    """One lies in the first tile, the other in the second, where an atlas has no texels."""
    objects = [quads("First", (0, 0, 1, 1)), quads("Second", (1, 0, 2, 1), location=(0, 5, 0))]
    bake_onto("First", "Second")
    assert "Set: 2 charts" in said()
    assert not (texels(objects[0]) & texels(objects[1])).any()
    set_panel(udim="STACKED")
    quads("Third", (1.5, 0, 2, 0.5), location=(0, 9, 0))
    with pytest.raises(RuntimeError, match=r"Third: .*outside"):
        bake_onto("Third")


def test_a_map_in_which_nothing_has_an_area_counts_as_none() -> None:
    blender.plane("Flat", uv=[(0.5, 0.5)] * 4)
    blender.plane("Bare", uv=None, location=(0, 0, 3))
    bake_onto("Flat", "Bare")
    assert "Set: 2 charts in the UV map" in said()


def test_objects_of_one_mesh_are_not_parted_by_any_layout() -> None:
    """So they are baked as they are; beside others that can be parted one of them is refused."""
    one = blender.plane("One")
    bpy.context.scene.collection.objects.link(bpy.data.objects.new("Twin", one.data))
    bake_onto("One", "Twin")
    assert "objects overlap one another" in said() and ATLAS_MAP not in one.data.uv_layers
    blender.plane("Two", location=(5, 0, 0))
    bake_onto("One", "Twin", "Two")
    assert "Twin: it shares its mesh with One" in said() and "Set: 2 charts" in said()


def test_maps_that_modifiers_part_are_used_as_they_are() -> None:
    """What counts is the UVs in a render."""
    objects = [quads(name, (0, 0, 0.4, 0.4), location=(3 * x, 0, 0)) for x, name in enumerate(("One", "Two"))]
    warp = objects[1].modifiers.new("Aside", "UV_WARP")
    warp.offset = (0.5, 0.5)
    bake_onto("One", "Two")
    assert "charts" not in said() and "overlap" not in said()
    warp.show_render = False
    bake_onto("One", "Two")
    assert "Set: 2 charts" in said()


def test_of_triangles_that_share_no_vertices_charts_stay_whole() -> None:
    """As files of loose triangles have them: what is in one place, with the same UVs, hangs together."""
    corners = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 0, 0), (1, 1, 0), (0, 1, 0)]
    uv = [(x, y) for x, y, _ in corners]
    loose = blender.mesh("Loose", corners, ((0, 1, 2), (3, 4, 5)), uv)
    blender.plane("Other", location=(0, 5, 0))
    bake_onto("Loose", "Other")
    assert "Set: 2 charts" in said()
    made = blender.triangle_uv(loose.data, ATLAS_MAP)
    np.testing.assert_array_equal(made[0, [0, 2]], made[1, [0, 1]])


def test_the_command_lays_them_out_and_reports_it(bake: Any) -> None:
    blender.plane("One")
    blender.plane("Two", location=(5, 0, 0))
    run = bake("--atlas", "Set")
    assert (run.status, run.err) == (0, "")
    (entry,) = run.report["objects"]
    charts = entry["charts"]
    assert (charts["uv_map"], charts["count"], charts["padding"]) == (ATLAS_MAP, 2, 4)
    assert charts["stretch"] == pytest.approx(1.0) and charts["stretch_p95"] == pytest.approx(1.0)
    assert 0.3 < charts["used"] < 0.6
    assert "scene_charts.blend" in run.files
    left = bake("--atlas", "Set", "--udim", "stacked")
    assert "charts" not in left.report["objects"][0] and left.report["objects"][0]["overlapped"] > 0


def test_a_channel_of_an_image_lays_them_out_too() -> None:
    """Unless UDIM says that maps are taken as they are."""
    one, two = blender.plane("One"), blender.plane("Two", location=(5, 0, 0))
    orm = bpy.data.images.new("ORM", 64, 64, is_data=True)
    set_panel(output="CHANNEL", image=orm, channel="R", udim="STACKED")
    bake_onto("One", "Two")
    assert "objects overlap one another" in said() and ATLAS_MAP not in one.data.uv_layers
    set_panel(udim="AUTO")
    bake_onto("One", "Two")
    assert "Set: 2 charts, those of their own UV maps side by side" in said()
    assert not (texels(one) & texels(two)).any()


def test_the_command_lays_them_out_in_a_channel(bake: Any, tmp_path: Path) -> None:
    orm = tmp_path / "orm.png"
    write_image(orm, np.zeros((64, 64, 3), np.float32), depth=8)
    blender.plane("One")
    blender.plane("Two", location=(5, 0, 0))
    run = bake("--atlas", "Set", "--into", f"{orm}:R")
    assert (run.status, run.err) == (0, "")
    assert run.report["objects"][0]["charts"]["count"] == 2

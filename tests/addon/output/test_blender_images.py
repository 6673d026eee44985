"""Baked maps as Blender images."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from occlusion_bake.addon.output.blender_images import show_picture, store  # noqa: E402
from occlusion_bake.addon.output.ownership import Owner  # noqa: E402
from occlusion_bake.core.finish.baked import Baked, BakedMap, SurfaceReport  # noqa: E402
from occlusion_bake.core.maps.occlusion import OcclusionMap  # noqa: E402
from occlusion_bake.core.rays.map_spec import MapSpec  # noqa: E402
from occlusion_bake.tests.oracles import blender  # noqa: E402
from occlusion_bake.tests.oracles.blender import pixels  # noqa: E402

pytestmark = pytest.mark.usefixtures("empty_scene")


def baked(
    name: str = "Thing", size: tuple[int, int] = (6, 4), maps: tuple[str, ...] = ("ao",), shift: float = 0
) -> Baked:
    """Every texel another value; size: width, height."""
    values = (np.arange(size[0] * size[1], dtype=np.float32).reshape(size[::-1]) + np.float32(shift)) / 64
    covered = np.ones_like(values, dtype=np.bool_)

    def made(map_name: str) -> BakedMap:
        kind = OcclusionMap(MapSpec(map_name, 1.0))
        told = {"error": 0.0, "p99": 0.0, "mean": 0.5, "rays": values.size}
        return BakedMap(values, covered, covered.astype(np.float32), **told, kind=kind)

    return Baked(name, size, SurfaceReport(values.size), values.size, {each: made(each) for each in maps})


def owner(name: str = "Thing") -> Owner:
    """The object of this name, a new one where there is none."""
    return Owner(name, (bpy.data.objects.get(name) or blender.plane(name),))


def stored(result: Baked) -> dict[str, Any]:
    return store(owner(result.name), result)


# Images


def test_an_image_holds_the_values_right_way_up() -> None:
    result = baked()
    image = stored(result)["ao"]
    assert tuple(image.size) == (6, 4) and image.is_float and image.packed_file is not None
    assert image.colorspace_settings.name == "Non-Color" and image.colorspace_settings.is_data
    np.testing.assert_array_equal(pixels(image)[..., :3], np.repeat(result.maps["ao"].values[..., None], 3, axis=2))
    assert (pixels(image)[..., 3] == 1.0).all()


def test_images_are_named_after_object_and_map() -> None:
    images = stored(baked(maps=("ao", "ro_10", "ro_2.5")))
    assert [image.name for image in images.values()] == ["Thing AO", "Thing RO 10", "Thing RO 2.5"]


def test_a_second_bake_goes_into_the_same_image() -> None:
    first = stored(baked())["ao"]
    first.name = "Renamed by the artist"
    again = stored(baked(shift=1.0))["ao"]
    assert again == first and len(bpy.data.images) == 1 and again.name == "Renamed by the artist"
    np.testing.assert_array_equal(pixels(again)[..., 0], baked(shift=1.0).maps["ao"].values)


def test_another_size_scales_the_image() -> None:
    first = stored(baked())["ao"]
    again = stored(baked(size=(3, 8)))["ao"]
    assert again == first and tuple(again.size) == (3, 8)
    np.testing.assert_array_equal(pixels(again)[..., 0], baked(size=(3, 8)).maps["ao"].values)


def test_alpha_survives_saving_in_the_place_of_a_map_without_it(tmp_path: Path) -> None:
    plain = stored(baked())["ao"]
    plain.name = "Renamed by the artist"
    values = np.random.default_rng(5).random((4, 6, 4), dtype=np.float32)
    result = baked()
    result.maps["ao"] = replace(result.maps["ao"], values=values)
    assert stored(result)["ao"].name == "Renamed by the artist"
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "saved.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "saved.blend"))
    np.testing.assert_array_equal(pixels(bpy.data.images["Renamed by the artist"]), values)


def test_an_image_of_the_artists_of_that_name_is_left_alone() -> None:
    theirs = bpy.data.images.new("Thing AO", 2, 2)
    ours = stored(baked())["ao"]
    assert ours != theirs and tuple(theirs.size) == (2, 2)


def test_images_survive_saving(tmp_path: Path) -> None:
    stored(baked())
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "saved.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "saved.blend"))
    (image,) = (each for each in bpy.data.images if each.name == "Thing AO")
    assert image.is_float and image.colorspace_settings.name == "Non-Color"
    np.testing.assert_array_equal(pixels(image)[..., 0], baked().maps["ao"].values)
    assert stored(baked())["ao"] == image


def test_a_picture_takes_the_place_of_the_last(tmp_path: Path) -> None:
    source = bpy.data.images.new("Source", 4, 4)
    source.filepath_raw, source.file_format = str(tmp_path / "picture.png"), "PNG"
    source.save()
    for _ in range(2):
        shown = show_picture("Comparison", str(tmp_path / "picture.png"))
        assert shown.name == "Comparison" and shown.packed_file is not None
    assert len(bpy.data.images) == 2

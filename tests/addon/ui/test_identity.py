"""Which object, which image: whatever they are called, come to be called, or share a name with."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from occlusion_bake.addon.output.ownership import told  # noqa: E402
from occlusion_bake.tests.oracles import blender  # noqa: E402
from occlusion_bake.tests.oracles.blender import pixels, press, select, set_panel  # noqa: E402

FULL, OPEN = 0.0, 1.0


SMALL = {"width": 8, "height": 8, "quality": "RAYS", "rays": 4, "margin": 0, "threads": 1}


@pytest.fixture(autouse=True)
def panel(registered: None, empty_scene: None) -> None:
    set_panel(**SMALL)


@pytest.fixture
def reload(tmp_path: Path) -> Callable[[], None]:
    """Save the file and load it again: nothing is left but what it says."""

    def saved() -> None:
        bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "saved.blend"))
        bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "saved.blend"))

    return saved


@pytest.fixture(params=["session", "saved"])
def later(request: pytest.FixtureRequest, reload: Callable[[], None]) -> Callable[[], None]:
    """What comes between two bakes: nothing, or a Blender without the add-on that saves and loads the file."""

    def elsewhere() -> None:
        import occlusion_bake

        occlusion_bake.unregister()
        try:
            reload()
        finally:
            occlusion_bake.register()

    return elsewhere if request.param == "saved" else lambda: None


def bake(*objects: Any) -> None:
    select(*objects)
    assert press() == {"FINISHED"}


def shut_in(obj: Any) -> None:
    """A lid just above: what it covers gets no light."""
    blender.plane("Lid", location=(obj.location.x, obj.location.y, 1e-4)).scale = (9.0, 9.0, 1.0)


def mean(image: Any) -> float:
    return float(pixels(image)[..., 0].mean())


def image_of(name: str) -> Any:
    """The image whose panel tells this object's name."""
    (found,) = (image for image in bpy.data.images if "occlusion_bake" in image and told(image) == f"{name}, ao")
    return found


def test_a_renamed_object_keeps_its_image(later: Callable[[], None]) -> None:
    first = blender.plane("Cube")
    bake(first)
    first.name = "Table"
    later()
    second = blender.plane("Cube", location=(40.0, 0.0, 0.0))
    shut_in(second)
    bake(second)
    assert (mean(image_of("Table")), mean(image_of("Cube"))) == (OPEN, FULL)
    shut_in(bpy.data.objects["Table"])
    bake(bpy.data.objects["Table"])
    assert len([image for image in bpy.data.images if "occlusion_bake" in image]) == 2
    assert mean(image_of("Table")) == FULL


@pytest.mark.parametrize("output", ["IMAGE", "CODE", "UDIM"])
def test_a_renamed_object_keeps_its_file(output: str, tmp_path: Path, later: Callable[[], None]) -> None:
    """What is saved by the old name is written beside it, and there again the next time."""
    set_panel(output="SAVED", path=str(tmp_path / "out" / "{object}_{map}"), use_code=output == "CODE")
    uv = [(u + 1.0 * (output == "UDIM"), v) for u, v in blender.UNIT_SQUARE]
    first = blender.plane("Cube", uv)
    bake(first)
    before = {path.name: path.read_bytes() for path in (tmp_path / "out").iterdir()}
    assert before
    first.name = "Table"
    later()
    second = blender.plane("Cube", uv, location=(40.0, 0.0, 0.0))
    shut_in(second)
    for _ in range(2):
        bake(bpy.data.objects["Cube"])
        assert {name: (tmp_path / "out" / name).read_bytes() for name in before} == before
        assert len(list((tmp_path / "out").iterdir())) == 2 * len(before)
    assert (mean(image_of("Table")), mean(image_of("Cube"))) == (OPEN, FULL)


@pytest.mark.parametrize("name", ["Backup", "Thing AO.001"])
def test_a_copy_of_an_image_is_left_alone(name: str, later: Callable[[], None]) -> None:
    bake(blender.plane("Thing"))
    copy = bpy.data.images["Thing AO"].copy()
    copy.name, copy.use_fake_user = name, True
    later()
    shut_in(bpy.data.objects["Thing"])
    bake(bpy.data.objects["Thing"])
    assert (mean("Thing AO"), mean(name)) == (FULL, OPEN)
    bpy.data.images.remove(bpy.data.images["Thing AO"])
    bake(bpy.data.objects["Thing"])
    assert mean(name) == OPEN


@pytest.mark.parametrize("output", ["PACKED", "SAVED"])
def test_a_copy_of_an_object_gets_an_image_of_its_own(output: str, tmp_path: Path, later: Callable[[], None]) -> None:
    set_panel(output=output, path=str(tmp_path / "{object}_{map}"))
    bake(blender.plane("Thing"))
    copy = bpy.data.objects["Thing"].copy()
    bpy.context.scene.collection.objects.link(copy)
    copy.name, copy.location.x = "Copy", 40.0
    later()
    bake(bpy.data.objects["Thing"])
    shut_in(bpy.data.objects["Copy"])
    bake(bpy.data.objects["Copy"])
    assert (mean("Thing AO"), mean("Copy AO")) == (OPEN, FULL)
    bake(bpy.data.objects["Thing"])  # into its own, again
    assert {image.name for image in bpy.data.images if "occlusion_bake" in image} == {"Thing AO", "Copy AO"}
    files = ["Copy_ao.png", "Thing_ao.png"] if output == "SAVED" else []
    assert sorted(path.name for path in tmp_path.glob("*.png")) == files


@pytest.mark.parametrize("times", [0, 1])
def test_a_backup_keeps_its_image_though_a_copy_has_its_name(times: int, reload: Callable[[], None]) -> None:
    """times: that the file is saved and loaded before the names change; after that it is in any case."""
    bake(blender.plane("Thing"))
    for _ in range(times):
        reload()
    first = bpy.data.objects["Thing"]
    copy = first.copy()
    bpy.context.scene.collection.objects.link(copy)
    first.name, copy.name, copy.location.x = "Backup", "Thing", 40.0
    assert (first.name, copy.name) == ("Backup", "Thing")
    reload()
    shut_in(bpy.data.objects["Thing"])
    bake(bpy.data.objects["Thing"])
    assert (mean(image_of("Thing")), mean(image_of("Backup"))) == (FULL, OPEN)


def test_what_takes_the_place_of_a_removed_object_takes_its_image() -> None:
    bake(blender.plane("Thing"))
    bpy.data.objects.remove(bpy.data.objects["Thing"])
    again = blender.plane("Thing")
    shut_in(again)
    bake(again)
    assert [image.name for image in bpy.data.images if "occlusion_bake" in image] == ["Thing AO"]
    assert mean("Thing AO") == FULL


def test_what_is_linked_has_an_image_of_its_own(tmp_path: Path, later: Callable[[], None]) -> None:
    """Two linked objects and one of the file, all of one name, and one that is called as a linked one is told."""
    for folder in ("a", "b"):
        (tmp_path / folder).mkdir()
        blender.plane("Rock", location=(40.0, 0.0, 0.0) if folder == "a" else (80.0, 0.0, 0.0))
        bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / folder / "library.blend"))
        bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    set_panel(**SMALL)
    for folder in ("a", "b"):
        with bpy.data.libraries.load(str(tmp_path / folder / "library.blend"), link=True) as (_, wanted):
            wanted.objects = ["Rock"]
        bpy.context.scene.collection.objects.link(wanted.objects[0])
    blender.plane("Rock")
    blender.plane("Rock [library.blend]", location=(120.0, 0.0, 0.0))
    bpy.context.view_layer.update()

    def rocks() -> list[Any]:
        return sorted(
            (obj for obj in bpy.context.view_layer.objects if obj.name.startswith("Rock")),
            key=lambda obj: obj.location.x,
        )

    bake(*rocks())
    later()
    for i, rock in enumerate(rocks()):  # one after the other gets its lid
        shut_in(rock)
        bake(rock)
        values = sorted(mean(image) for image in bpy.data.images if "occlusion_bake" in image)
        assert values == sorted([FULL] * (i + 1) + [OPEN] * (3 - i))


def test_an_atlas_is_its_objects_and_no_objects_own_image() -> None:
    """An object called as the atlas, and other sets of objects in an atlas of the same name."""
    one, two, three = (
        blender.plane(name, location=(x, 0, 0)) for name, x in (("Atlas", 0), ("Two", 40), ("Three", 80))
    )
    shut_in(three)

    def means() -> list[float]:
        return [mean(image) for image in bpy.data.images if "occlusion_bake" in image]

    bake(one)
    set_panel(layout="ATLAS")
    bake(one, two)
    bake(three)
    assert means() == [OPEN, OPEN, FULL]
    shut_in(two)
    bake(two)  # what it shared is left to the other
    assert means() == [OPEN, OPEN, FULL, FULL]
    shut_in(one)
    bake(one)
    assert means() == [OPEN, FULL, FULL, FULL]


@pytest.mark.parametrize("saved", [False, True])
def test_baked_again_from_the_same_meshes_under_the_same_occluders(saved: bool, reload: Callable[[], None]) -> None:
    """The high mesh lies in a shadow that a collection's roof throws; all are renamed, and others take their names."""
    low, high, roof = blender.plane("Low"), blender.plane("High", location=(0, 0, 0.05)), blender.plane("Roof")
    roof.location, roof.scale = (0.3, 0.0, 0.6), (1.0, 1.0, 1.0)
    shade = bpy.data.collections.new("Shade")
    shade.objects.link(roof)
    bpy.context.scene.collection.children.link(shade)
    bpy.context.scene.collection.objects.unlink(roof)
    set_panel(source="SELECTED", extrusion=0.2, occluders="COLLECTION", collection=shade, rays=64)
    select(low, high)
    assert press() == {"FINISHED"}
    first = pixels("Low AO").copy()
    assert 0.1 < first[..., 0].mean() < 0.9
    for obj in (low, high, roof):
        obj.name = f"Old {obj.name}"
    if saved:
        reload()
    for name in ("Low", "High", "Roof"):
        blender.plane(name, location=(0.0, 0.0, 1e-3))
    image = bpy.data.images["Low AO"]
    image.pixels.foreach_set(np.zeros(4 * 8 * 8, np.float32))
    with bpy.context.temp_override(edit_image=image):
        assert bpy.ops.occlusion_bake.again() == {"FINISHED"}
    assert np.array_equal(pixels("Low AO"), first)

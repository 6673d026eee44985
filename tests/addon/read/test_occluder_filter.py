"""Who blocks light: the scene, a choice of objects, each object itself, a ground."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from occlusion_bake.addon.read.occluder_filter import OccluderFilter, named  # noqa: E402
from occlusion_bake.core.bake import bake  # noqa: E402
from occlusion_bake.core.base.errors import InputError  # noqa: E402
from occlusion_bake.core.scene.ground_plane import NAME as GROUND  # noqa: E402
from occlusion_bake.core.scene.scene import Scene  # noqa: E402
from occlusion_bake.tests.oracles import blender  # noqa: E402
from occlusion_bake.tests.oracles.settings import flat_settings  # noqa: E402

pytestmark = pytest.mark.usefixtures("empty_scene")


def read(targets: tuple[str, ...], occluding: OccluderFilter) -> Scene:
    return blender.read(targets, occluding=occluding)[0]


def means(*targets: str, occluding: OccluderFilter) -> dict[str, float]:
    """The mean AO of each."""
    settings = flat_settings(width=64, height=64, rays=64)
    return {baked.name: baked.maps["ao"].mean for baked in bake(read(targets, occluding), settings)}


def occluders(*targets: str, occluding: OccluderFilter) -> set[str]:
    return {each.belongs_to for each in read(targets, occluding).occluders}


def two_floors() -> None:
    """A floor under a roof, and a wall beside both."""
    blender.plane("Floor")
    blender.plane("Roof", location=(0, 0, 0.5))
    blender.wall("Wall")


def test_by_default_all_that_renders() -> None:
    two_floors()
    blender.plane("Hidden", location=(0, 0, 0.2)).hide_render = True
    assert occluders("Floor", occluding=OccluderFilter()) == {"Floor", "Roof", "Wall"}


def test_chosen_objects_and_the_target_itself() -> None:
    two_floors()
    assert occluders("Floor", occluding=named(["Wall"])) == {"Floor", "Wall"}
    assert (
        means("Floor", occluding=named(["Wall"]))["Floor"] > means("Floor", occluding=OccluderFilter())["Floor"] + 0.2
    )


def test_each_object_itself_alone() -> None:
    two_floors()
    assert means("Floor", "Roof", occluding=named(["self"])) == {"Floor": 1.0, "Roof": 1.0}
    assert means("Floor", "Roof", occluding=OccluderFilter())["Floor"] < 0.6


def test_an_object_alone_is_still_hidden_by_what_it_instances() -> None:
    """Faces of the floor carry copies of a child, as leaves on a tree: they are its own."""
    floor = blender.plane("Floor")
    leaf = blender.plane("Leaf", location=(0, 0, 0.25))
    leaf.parent = floor
    floor.instance_type = "FACES"
    floor.show_instancer_for_render = True
    blender.plane("Roof", location=(0, 0, 0.5))
    assert occluders("Floor", occluding=named(["self"])) == {"Floor"}
    assert means("Floor", occluding=named(["self"]))["Floor"] < 0.9


def test_a_collection_with_those_in_it() -> None:
    two_floors()
    outer, inner = bpy.data.collections.new("Outer"), bpy.data.collections.new("Inner")
    bpy.context.scene.collection.children.link(outer)
    outer.children.link(inner)
    inner.objects.link(bpy.data.objects["Roof"])
    assert occluders("Floor", occluding=named(["Outer"])) == {"Floor", "Roof"}


def test_words_of_the_command() -> None:
    """`scene` and `self` are words whatever the file holds; where a name is an object's and a collection's, it is said
    which."""
    two_floors()
    blender.plane("scene")
    roof = bpy.data.collections.new("Roof")
    roof.objects.link(bpy.data.objects["Wall"])
    wall, roof, scene = (ref.uid for ref in blender.refs("Wall", "Roof", "scene"))
    assert named(["scene"]) == OccluderFilter() and named(["self"]) == OccluderFilter(alone=True)
    assert named(["object:scene", "Wall"]).objects == {scene, wall}
    assert named(["object:Roof"]).objects == {roof} and named(["collection:Roof"]).objects == {wall}
    for words, said in (
        (["Door"], "Door: no object or collection"),
        (["collection:Wall"], "collection:Wall: no object or collection"),
        (["Roof"], "Roof: an object and a collection have this name; give object:Roof or collection:Roof"),
        (["scene", "Wall"], "scene: it stands alone; an object of this name is object:scene"),
    ):
        with pytest.raises(InputError, match=said):
            named(words)


def test_a_ground_darkens_sides_by_half_and_what_lies_on_it_wholly() -> None:
    """A vertical wall sees the ground over half of its cosine-weighted sky; a face on the ground sees it alone."""
    wall = blender.wall("Wall", y=(-1.0, 1.0))
    wall.data.uv_layers.new(name="UVMap").uv.foreach_set("vector", np.float32((0, 0, 1, 0, 1, 1, 0, 1)))
    assert means("Wall", occluding=OccluderFilter(ground=True))["Wall"] == pytest.approx(0.5, abs=0.01)
    below = blender.plane("Below", location=(0, 0, 0))
    below.rotation_euler.x = np.pi
    bpy.context.view_layer.update()
    assert means("Below", occluding=named(["self"], ground=True))["Below"] < 1e-3
    assert GROUND in occluders("Below", occluding=named(["self"], ground=True))


def test_the_command_takes_them(bake: Any) -> None:
    two_floors()
    assert bake("--objects", "Floor", "--occluders", "self", "--ground").report["occluders"] == ["Floor", GROUND]
    assert bake("--objects", "Floor", "--occluders", "Roof").report["occluders"] == ["Floor", "Roof"]
    assert "Door: no object" in bake("--objects", "Floor", "--occluders", "Door", report=False).complaint


@pytest.mark.parametrize("words", [["self"], ["Roof"], ["Wall"]])
def test_cycles_agrees_on_who_occludes(bake: Any, words: list[str]) -> None:
    two_floors()
    ground = ["--ground"] if words == ["self"] else []
    run = bake("--objects", "Floor", "--occluders", *words, *ground, "--compare-cycles", "64", "--rays", "64")
    cycles = run.report["objects"][0]["cycles"]
    assert abs(cycles["bias"]) < 0.005 and cycles["rmse"] < 0.06
    assert all(obj.visible_shadow for obj in bpy.data.objects) and GROUND not in bpy.data.objects

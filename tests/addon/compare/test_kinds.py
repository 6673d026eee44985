"""Whatever Cycles can bake is compared, each kind of bake within the noise of both."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import pytest

bpy = pytest.importorskip("bpy")

from occlusion_bake.addon.cli.command import blender_command  # noqa: E402
from occlusion_bake.addon.compare import steps  # noqa: E402
from occlusion_bake.addon.compare.steps import compare_here, compare_in_child  # noqa: E402
from occlusion_bake.addon.job.bake_job import BakeJob, Layout  # noqa: E402
from occlusion_bake.addon.job.runner import run  # noqa: E402
from occlusion_bake.addon.read.high_low_pairs import paired_with  # noqa: E402
from occlusion_bake.addon.read.occluder_filter import OccluderFilter  # noqa: E402
from occlusion_bake.core.base.errors import InputError  # noqa: E402
from occlusion_bake.core.charts.udim import Udim  # noqa: E402
from occlusion_bake.core.maps.occlusion import AMBIENT, OcclusionMap  # noqa: E402
from occlusion_bake.core.progress import Progress  # noqa: E402
from occlusion_bake.core.rays.map_spec import reflection  # noqa: E402
from occlusion_bake.tests.oracles import blender  # noqa: E402
from occlusion_bake.tests.oracles.settings import flat_settings  # noqa: E402

pytestmark = pytest.mark.usefixtures("empty_scene")

# With 256 rays here and 64 samples in Cycles the mean of 32 x 32 texels is known to 0.0022 at most, that of a cube's
# corners to 0.012, and the difference at a texel to 0.07.
TEXELS, CORNERS, ONE_TEXEL = 0.01, 0.05, 0.07
SETTINGS = flat_settings(width=32, height=32, rays=256, threads=2, margin=0)
SQUARE = ((0, 0), (1, 0), (1, 1), (0, 1))


def compared(job: BakeJob, samples: int = 64) -> Any:
    """What is reported."""
    reports: list[Any] = []
    progress = Progress(len(job.objects))
    run(compare_here(bpy.context, job, samples, progress, lambda _, report: reports.append(report)), progress)
    return reports[0]


def job_of(*names: str, **more: Any) -> BakeJob:
    return BakeJob(blender.refs(*names), SETTINGS, **more)


def from_highs(low: str, *highs: str, cage: str | None = None, extrusion: float | None = None, **more: Any) -> BakeJob:
    ref, *meshes = blender.refs(low, *highs)
    pairing = paired_with(ref, meshes, blender.refs(cage)[0] if cage else None, extrusion)
    return job_of(low, highs=pairing.highs, occluding=OccluderFilter(excluded=pairing.excluded), **more)


def low_and_highs() -> None:
    """A low square, stretched, turned and mirrored with all about it: over a gable of two high slopes that cut it, a
    high block on one of them, a wall, and a cage that leans."""
    blender.plane("Low")
    slopes = ((-1, -1, -0.2), (0, -1, 0.3), (1, -1, -0.2), (1, 1, -0.2), (0, 1, 0.3), (-1, 1, -0.2))
    blender.mesh("High", slopes, ((0, 1, 4, 5), (1, 2, 3, 4)))
    blender.cube("Block", size=0.4, location=(0.5, 0.2, 0.2))
    blender.wall()
    cage = blender.plane("Cage", location=(0.1, 0.0, 0.6))
    cage.scale = (1.2, 0.9, 1.0)
    cage.rotation_euler = (0.1, 0.0, 0.0)
    parent = bpy.data.objects.new("Parent", None)
    bpy.context.scene.collection.objects.link(parent)
    for name in ("Low", "High", "Block", "Wall", "Cage"):
        bpy.data.objects[name].parent = parent
    parent.scale, parent.rotation_euler, parent.location = (2.0, 0.5, -1.5), (0.4, 0.7, 0.2), (30.0, -10.0, 4.0)
    bpy.context.view_layer.update()


def with_extrusion() -> BakeJob:
    low_and_highs()
    return from_highs("Low", "High", "Block", extrusion=0.8)


def with_cage() -> BakeJob:
    low_and_highs()
    return from_highs("Low", "High", "Block", cage="Cage")


def floors(columns: float) -> list[str]:
    """Two floors at walls of their own, with UVs side by side, so many columns of the unit square apart."""
    for number in (0, 1):
        uv = [(0.5 * u + columns * number, v) for u, v in SQUARE]
        blender.plane(f"Floor {number}", uv, (5.0 * number, 0.0, 0.0))
        blender.wall(f"Wall {number}", x=5.0 * number + 1.0 - 0.5 * number)
    return ["Floor 0", "Floor 1"]


def atlas() -> BakeJob:
    return job_of(*floors(0.5), layout=Layout("Sheet"))


def overlapping_atlas() -> BakeJob:
    return job_of(*floors(0.25), layout=Layout("Sheet", Udim.STACKED))  # as its maps are


def batch() -> BakeJob:
    return job_of(*floors(0.5))


def batch_of_their_own() -> BakeJob:
    """Each alone on the ground."""
    for x in (0.0, 1.2):
        blender.cube(f"Cube {x}", size=1.0, location=(x, 0.0, 0.0))
    return job_of("Cube 0.0", "Cube 1.2", occluding=OccluderFilter(alone=True, ground=True))


def batch_with_chosen_occluders() -> BakeJob:
    """Neither blocks the other's light."""
    for x in (0.0, 1.2):
        blender.cube(f"Cube {x}", size=1.0, location=(x, 0.0, 0.0))
    wall = blender.wall(x=-0.6, y=(-2.0, 2.0))
    return job_of("Cube 0.0", "Cube 1.2", occluding=OccluderFilter(frozenset({wall.session_uid})))


def udim() -> BakeJob:
    """One square in tile 1002, its other half in tile 1021; without one in the first."""
    corners = ((-1, -1, 0), (0, -1, 0), (1, -1, 0), (1, 1, 0), (0, 1, 0), (-1, 1, 0))
    uv = [(u + 1, v) for u, v in SQUARE] + [(u, v + 2) for u, v in SQUARE]
    blender.mesh("Two", corners, ((0, 1, 4, 5), (1, 2, 3, 4)), uv)
    blender.wall()
    return job_of("Two")


def corners() -> BakeJob:
    """Of a cube over a floor, whose split corners differ; stretched and mirrored."""
    box = blender.cube("Box", size=1.0, location=(0.0, 0.0, 0.6))
    box.scale = (1.0, 2.0, -1.0)
    blender.plane("Floor")
    return job_of("Box", layout=Layout(corners=True))


def smooth_corners() -> BakeJob:
    job = corners()
    bpy.data.objects["Box"].data.polygons.foreach_set("use_smooth", [True] * 6)
    return job


KINDS: dict[
    Callable[[], BakeJob], tuple[list[str], float]
] = {  # what images there are, and how far the bias may be off
    with_extrusion: (["Low"], TEXELS),
    with_cage: (["Low"], TEXELS),
    atlas: (["Sheet"], TEXELS),
    overlapping_atlas: (["Sheet"], TEXELS),
    batch: (["Floor 0", "Floor 1"], TEXELS),
    batch_of_their_own: (["Cube 0.0", "Cube 1.2"], TEXELS),
    batch_with_chosen_occluders: (["Cube 0.0", "Cube 1.2"], TEXELS),
    udim: (["Two 1002", "Two 1021"], TEXELS),
    corners: (["Box"], CORNERS),
    smooth_corners: (["Box"], CORNERS),
}


@pytest.mark.parametrize("kind", KINDS)
def test_both_agree_and_nothing_is_left_in_the_file(kind: Callable[[], BakeJob]) -> None:
    job = kind()
    before = inventory()
    report = compared(job)
    assert inventory() == before
    names, bound = KINDS[kind]
    assert [f"{entry['name']} {entry.get('tile', '')}".strip() for entry in report["objects"]] == names
    for entry in report["objects"]:
        cycles = entry["cycles"]
        assert abs(cycles["bias"]) < bound and cycles["rmse"] < ONE_TEXEL
        assert 0.02 < entry["mean"]["ao"] < 0.98  # there is something to compare
    assert report["total"].get("images", 1) == len(names)


def inventory() -> list[Any]:
    """What a comparison might leave behind."""
    kinds = ("objects", "meshes", "images", "materials", "worlds")
    data = [(kind, item.name, item.users) for kind in kinds for item in getattr(bpy.data, kind)]
    return [*data, [(obj.visible_shadow, len(obj.modifiers), obj.data) for obj in bpy.data.objects]]


def test_texels_that_two_objects_of_an_atlas_share_are_left_out() -> None:
    entry = compared(overlapping_atlas(), samples=1)["objects"][0]
    assert entry["texels"] == 24 * 32 and entry["cycles"]["texels"] == 16 * 32  # 8 columns are of both


def test_an_atlas_of_nothing_but_shared_texels_is_refused() -> None:
    """A line says why, and it is not the image's size."""
    blender.plane("One")
    blender.plane("Two", location=(3.0, 0.0, 0.0))
    with pytest.raises(InputError, match=r"^Sheet: its objects lie on one another in the UV map; .*new charts$"):
        compared(job_of("One", "Two", layout=Layout("Sheet", Udim.STACKED)), samples=1)


def test_between_hard_edges_rays_start_as_far_up_as_ours() -> None:
    """A straight cage would be 1 / √3 as high there, and below the high mesh."""
    blender.cube("Low")
    blender.plane("High", location=(0.0, 0.0, 1.5))
    (entry,) = compared(from_highs("Low", "High", extrusion=0.6), samples=1)["objects"]
    assert entry["cycles"]["texels"] > 0.8 * entry["texels"] > 0
    assert any(line.startswith("Rays: ") for line in entry["cycles"]["reasons"])


def test_a_high_meshs_normal_map_is_told_and_no_setting_promised() -> None:
    """Cycles follows it; what is baked from high meshes has their own normals, whatever the settings."""
    blender.plane("Low")
    paint = blender.material()
    bump = paint.node_tree.nodes.new("ShaderNodeNormalMap")
    bump.inputs["Color"].default_value = (0.8, 0.5, 0.8, 1.0)
    paint.node_tree.links.new(bump.outputs[0], blender.principled(paint).inputs["Normal"])
    blender.plane("High").data.materials.append(paint)
    job = from_highs("Low", "High", extrusion=0.2)
    job = replace(job, settings=replace(job.settings, normal_maps=True))
    (entry,) = compared(job, samples=1)["objects"]
    (told,) = [line for line in entry["cycles"]["reasons"] if line.startswith("Normals: Cycles follows")]
    assert told.endswith("a high mesh's material; here high meshes have their own")


def test_total_is_that_of_all_texels() -> None:
    report = compared(batch(), samples=4)
    cycles, total = [entry["cycles"] for entry in report["objects"]], report["total"]
    count = sum(each["texels"] for each in cycles)
    assert (total["images"], total["texels"], total["samples"]) == (2, count, 4)
    assert total["bias"] == pytest.approx(sum(each["texels"] * each["bias"] for each in cycles) / count)
    assert total["rmse"] ** 2 == pytest.approx(sum(each["texels"] * each["rmse"] ** 2 for each in cycles) / count)
    assert total["seconds"] == pytest.approx(sum(each["seconds"] for each in cycles))


@pytest.mark.parametrize("kind", [with_cage, atlas, udim, corners])
def test_a_child_blender_compares_the_same(monkeypatch: pytest.MonkeyPatch, kind: Callable[[], BakeJob]) -> None:
    job = kind()
    job = replace(job, settings=replace(SETTINGS, maps=(AMBIENT, OcclusionMap(reflection(10)))))
    here, reports, commands = compared(job, samples=4), list[Any](), list[Any]()
    monkeypatch.setattr(steps, "_wait_for", lambda command, *_: commands.append(command))
    waiting = compare_in_child(bpy.context, job, 4, Progress(), lambda _, report: reports.append(report))
    next(waiting)()
    (command,) = commands
    bpy.ops.wm.open_mainfile(filepath=command[2])
    assert blender_command(command[command.index("--values") :]) == 0
    assert next(waiting, "done") == "done"
    (there,) = reports
    assert [figures(entry) for entry in there["objects"]] == [figures(entry) for entry in here["objects"]]
    assert there["lines"] == here["lines"] == ["Cycles has no bake of RO 10; AO is compared"]


def figures(entry: Any) -> list[Any]:
    cycles = entry["cycles"]
    return [entry["name"], entry.get("tile"), entry["mean"], cycles["texels"], cycles["bias"], cycles["rmse"]]

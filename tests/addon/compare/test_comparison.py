"""Our AO beside Cycles'."""

from __future__ import annotations

import re
import sys
from pathlib import Path
from typing import Any

import pytest

bpy = pytest.importorskip("bpy")

from occlusion_bake.addon.charts.chart_request import CHARTS  # noqa: E402
from occlusion_bake.addon.compare.comparison import Compared, compare_with_cycles  # noqa: E402
from occlusion_bake.addon.compare.steps import _wait_for  # noqa: E402
from occlusion_bake.addon.job.bake_job import BakeJob, bake_steps  # noqa: E402
from occlusion_bake.addon.job.outcome import Outcome  # noqa: E402
from occlusion_bake.addon.job.runner import run  # noqa: E402
from occlusion_bake.core.base.errors import InputError  # noqa: E402
from occlusion_bake.core.finish.image_file import read_image  # noqa: E402
from occlusion_bake.core.progress import Progress  # noqa: E402
from occlusion_bake.tests.oracles import blender  # noqa: E402
from occlusion_bake.tests.oracles.settings import flat_settings  # noqa: E402

pytestmark = pytest.mark.usefixtures("empty_scene")


def compared(name: str, path: Path, samples: int = 64, uv: str | None = None, **settings: Any) -> Any:
    """The entry of one object."""
    chosen = flat_settings(**{"width": 32, "height": 32, "rays": 256, "threads": 2, **settings})
    job, outcome = BakeJob(blender.refs(name), chosen, uv), Outcome()
    entries: list[Any] = []

    def deliver(result: Any) -> None:
        entries.append(compare_with_cycles(bpy.context, Compared.of(result, job, outcome), samples, path))

    progress = Progress()
    run(bake_steps(bpy.context, job, progress, outcome, deliver), progress)
    return entries[0]


@pytest.mark.parametrize("distance", [None, 0.7])
def test_both_bake_the_same(tmp_path: Path, distance: float | None) -> None:
    blender.plane("Floor")
    blender.wall()
    entry = compared("Floor", tmp_path / "picture.png", samples=256, distance=distance)
    assert entry["texels"] == 32 * 32 and entry["texels_of_another_triangle"] < 64  # along the diagonal
    noise = (0.25 / 256 * 2) ** 0.5  # of a texel that is half open, both bakes together
    assert entry["rmse"] < noise and abs(entry["bias"]) < 0.005


def test_charts_are_compared_on_the_charts(tmp_path: Path) -> None:
    obj = blender.cube()
    obj.data.uv_layers.active.uv.foreach_set("vector", [0.5] * 48)  # on the artist's map there is nothing to see
    blender.plane("Ceiling", location=(0.0, 0.0, 1.5))
    entry = compared("Cube", tmp_path / "picture.png", uv=CHARTS)
    assert entry["texels"] > 300 and abs(entry["bias"]) < 0.02 and entry["rmse"] < 0.1


def test_the_picture_is_three_panels(tmp_path: Path) -> None:
    blender.plane("Floor")
    entry = compared("Floor", tmp_path / "picture.png", samples=1)
    assert entry["picture"] == str(tmp_path / "picture.png")
    height, width, channels = read_image(entry["picture"])[0].shape
    assert channels == 3 and width > 2 * height


def other_owners(path: Path, column: float) -> int:
    """Of two squares whose UVs meet at this column of 32."""
    corners = ((0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (2, 0, 0), (2, 1, 0))
    x = column / 32
    blender.mesh(
        "Two", corners, ((0, 1, 2, 3), (1, 4, 5, 2)), ((0, 0), (x, 0), (x, 1), (0, 1), (x, 0), (1, 0), (1, 1), (x, 1))
    )
    return int(compared("Two", path, samples=1)["texels_of_another_triangle"])


def test_texels_that_cycles_gives_to_another_triangle_are_counted(tmp_path: Path) -> None:
    """The left square covers more than half of column 16, but not the point (16.501, …) that Cycles looks at."""
    agreed = other_owners(tmp_path / "picture.png", column=16.45)
    bpy.data.objects.remove(bpy.data.objects["Two"])
    differing = other_owners(tmp_path / "picture.png", column=16.5005)
    assert differing - agreed == pytest.approx(32, abs=4)  # but for the ends, where the diagonals are


def test_the_comparisons_own_blender_leaves_nothing_in_the_temporary_folder(tmp_path: Path) -> None:
    where = "import tempfile; print('occlusion_bake: ' + tempfile.gettempdir()); raise SystemExit(2)"
    with pytest.raises(InputError, match=f": {re.escape(str(tmp_path))}$"):
        _wait_for([sys.executable, "-c", where], tmp_path / "log", Progress())


def test_no_texel_in_common(tmp_path: Path) -> None:
    blender.plane("Speck", uv=((0.01, 0.01), (0.012, 0.01), (0.012, 0.012), (0.01, 0.012)))
    with pytest.raises(InputError, match=r"^Speck: no texel is covered .*; compare with a larger image$"):
        compared("Speck", tmp_path / "picture.png", samples=1)
    assert not list(tmp_path.iterdir())


def test_what_is_known_to_differ_is_told(tmp_path: Path) -> None:
    floor = blender.plane("Floor")
    glass = bpy.data.materials.new("Glass")
    if bpy.app.version < (5, 0):
        glass.use_nodes = True
    clouds = glass.node_tree.nodes.new("ShaderNodeTexNoise")
    glass.node_tree.links.new(clouds.outputs[0], glass.node_tree.nodes["Principled BSDF"].inputs["Alpha"])
    wall = blender.wall()
    wall.data.materials.append(glass)
    floor.data.materials.append(bpy.data.materials.new("Wood"))
    lines = compared("Floor", tmp_path / "picture.png", samples=4)["reasons"]
    assert any(line.startswith("Glass: ") and "as if opaque" in line for line in lines)
    assert not any(line.startswith("Transparency: ") for line in lines)
    wood = bpy.data.materials["Wood"]
    if bpy.app.version < (5, 0):
        wood.use_nodes = True
    wood.node_tree.nodes["Principled BSDF"].inputs["Alpha"].default_value = 0.5
    own = compared("Floor", tmp_path / "picture.png", samples=4)["reasons"]
    assert any(line.startswith("Transparency: ") for line in own)
    (noise,) = (float(line.split()[-1]) for line in lines if line.startswith("Noise: "))
    entry = compared("Floor", tmp_path / "picture.png", samples=4, distance=1e-3)  # nothing within reach but the edge
    assert 0.0 < noise <= 0.25 and entry["reasons"][0].startswith("Noise: ")
    assert any(line.startswith("Footprint: ") for line in lines) == (bpy.app.version < (5, 0))


def test_normals_at_flat_faces_are_told_where_cycles_has_others(tmp_path: Path) -> None:
    box = blender.cube("Box")
    for smooth, told in (([False] * 6, False), ([True] * 3 + [False] * 3, bpy.app.version < (5, 0))):
        box.data.polygons.foreach_set("use_smooth", smooth)
        lines = compared("Box", tmp_path / "picture.png", samples=1)["reasons"]
        assert any(line.startswith("Normals: ") for line in lines) == told

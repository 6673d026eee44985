"""The scenes of the bench as artists have them: what they say of themselves, and what makes each of them hard."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

bpy = pytest.importorskip("bpy")

from mathutils import Vector  # noqa: E402
from mathutils.bvhtree import BVHTree  # noqa: E402
from occlusion_bake.core.texels.high_to_low import AUTOMATIC  # noqa: E402
from occlusion_bake.samples import bench_scenes, character, decimated, figure, housing, props, shapes, stage  # noqa: E402
from occlusion_bake.samples.bench_scenes import SCENES, empty_scene, names, of_one_surface  # noqa: E402
from occlusion_bake.tests.oracles import blender  # noqa: E402

Doubles = NDArray[np.float64]
STONE = "Stone"


def scan_and_low(scene: Any) -> stage.Sample:
    """As `igea_low` is made, from a stone."""
    stone = stage.add(scene, STONE, shapes.pebble(STONE, 3, detail=6), at=(1.0, 2.0, 3.0), turn=(10, 20, 30))
    return decimated.build(scene, "stone_low", stone)


BUILDS: dict[str, Callable[[Any], stage.Sample]] = {
    "stone_low": scan_and_low,
    **{name: SCENES[name] for name in ("character", "bevel_low", "props")},
}


def built(name: str) -> stage.Sample:
    sample = BUILDS[name](empty_scene())
    bpy.context.view_layer.update()
    return sample


def evaluated(name: str) -> Any:
    mesh = bpy.data.objects[name].evaluated_get(bpy.context.evaluated_depsgraph_get()).to_mesh()
    mesh.calc_loop_triangles()
    return mesh


def vertices(name: str) -> Doubles:
    """(V, 3) in the world."""
    matrix = np.array(bpy.data.objects[name].matrix_world)
    points = np.array([vertex.co for vertex in evaluated(name).vertices])
    placed: Doubles = points @ matrix[:3, :3].T + matrix[:3, 3]
    return placed


def tree(name: str) -> BVHTree:
    """Of its triangles in the world."""
    triangles = [face.vertices[:] for face in evaluated(name).loop_triangles]
    return BVHTree.FromPolygons(vertices(name).tolist(), triangles, all_triangles=True)


def distances(points: Doubles, to: BVHTree) -> Doubles:
    return np.array([to.find_nearest(Vector(point))[3] for point in points])


@pytest.mark.parametrize("name", BUILDS)
def test_targets_render_and_what_they_are_baked_from_does(name: str) -> None:
    sample = built(name)
    for each in (*sample.targets, *sample.highs):
        assert bpy.data.objects[each].type == "MESH"
        assert not bpy.data.objects[each].hide_render
    assert not set(sample.targets) & set(sample.highs)


@pytest.mark.parametrize("name", BUILDS)
def test_built_twice_is_built_the_same(name: str) -> None:
    first = {target: vertices(target) for target in built(name).targets}
    second = {target: vertices(target) for target in built(name).targets}
    assert first.keys() == second.keys()
    assert all(np.array_equal(first[each], second[each]) for each in first)


def test_what_the_bench_knows_of_scenes_is_what_they_say() -> None:
    for name in ("character", "bevel_low", "props"):
        sample = built(name)
        assert sample.name == name
        assert bool(sample.highs) == (name in bench_scenes.HIGH_TO_LOW)
        assert bench_scenes.OWN_SIZES.get(name, 1024) == sample.size
        assert (len(sample.targets) > 1) == (name in bench_scenes.MANY)
    assert bench_scenes.OWN_SIZES["igea_low"] == built("stone_low").size


def test_scenes_of_models_are_there_where_the_model_is(tmp_path: Path) -> None:
    assert names(tmp_path) == [*SCENES]
    (tmp_path / bench_scenes.MODELS["igea"]).touch()
    assert names(tmp_path) == [*SCENES, "igea", "igea_low"]
    assert set(names(tmp_path)) - set(of_one_surface(tmp_path)) == {*bench_scenes.HIGH_TO_LOW, *bench_scenes.MANY}


def test_a_scan_whose_file_has_no_normals_is_smooth(tmp_path: Path) -> None:
    stage.add(empty_scene(), STONE, shapes.pebble(STONE, 3))
    bpy.ops.wm.ply_export(filepath=str(tmp_path / bench_scenes.MODELS["igea"]), export_normals=False)
    (target,) = bench_scenes.build("igea", tmp_path).targets
    mesh: Any = bpy.data.objects[target].data
    assert len(mesh.polygons) == 20 * 4**2
    assert all(face.use_smooth for face in mesh.polygons)
    assert bench_scenes.build("igea_low", tmp_path).highs == (target,)
    assert len(evaluated(target).loop_triangles) == 20 * 4**2  # nothing of Decimate is left on it


def test_a_low_mesh_of_a_scan_is_smooth_where_the_scan_is_and_has_2000_triangles_without_uvs() -> None:
    sample = built("stone_low")
    (low,), (high,) = sample.targets, sample.highs
    mesh: Any = bpy.data.objects[low].data
    assert len(evaluated(high).loop_triangles) == 20 * 4**5 > 10 * decimated.TRIANGLES
    assert len(mesh.polygons) == pytest.approx(decimated.TRIANGLES, rel=0.01)
    assert all(len(face.vertices) == 3 and face.use_smooth for face in mesh.polygons)
    assert not mesh.uv_layers
    diagonal = np.linalg.norm(np.ptp(vertices(low), axis=0))
    assert distances(vertices(low), tree(high)).max() < 0.25 * AUTOMATIC * diagonal


def test_the_low_housing_has_uvs_and_hard_edges_and_no_details() -> None:
    sample = built("bevel_low")
    mesh: Any = bpy.data.objects[housing.LOW].data
    triangles = blender.triangle_uv(evaluated(housing.LOW))
    assert sample.targets == (housing.LOW,) and sample.highs == (housing.HIGH,)
    assert triangles.min() >= 0.0 and triangles.max() <= 1.0
    assert len(triangles) < 200 < 20000 < len(evaluated(housing.HIGH).loop_triangles)
    assert all(face.use_smooth for face in mesh.polygons)
    sharp = mesh.attributes["sharp_edge"].data
    assert 0 < sum(each.value for each in sharp) < len(mesh.edges)
    assert [each.type for each in bpy.data.objects[housing.HIGH].modifiers] == ["BEVEL"]


def test_all_details_of_the_housing_are_found_from_the_low_one() -> None:
    """Rays start as far above as they end below. Where the corners' normals part they lean, by 55 degrees at the most:
    towards (1, 1, 1) at the corner of a box; what stands off a face must not be higher than where they start."""
    built("bevel_low")
    low = vertices(housing.LOW)
    reach = AUTOMATIC * float(np.linalg.norm(np.ptp(low, axis=0)))
    off = distances(vertices(housing.HIGH), tree(housing.LOW))
    assert 0.005 < off.max() < reach / np.sqrt(3.0)


def test_the_body_is_one_of_many_triangles_on_the_floor() -> None:
    built("character")
    assert 30_000 <= len(evaluated("Body").loop_triangles) <= 100_000
    points = vertices("Body")
    assert points[:, 2].min() == pytest.approx(figure.SOLE, abs=1e-6)
    assert np.allclose(np.ptp(points, axis=0)[[0, 2]], (0.93, 1.23), atol=0.01)


def test_clothes_are_off_the_skin_and_near_it() -> None:
    built("character")
    body = tree("Body")
    for name, _, gap, _ in character.CLOTHES:
        off = distances(vertices(name)[::7], body)
        assert 0.3 * gap < off.min() < gap
        assert np.median(off) < gap + character.FOLD
        assert not body.overlap(tree(name)), name


def test_the_shirt_hangs_over_the_trousers() -> None:
    built("character")
    shirt, trousers = vertices("Shirt"), vertices("Trousers")
    assert shirt[:, 2].min() < trousers[:, 2].max()
    assert not tree("Shirt").overlap(tree("Trousers"))


def test_eyes_lie_free_in_their_sockets() -> None:
    built("character")
    body = tree("Body")
    for name in ("Left eye", "Right eye"):
        off = distances(vertices(name), body)
        assert 0.0 < off.min() < 2.0 * (figure.SOCKET - figure.EYEBALL)
        assert (off < 2.0 * (figure.SOCKET - figure.EYEBALL)).mean() > 0.3
        assert not body.overlap(tree(name))


def test_props_are_400_of_20_kinds_each_with_uvs() -> None:
    sample = built("props")
    meshes = {bpy.data.objects[name].data for name in sample.targets}
    assert len(sample.targets) == 400
    assert len(meshes) == props.STONES + props.POTS + props.CRATES == 20
    for mesh in meshes:
        assert mesh.users > 1 and mesh.materials
        uv = blender.triangle_uv(mesh)
        assert uv.min() >= 0.0 and uv.max() <= 1.0


def test_props_stand_on_the_ground() -> None:
    for name in built("props").targets[::13]:
        assert vertices(name)[:, 2].min() == pytest.approx(props.CLEAR, abs=1e-6)

"""Every sample scene builds, builds the same twice, and has targets a bake can use."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

bpy = pytest.importorskip("bpy")

import bmesh  # noqa: E402  (comes with bpy)
from mathutils import Vector  # noqa: E402
from mathutils.bvhtree import BVHTree  # noqa: E402
from occlusion_bake.samples import foliage, scenes, thousands  # noqa: E402
from occlusion_bake.samples.stage import Sample  # noqa: E402
from occlusion_bake.tests.oracles import blender  # noqa: E402

Doubles = NDArray[np.float64]
GRID = 1024
LEAST_COVERED = 0.4


@pytest.fixture(params=scenes.SCENES)
def sample(request: pytest.FixtureRequest) -> Sample:
    """Each scene in turn, open in Blender with its subdivision at render level."""
    return _built(request.param)


def _built(name: str) -> Sample:
    made = scenes.build(name)
    for thing in bpy.data.objects:
        for modifier in thing.modifiers:
            if modifier.type == "SUBSURF":
                modifier.levels = modifier.render_levels
    bpy.context.view_layer.update()
    return made


def _evaluated(name: str) -> bpy.types.Mesh:
    return bpy.data.objects[name].evaluated_get(bpy.context.evaluated_depsgraph_get()).to_mesh()


def _uv_triangles(mesh: bpy.types.Mesh) -> Doubles:
    """(T, 3, 2)."""
    return blender.triangle_uv(mesh).astype(np.float64)


def _hits(triangles: Doubles, size: int) -> NDArray[np.int64]:
    """(size, size): in how many triangles each texel centre lies, clear of their edges."""
    corners = triangles * size - 0.5
    low = np.maximum(np.ceil(corners.min(axis=1)).astype(np.int64), 0)
    sides = np.minimum(np.floor(corners.max(axis=1)).astype(np.int64), size - 1) - low + 1
    count = np.zeros((size, size), dtype=np.int64)
    for width, height in np.unique(sides[(sides > 0).all(axis=1)], axis=0):  # most are small, and many of one size
        alike = (sides == (width, height)).all(axis=1)
        x, y = _texels_in(corners[alike], low[alike], width, height)
        np.add.at(count, (y, x), 1)
    return count


def _texels_in(
    corners: Doubles, low: NDArray[np.int64], width: int, height: int
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """The texels, x and y, whose centres lie in triangles, (T, 3, 2), of boxes of one size that begin at (T, 2)."""
    row, column = np.divmod(np.arange(width * height, dtype=np.int64), width)
    x, y = low[:, :1] + column, low[:, 1:] + row
    (ax, ay), (bx, by), (cx, cy) = corners.transpose(1, 2, 0)[..., np.newaxis]
    area = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
    whole = np.where(area == 0.0, np.inf, area)  # one without area holds none
    p = ((bx - x) * (cy - y) - (by - y) * (cx - x)) / whole
    q = ((cx - x) * (ay - y) - (cy - y) * (ax - x)) / whole
    inside = (p > 1e-4) & (q > 1e-4) & (1.0 - p - q > 1e-4)
    return x[inside], y[inside]


def _points_on(mesh: bpy.types.Mesh, count: int) -> Doubles:
    """(count, 3): points inside triangles of a mesh, spread over its area."""
    rng = np.random.default_rng(1)
    area = np.array([triangle.area for triangle in mesh.loop_triangles])
    chosen = rng.choice(len(area), size=count, p=area / area.sum())
    vertices = np.array([vertex.co for vertex in mesh.vertices])
    corners = vertices[[mesh.loop_triangles[int(index)].vertices[:] for index in chosen]]
    return np.einsum("nc,ncx->nx", rng.dirichlet((2.0, 2.0, 2.0), size=count), corners)


def _everything() -> BVHTree:
    """All triangles of the scene's own objects in world space, instances left out."""
    vertices, triangles = [], []
    solid = [thing for thing in bpy.context.scene.objects if thing.type in {"MESH", "CURVE", "FONT"}]
    for name in [thing.name for thing in solid if not thing.hide_render]:
        mesh, start = _evaluated(name), len(vertices)
        matrix = bpy.data.objects[name].matrix_world
        vertices += [matrix @ vertex.co for vertex in mesh.vertices]
        triangles += [[start + corner for corner in face.vertices] for face in mesh.loop_triangles]
    return BVHTree.FromPolygons(vertices, triangles, all_triangles=True)


def _tree(name: str) -> BVHTree:
    """One object's triangles in its own space."""
    mesh = _evaluated(name)
    return BVHTree.FromPolygons([vertex.co for vertex in mesh.vertices], [face.vertices for face in mesh.polygons])


def _volume_if_closed(mesh: bpy.types.Mesh) -> float | None:
    """Signed volume of a mesh whose every edge joins two faces, positive where the faces look outwards."""
    draft = bmesh.new()
    draft.from_mesh(mesh)
    closed = bool(draft.faces) and all(edge.is_manifold for edge in draft.edges)
    volume = draft.calc_volume(signed=True) if closed else None
    draft.free()
    return volume


def _positions() -> dict[str, Doubles]:
    """Every mesh's vertices and UVs and every instance's matrix, by name."""
    found = {f"mesh {mesh.name}": np.array([vertex.co for vertex in mesh.vertices]) for mesh in bpy.data.meshes}
    for mesh in bpy.data.meshes:
        for layer in mesh.uv_layers:
            found[f"uv {mesh.name}"] = np.array([corner.vector for corner in layer.uv])
    placed: dict[str, list[Doubles]] = {}
    for item in bpy.context.evaluated_depsgraph_get().object_instances:
        placed.setdefault(f"object {item.object.name}", []).append(np.array(item.matrix_world))
    return found | {name: np.array(matrices) for name, matrices in placed.items()}


def test_targets_are_meshes_that_render(sample: Sample) -> None:
    assert sample.targets
    assert len(set(sample.targets)) == len(sample.targets)
    for name in sample.targets:
        target = bpy.data.objects[name]
        assert target.type == "MESH"
        assert not target.hide_render
        assert target.data.materials


def test_uvs_lie_inside_and_apart(sample: Sample) -> None:
    for name in sample.targets:
        triangles = _uv_triangles(_evaluated(name))
        assert triangles.min() >= 0.0, name
        assert triangles.max() <= 1.0, name
        hits = _hits(triangles, GRID)
        assert (hits > 1).sum() == 0, name
        assert (hits > 0).mean() > LEAST_COVERED, name


def test_no_face_lacks_area(sample: Sample) -> None:
    for name in sample.targets:
        mesh = _evaluated(name)
        assert min(triangle.area for triangle in mesh.loop_triangles) > 0.0, name


def test_there_is_a_view_and_a_light(sample: Sample) -> None:
    scene = bpy.context.scene
    assert scene.camera is not None
    assert scene.world is not None
    assert not bpy.data.images
    assert sample.description.endswith(".")


@pytest.mark.parametrize("name", scenes.SCENES)
def test_built_twice_is_built_the_same(name: str) -> None:
    _built(name)
    first = _positions()
    _built(name)
    second = _positions()
    assert first.keys() == second.keys()
    for key, values in first.items():
        assert np.array_equal(values, second[key]), key


def test_no_two_surfaces_coincide(sample: Sample) -> None:
    everything = _everything()
    for name in sample.targets:
        matrix = bpy.data.objects[name].matrix_world
        points = [matrix @ Vector(point) for point in _points_on(_evaluated(name), 1000)]
        # Chance alone puts a point this near an edge, where two triangles answer; surfaces that coincide fill patches.
        assert np.mean([len(everything.find_nearest_range(point, 3e-6)) > 1 for point in points]) < 0.004, name


def test_closed_meshes_face_outwards(sample: Sample) -> None:
    assert sample.targets
    for mesh in bpy.data.meshes:
        volume = _volume_if_closed(mesh)
        assert volume is None or volume > 0.0, mesh.name


def test_suzanne_has_63000_triangles() -> None:
    _built("suzanne")
    quads = 468 * 4 + 32 * 3  # after one level; each further level makes four of one
    assert len(_evaluated("Suzanne").loop_triangles) == quads * 4 * 4 * 2


def test_thousands_come_from_nodes_and_from_collections() -> None:
    _built("thousands")
    items = bpy.context.evaluated_depsgraph_get().object_instances
    made = [(item.parent.name, item.matrix_world.determinant() < 0.0) for item in items if item.is_instance]
    by_nodes = [mirrored for parent, mirrored in made if parent == "Pebbles"]
    assert len(by_nodes) == thousands.PEBBLES >= 5000
    assert sum(by_nodes) == thousands.PEBBLES // 10
    assert len(made) - len(by_nodes) == 3 * 6


def test_foliage_has_hundreds_of_open_leaves() -> None:
    _built("foliage")
    mesh = bpy.data.objects["Leaves"].data
    assert foliage.STEMS * foliage.PER_STEM >= 300
    assert len(mesh.vertices) - len(mesh.edges) + len(mesh.polygons) == foliage.STEMS * foliage.PER_STEM  # Euler: discs


def test_nook_has_the_awkward_objects() -> None:
    _built("nook")
    things = bpy.data.objects
    assert things["Right cheek"].matrix_world.determinant() < 0.0
    assert things["Right cheek"].data == things["Left cheek"].data
    assert len(set(things["Pedestal"].scale)) > 1
    assert things["Inscription"].type == "FONT"
    assert things["Person for scale"].hide_render
    assert {slot.material.name for slot in things["Walls"].material_slots} == {"Plaster", "Blue plaster"}


def test_thinwall_has_thin_walls_and_a_card_without_shadow() -> None:
    _built("thinwall")
    assert not bpy.data.objects["Bounce card"].visible_shadow
    assert bpy.data.objects["Cup handle"].type == "CURVE"
    box = _tree("Box")
    inside = Vector((0.0, 0.0, 0.05))
    wall, _, _, near = box.ray_cast(inside, Vector((1.0, 0.0, 0.0)))
    _, _, _, through = box.ray_cast(wall + Vector((1e-4, 0.0, 0.0)), Vector((1.0, 0.0, 0.0)))
    assert near > 0.1
    assert 0.0015 < through + 1e-4 < 0.0025


def test_it_builds_into_a_scene_that_is_not_open() -> None:
    bpy.ops.wm.read_factory_settings(use_empty=True)
    other = bpy.data.scenes.new("Other")
    made = scenes.SCENES["nook"](other)
    assert set(made.targets) <= set(other.objects.keys())
    assert not bpy.context.scene.objects


def test_the_command_writes_files(tmp_path: Path) -> None:
    assert scenes.main(["suzanne", "foliage", "--folder", str(tmp_path / "new")]) == 0
    assert sorted(path.name for path in (tmp_path / "new").iterdir()) == ["foliage.blend", "suzanne.blend"]
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "new" / "suzanne.blend"))
    assert {"Suzanne", "Floor"} <= set(bpy.data.objects.keys())


def test_an_unknown_name_is_refused_before_anything_is_written(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as stop:
        scenes.main(["suzanne", "suzan", "--folder", str(tmp_path)])
    assert stop.value.code == 2
    assert "suzan: no such sample scene" in capsys.readouterr().err
    assert not list(tmp_path.iterdir())

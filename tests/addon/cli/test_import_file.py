"""Files into Blender."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

bpy = pytest.importorskip("bpy")

from occlusion_bake.addon.cli.import_file import load  # noqa: E402
from occlusion_bake.core.base.errors import InputError  # noqa: E402
from occlusion_bake.tests.oracles import blender  # noqa: E402

pytestmark = pytest.mark.usefixtures("empty_scene")

OBJ = """o Roof
v 0 0 0
v 1 0 0
v 1 1 0
v 0 1 0
vt 0 0
vt 1 0
vt 1 1
vt 0 1
f 1/1 2/2 3/3 4/4
"""


def write(folder: Path, kind: str) -> Path:
    """A cube with UVs in a file of this kind."""
    obj = blender.cube("Block")
    obj.select_set(True)
    path = folder / f"model.{kind}"
    exporters = {
        "blend": lambda: bpy.ops.wm.save_as_mainfile(filepath=str(path)),
        "obj": lambda: bpy.ops.wm.obj_export(filepath=str(path)),
        "ply": lambda: bpy.ops.wm.ply_export(filepath=str(path), export_uv=True),
        "stl": lambda: bpy.ops.wm.stl_export(filepath=str(path)),
        "glb": lambda: bpy.ops.export_scene.gltf(filepath=str(path)),
        "gltf": lambda: bpy.ops.export_scene.gltf(filepath=str(path), export_format="GLTF_SEPARATE"),
    }
    exporters[kind]()
    return path


def meshes() -> list[Any]:
    return [obj for obj in bpy.context.view_layer.objects if obj.type == "MESH"]


@pytest.mark.parametrize("kind", ["blend", "obj", "ply", "stl", "glb", "gltf"])
def test_a_cube_comes_back(tmp_path: Path, kind: str) -> None:
    path = write(tmp_path, kind)
    bpy.ops.wm.read_factory_settings()
    load(path)
    (obj,) = meshes()
    assert obj.name in {"Block", "model", "Model"} and len(obj.data.loop_triangles) == 12
    assert len(obj.data.uv_layers) == (0 if kind == "stl" else 1)
    assert tuple(obj.dimensions) == pytest.approx((2.0, 2.0, 2.0))


def test_nothing_of_the_scene_before_remains(tmp_path: Path) -> None:
    blender.plane("Left over")
    path = tmp_path / "roof.OBJ"
    path.write_text(OBJ)
    load(path)
    assert [obj.name for obj in bpy.data.objects] == ["Roof"]
    assert bpy.data.filepath == ""


def test_a_relative_path(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "größe 茶.obj").write_text(OBJ)
    monkeypatch.chdir(tmp_path)
    load(Path("größe 茶.obj"))
    assert [obj.name for obj in meshes()] == ["Roof"]


@pytest.mark.parametrize(
    ("name", "content", "words"),
    [
        ("roof.fbx", OBJ, "unknown kind of file; give .blend"),
        ("roof", OBJ, "unknown kind"),
        ("empty.obj", "", "empty.obj"),
        ("empty.blend", "", "cannot be read"),
        ("empty.glb", "", "cannot be read"),
        ("empty.ply", "", "cannot be read"),
    ],
)
def test_what_cannot_be_read_is_named_in_one_line(tmp_path: Path, name: str, content: str, words: str) -> None:
    path = tmp_path / name
    path.write_text(content)
    with pytest.raises(InputError) as caught:
        load(path)
    line = str(caught.value)
    assert line.startswith(f"{path}: ") and words in line and ";" in line and "\n" not in line


def test_a_missing_file(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"nowhere\.blend: no such file; check the path$"):
        load(tmp_path / "nowhere.blend")

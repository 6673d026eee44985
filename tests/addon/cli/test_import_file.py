"""Files into Blender."""

from __future__ import annotations

import base64
import json
import os
import signal
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
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


def gltf(**changed: Any) -> str:
    """A triangle, with these parts of the document as they are given."""
    content = np.array([0, 0, 0, 1, 0, 0, 0, 1, 0], np.float32).tobytes() + np.array([0, 1, 2, 7], np.uint16).tobytes()
    views = [{"buffer": 0, "byteLength": 36}, {"buffer": 0, "byteOffset": 36, "byteLength": 8}]
    corners = {"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 0]}
    document = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        "buffers": [{"byteLength": 44, "uri": "data:;base64," + base64.b64encode(content).decode()}],
        "bufferViews": views,
        "accessors": [corners, {"bufferView": 1, "componentType": 5123, "count": 3, "type": "SCALAR"}],
    }
    return json.dumps({**document, **changed})


TO_THE_SEVENTH = {"bufferView": 1, "byteOffset": 2, "componentType": 5123, "count": 3, "type": "SCALAR"}


@pytest.mark.parametrize(
    ("content", "cause"),
    [
        (gltf(accessors=[*json.loads(gltf())["accessors"][:1], TO_THE_SEVENTH]), "IndexError: index 7 is out of"),
        (gltf(nodes=[{"children": [0]}]), "RecursionError: "),
        (gltf(scenes=[{"nodes": [5]}]), "KeyError: 5)"),
        (gltf(extensionsRequired=["EXT_other"], extensionsUsed=["EXT_other"]), "Extension EXT_other is not available"),
        ("[" * 100_000, "RecursionError: "),
    ],
    ids=["index", "circle", "node", "extension", "deep"],
)
def test_what_an_importer_in_python_failed_of_is_named(tmp_path: Path, capfd: Any, content: str, cause: str) -> None:
    path = tmp_path / "model.gltf"
    path.write_text(content)
    with pytest.raises(InputError) as caught:
        load(path)
    line = str(caught.value)
    assert line.startswith(f"{path}: cannot be read as .gltf ({cause}") and "\n" not in line and "Traceback" not in line
    assert line.endswith("save it anew, uncompressed") and capfd.readouterr().err == ""


@pytest.mark.skipif(os.name != "posix", reason="sends signals")
@pytest.mark.parametrize("swallowed", [False, True])
def test_a_stop_within_an_importer_is_one(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, swallowed: bool) -> None:
    import io_scene_gltf2

    def interrupted(*_: Any) -> Any:
        with suppress(KeyboardInterrupt if swallowed else ZeroDivisionError):
            os.kill(os.getpid(), signal.SIGTERM)
        return {"FINISHED"}

    (tmp_path / "model.gltf").write_text(gltf())
    monkeypatch.setattr(io_scene_gltf2.ImportGLTF2, "import_gltf2", interrupted)
    with pytest.raises(KeyboardInterrupt):
        load(tmp_path / "model.gltf")


def test_a_missing_file(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"nowhere\.blend: no such file; check the path$"):
        load(tmp_path / "nowhere.blend")

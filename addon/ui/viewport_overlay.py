"""The baked texture on the object in the 3D view, without a material: while it fills in, and when it is done.

Everything of the GPU's is made and drawn within the view's own drawing, where its context is at hand; until then the
arrays wait. What is shown belongs to the window alone, and is nowhere in the file.
"""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from typing import Any

import bpy
import gpu
import numpy as np
from gpu_extras.batch import batch_for_shader

from ...core.base.arrays import Floats
from ...core.charts.udim import part_in_tile
from ...core.finish.baked import Baked
from ...core.scene.scene import Instance
from ..typed import mesh_of, persistent, view_layer_in
from .properties import result_in

MOST_TRIANGLES = 2_000_000  # of an object that is shown: more would hold up the window
_NEARER = 2e-5  # of the depth: our surface is drawn before the view's own, which is the same

_VERTEX = """
void main() {
  place = uv;
  gl_Position = matrix * vec4(pos, 1.0);
  gl_Position.z -= NEARER * gl_Position.w;
}
""".replace("NEARER", f"{_NEARER:.9f}")
_FRAGMENT = """
void main() {
  float visible = texture(image, place).r;
  if (visible < 0.0) discard; // not traced yet
  color = vec4(visible, visible, visible, 1.0);
}
"""

# The stubs do not know what the constructors of these take.
_types: Any = gpu.types


@dataclass(eq=False)
class _Shown:
    """A surface with its image. values: (H, W) float32, None once it is a texture. mark: of the mesh that was baked."""

    target: Instance
    values: Floats | None
    mark: str = ""
    batch: Any = None
    texture: Any = None


class _Overlay:
    """What is drawn: finished bakes by their object's session_uid, and the one that is being made."""

    def __init__(self) -> None:
        self.finished: dict[int, list[_Shown]] = {}
        self.making: tuple[int, _Shown] | None = None
        self._handler: Any = None
        self._shader: Any = None

    def start(self) -> None:
        """Draw from now on."""
        if self._handler is None:
            self._handler = bpy.types.SpaceView3D.draw_handler_add(self._draw, (), "WINDOW", "POST_VIEW")
            bpy.app.handlers.depsgraph_update_post.append(_forget_changed)
            bpy.app.handlers.load_pre.append(_forget_all)

    def stop(self) -> None:
        """Draw no more, and forget everything."""
        self.finished.clear()
        self.making = self._shader = None
        if self._handler is not None:
            bpy.types.SpaceView3D.draw_handler_remove(self._handler, "WINDOW")
            bpy.app.handlers.depsgraph_update_post.remove(_forget_changed)
            bpy.app.handlers.load_pre.remove(_forget_all)
            self._handler = None

    def _draw(self) -> None:
        context = bpy.context
        if not result_in(context).show or not (self.finished or self.making):
            return
        all_shown = dict(self.finished)
        if self.making is not None:
            all_shown[self.making[0]] = [self.making[1]]
        objects = {obj.session_uid: obj for obj in view_layer_in(context).objects}
        region: Any = context.region_data
        view = region.perspective_matrix
        gpu.state.depth_test_set("LESS_EQUAL")
        gpu.state.depth_mask_set(True)
        for uid, shown in all_shown.items():
            obj = objects.get(uid)
            if obj is not None and obj.visible_get() and obj.mode == "OBJECT":
                for each in shown:
                    self._draw_one(each, view @ obj.matrix_world)
        gpu.state.depth_mask_set(False)
        gpu.state.depth_test_set("NONE")

    def _draw_one(self, shown: _Shown, matrix: Any) -> None:
        self._shader = self._shader or _make_shader()
        shown.batch = shown.batch or _make_batch(self._shader, shown.target)
        if shown.values is not None:
            shown.texture, shown.values = _make_texture(shown.values), None
        self._shader.bind()
        self._shader.uniform_float("matrix", matrix)
        self._shader.uniform_sampler("image", shown.texture)
        shown.batch.draw(self._shader)


_overlay = _Overlay()


@persistent
def _forget_changed(scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph) -> None:
    """What was baked of a mesh that is another by now would hide it."""
    updates: Any = depsgraph.updates
    for update in updates:
        obj = update.id.original
        if not update.is_updated_geometry or not isinstance(obj, bpy.types.Object):
            continue
        shown = _overlay.finished.get(obj.session_uid)
        if shown is not None and (obj.mode != "OBJECT" or _mark(obj) != shown[0].mark):
            del _overlay.finished[obj.session_uid]


@persistent
def _forget_all(*_: Any) -> None:
    clear()


def _mark(obj: bpy.types.Object) -> str:
    """Tells whether a mesh, before its modifiers, is the one that was baked."""
    mesh = mesh_of(obj)
    places = np.empty(3 * len(mesh.vertices), dtype=np.float32)
    mesh.vertices.foreach_get("co", places)
    return f"{len(mesh.polygons)} {len(obj.modifiers)} {hashlib.blake2b(places.tobytes()).hexdigest()}"


def show(obj: bpy.types.Object, target: Instance, baked: Baked, *, anew: bool) -> None:
    """Show the first grey map of a finished bake on an object. anew: in the place of an earlier bake; else it is a
    further tile."""
    grey = next((each.values for each in baked.maps.values() if each.is_grey), None)
    if bpy.app.background or len(target.mesh.triangles) > MOST_TRIANGLES or grey is None:
        return
    before = [] if anew else _overlay.finished.get(obj.session_uid, [])
    shown = _Shown(part_in_tile(target, baked.tile), grey, _mark(obj))
    _overlay.finished[obj.session_uid] = [*before, shown]
    _overlay.start()


def show_making(uid: int, target: Instance, values: Floats) -> None:
    """Show how far the map of an object is."""
    if bpy.app.background or len(target.mesh.triangles) > MOST_TRIANGLES:
        return
    making = _overlay.making
    batch = making[1].batch if making is not None and making[1].target is target else None
    _overlay.making = (uid, _Shown(target, values, batch=batch))
    _overlay.start()


def end_making() -> None:
    """Show what was there before, or is finished by now."""
    _overlay.making = None


def clear() -> None:
    """Show nothing."""
    _overlay.stop()


def _make_shader() -> Any:
    passed = _types.GPUStageInterfaceInfo("occlusion_bake")
    passed.smooth("VEC2", "place")
    info = gpu.types.GPUShaderCreateInfo()
    info.push_constant("MAT4", "matrix")
    info.sampler(0, "FLOAT_2D", "image")
    info.vertex_in(0, "VEC3", "pos")
    info.vertex_in(1, "VEC2", "uv")
    info.vertex_out(passed)
    info.fragment_out(0, "VEC4", "color")
    info.vertex_source(_VERTEX)
    info.fragment_source(_FRAGMENT)
    return gpu.shader.create_from_info(info)


def _make_batch(shader: Any, target: Instance) -> Any:
    mesh = target.mesh
    assert mesh.uv is not None  # it is baked
    corners = np.ascontiguousarray(mesh.vertices[mesh.triangles.reshape(-1)], dtype=np.float32)
    places = np.ascontiguousarray(mesh.uv.reshape(-1, 2), dtype=np.float32)
    content: dict[str, Any] = {"pos": corners, "uv": places}
    return batch_for_shader(shader, "TRIS", content)


def _make_texture(values: Floats) -> Any:
    height, width = values.shape
    rows = np.ascontiguousarray(values[::-1], dtype=np.float32)  # from below, as textures have them
    return _types.GPUTexture((width, height), format="R32F", data=_types.Buffer("FLOAT", rows.size, rows.ravel()))

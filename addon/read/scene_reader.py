"""What Cycles would see of a scene, as plain arrays: depsgraph in, `core.scene.Scene` out, nothing of Blender kept.

Modifiers count at render level only in a depsgraph that Blender makes for an engine. `evaluated` gets one by a bake
with an engine of its own onto the colours of a passing triangle: unlike a render it needs no camera, leaves the Render
Result alone and calls no render handlers.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import Any, ClassVar

import bpy
import numpy as np
from numpy.typing import NDArray

from ...core.base.errors import InputError
from ...core.scene.cutout import Cutout
from ...core.scene.ground_plane import ground_below
from ...core.scene.scene import Camera, Doubles, Floats, Highs, Instance, Ints, Mesh, Scene, unit_normals
from ...core.texels.shading_normals import NormalMap
from ..materials.cutouts import Opacities, cutout_of
from ..materials.image_pixels import Pictures
from ..materials.mesh_layers import materials_of, tangents_of, values_of
from ..materials.normal_maps import Imprints, normal_map_of
from .high_low_pairs import HighNames
from .occluder_filter import EVERYTHING, Occluding

Warn = Callable[[str], None]
_MOST_LAYERS = 8  # UV maps of a mesh
_WITH_TANGENTS = "a directional code and bent normals in tangent space"


def extract(
    context: bpy.types.Context,
    view_layer: bpy.types.ViewLayer,
    targets: Sequence[str],
    uv: str | None = None,
    *,
    occluding: Occluding = EVERYTHING,
    highs: Mapping[str, HighNames] = MappingProxyType({}),
    tangents: bool = False,
    normal_maps: bool = False,
    warn: Warn | None = None,
) -> Scene:
    """Copy the targets, all that occludes as in Cycles, and the camera, with modifiers at render level.

    targets: names of mesh objects in the view layer. uv: the UV map to bake onto, by default the active one; a target
    mesh without any has uv None. occluding: who occludes of what renders. highs: what targets are baked from, by the
    targets' names. tangents: the targets' are read, where they have UVs; normal_maps: those that reach the normals of
    their materials are, but for those that are baked from others. warn: called with a line for each object that
    Cycles would trace and this cannot. Raises InputError, a line naming the object, for a target, or a mesh to bake it
    from, that is missing, no mesh, hidden from render, or without the UV map asked for, or whose faces have no
    tangents.
    """
    wanted = _Wanted(view_layer, targets, uv, highs, tangents, normal_maps)
    found: list[Scene] = []
    evaluated(context, view_layer, lambda depsgraph: found.append(_read_scene(depsgraph, wanted, occluding, warn)))
    return found[0]


class _Wanted:
    """The objects to read as surfaces: targets, what they are baked from, their cages. Raises InputError."""

    def __init__(
        self,
        view_layer: bpy.types.ViewLayer,
        targets: Sequence[str],
        uv: str | None,
        highs: Mapping[str, HighNames],
        tangents: bool,
        normal_maps: bool,
    ) -> None:
        self.uv, self.tangents, self.normal_maps = uv, tangents, normal_maps
        self.targets = [_target_object(view_layer, name) for name in dict.fromkeys(targets)]
        self.given = {name: highs[name] for name in targets if name in highs}
        self.highs = {
            name: [_target_object(view_layer, high) for high in each.names] for name, each in self.given.items()
        }
        self.cages = {name: _target_object(view_layer, each.cage) for name, each in self.given.items() if each.cage}

    @property
    def surfaces(self) -> list[bpy.types.Object]:
        """Targets and high meshes: all must be in the render."""
        return [*self.targets, *(high for each in self.highs.values() for high in each)]

    @property
    def mapped(self) -> set[int]:
        """Addresses of targets whose normal maps are read."""
        return {obj.as_pointer() for obj in self.targets if self.normal_maps and obj.name not in self.highs}

    @property
    def addresses(self) -> set[int]:
        """Of all."""
        return {obj.as_pointer() for obj in (*self.surfaces, *self.cages.values())}


def _target_object(view_layer: bpy.types.ViewLayer, name: str) -> bpy.types.Object:
    obj = synced(view_layer).get(name)
    if obj is None:
        place = f"the view layer {view_layer.name}" if name in bpy.data.objects else "the file"
        raise InputError(f"{name}: no such object in {place}; check the name, or include its collection")
    if obj.type != "MESH":
        kind = obj.type.lower().replace("_", " ")
        raise InputError(f"{name}: is of type {kind}, which cannot be baked; convert it to a mesh or choose another")
    return obj


def synced(view_layer: bpy.types.ViewLayer) -> Any:
    """The view layer's objects: Blender lacks new ones and holds None for removed ones until asked for the active."""
    _ = view_layer.objects.active
    return view_layer.objects


# The depsgraph at render level


class _Visitor(bpy.types.RenderEngine):
    """The engine that renders nothing and shows its depsgraph to `visit`. Registered only while in use."""

    bl_idname = "OCCLUSION_BAKE_VISITOR"
    bl_label = "Occlusion Bake"
    visit: ClassVar[Callable[[bpy.types.Depsgraph], None]]
    outcome: ClassVar[list[Exception | None]]  # one entry a visit

    def update(self, data: Any, depsgraph: bpy.types.Depsgraph) -> None:
        """Needed by Blender before `bake`; there is nothing to prepare."""

    def bake(
        self,
        depsgraph: bpy.types.Depsgraph,
        obj: bpy.types.Object,
        pass_type: str,
        pass_filter: int,
        width: int,
        height: int,
    ) -> None:
        """Show the depsgraph. Blender would only print an exception, so it is kept for `evaluated` to raise."""
        try:
            type(self).visit(depsgraph)
        except Exception as error:
            self.outcome.append(error)
        else:
            self.outcome.append(None)


def evaluated(
    context: bpy.types.Context, view_layer: bpy.types.ViewLayer, visit: Callable[[bpy.types.Depsgraph], None]
) -> None:
    """Call `visit` once with the view layer's depsgraph at render level; it dies when `visit` returns.

    What `visit` raises is raised here. The artist's mode, engine and handlers are back afterwards, come what may.
    """
    scene = view_layer.id_data
    with ExitStack() as stack:
        stack.enter_context(object_mode(context))
        stack.enter_context(silenced("object_bake_pre", "object_bake_complete", "object_bake_cancel"))
        carrier = stack.enter_context(_carrier(scene))
        outcome = stack.enter_context(_registered(visit))
        borrow(stack, scene.render, engine=_Visitor.bl_idname)
        borrow(stack, scene.render.bake, use_multires=False)
        borrow(stack, scene.render, use_bake_multires=False)
        stack.enter_context(bake_override(context, carrier, scene, view_layer))
        bpy.ops.object.bake(type="EMIT", target="VERTEX_COLORS", save_mode="INTERNAL", use_selected_to_active=False)
    if not outcome:
        raise RuntimeError("Blender did not evaluate the scene")
    if outcome[0] is not None:
        raise outcome[0]


@contextmanager
def _registered(visit: Callable[[bpy.types.Depsgraph], None]) -> Iterator[list[Exception | None]]:
    _Visitor.visit, _Visitor.outcome = staticmethod(visit), []
    bpy.utils.register_class(_Visitor)
    try:
        yield _Visitor.outcome
    finally:
        bpy.utils.unregister_class(_Visitor)
        del _Visitor.visit


@contextmanager
def _carrier(scene: bpy.types.Scene) -> Iterator[bpy.types.Object]:
    """A triangle without area that casts no shadow: what Blender is asked to bake when all we want is a depsgraph."""
    mesh = bpy.data.meshes.new("Occlusion Bake")
    mesh.from_pydata([(0.0, 0.0, 0.0)] * 3, [], [(0, 1, 2)])
    mesh.color_attributes.new("Occlusion Bake", "BYTE_COLOR", "CORNER")
    mesh.color_attributes.active_color_index = 0
    with passing_object(scene, mesh) as obj:
        obj.visible_shadow = False
        yield obj


@contextmanager
def passing_object(scene: bpy.types.Scene, mesh: bpy.types.Mesh) -> Iterator[bpy.types.Object]:
    """An object of a new mesh in the scene for the time; both are gone afterwards."""
    obj = bpy.data.objects.new(mesh.name, mesh)
    scene.collection.objects.link(obj)
    try:
        yield obj
    finally:
        bpy.data.objects.remove(obj)
        bpy.data.meshes.remove(mesh)
        for view_layer in scene.view_layers:
            synced(view_layer)


# Settings on loan


def borrow(stack: ExitStack, owner: Any, **values: Any) -> None:
    """Set attributes of `owner` until the stack closes; those that this Blender does not have are passed over."""
    for name, value in values.items():
        if hasattr(owner, name):
            stack.callback(setattr, owner, name, getattr(owner, name))
            setattr(owner, name, value)


@contextmanager
def silenced(*names: str) -> Iterator[None]:
    """Empty these lists of bpy.app.handlers for the time: what we do is no render or bake of the artist's."""
    lists = [getattr(bpy.app.handlers, name) for name in names if hasattr(bpy.app.handlers, name)]
    kept = [list(handlers) for handlers in lists]
    for handlers in lists:
        handlers.clear()
    try:
        yield
    finally:
        for handlers, before in zip(lists, kept, strict=True):
            handlers[:] = before


@contextmanager
def bake_override(
    context: bpy.types.Context, obj: bpy.types.Object, scene: bpy.types.Scene, view_layer: bpy.types.ViewLayer
) -> Iterator[None]:
    """Let operators take `obj` for the active and only selected object, whatever the artist has selected or hidden."""
    with context.temp_override(
        scene=scene, view_layer=view_layer, active_object=obj, object=obj, selected_objects=[obj]
    ):
        yield


@contextmanager
def object_mode(context: bpy.types.Context) -> Iterator[None]:
    """Out of edit mode for the time, with all edits in the data; the edited objects, selection and mode come back.

    A mesh that is being edited evaluates without its modifiers, even for a render. Where edit mode was left, and only
    there, two undo steps are pushed: without them an undo to a step before the edit would leave the edit in the mesh.
    """
    objects = synced(context.view_layer)
    edited = [obj for obj in objects if obj.mode == "EDIT"]
    bpy.ops.ed.flush_edits()
    if not edited:
        yield
        return
    bpy.ops.object.mode_set(mode="OBJECT")
    try:
        yield
    finally:
        bpy.ops.ed.undo_push(message="Leave Edit Mode")
        _edit_again(objects, edited)
        bpy.ops.ed.undo_push(message="Return to Edit Mode")


def _edit_again(objects: Any, edited: Sequence[bpy.types.Object]) -> None:
    selected = [obj for obj in objects if obj.select_get()]
    _select_only(selected, edited)
    bpy.ops.object.mode_set(mode="EDIT")
    _select_only(edited, selected)


def _select_only(before: Sequence[bpy.types.Object], after: Sequence[bpy.types.Object]) -> None:
    for obj in before:
        obj.select_set(False)
    for obj in after:
        obj.select_set(True)


# What is in the depsgraph


# Name, address of the evaluated mesh, matrix, the object that it belongs to, what of it lets light through.
_Entry = tuple[str, int, Doubles, str, Cutout | None]


@dataclass
class _Found:
    """One walk over the instances: what occludes, where the targets are, and each distinct evaluated mesh once."""

    opacities: Opacities
    imprints: Imprints
    cutouts: dict[tuple[int, tuple[str, ...]], Cutout | None] = field(default_factory=dict)  # by mesh and materials
    lines: list[str] = field(default_factory=list)  # on materials that are not read as they are
    meshes: dict[int, bpy.types.Mesh] = field(default_factory=dict)  # by address, as are the others
    occluders: list[_Entry] = field(default_factory=list)
    targets: dict[int, _Entry] = field(default_factory=dict)  # by the address of the original object
    normal_maps: dict[int, NormalMap | None] = field(default_factory=dict)  # of those, by the same
    unread: dict[str, str] = field(default_factory=dict)  # object name: what of it is not traced


def _read_scene(depsgraph: bpy.types.Depsgraph, wanted: _Wanted, occluding: Occluding, warn: Warn | None) -> Scene:
    found = _walk(depsgraph, wanted, occluding)
    for line in found.lines if warn else ():
        warn(line)  # type: ignore[misc]
    for name, what in found.unread.items() if warn else ():
        warn(f"{name}: its {what} not traced and block no light here; convert them to a mesh")  # type: ignore[misc]
    for obj in wanted.surfaces:
        if obj.as_pointer() not in found.targets:
            raise InputError(_absence(obj))
    baked = {found.targets[obj.as_pointer()][1] for obj in wanted.targets}
    chosen = {key: name for name, key, *_ in found.targets.values()}
    meshes = {
        key: _read_surface(mesh, chosen[key], wanted, unwrapped=key in baked) if key in chosen else _read_shape(mesh)
        for key, mesh in found.meshes.items()
    }

    def instance_of(obj: bpy.types.Object) -> Instance:
        address = obj.as_pointer()
        return replace(_instance(found.targets[address], meshes), normal_map=found.normal_maps.get(address))

    targets = [instance_of(obj) for obj in wanted.targets]
    highs = {
        name: Highs(
            [instance_of(obj) for obj in each], _cage(wanted, name, found, meshes), wanted.given[name].extrusion
        )
        for name, each in wanted.highs.items()
    }
    occluders = [_instance(entry, meshes) for entry in found.occluders if len(meshes[entry[1]].triangles)]
    if occluding.ground:
        standing = [each for name in highs for each in highs[name].meshes] + targets
        occluders.append(ground_below(standing))
    return Scene(targets, occluders, _camera(depsgraph), shared=not occluding.alone, highs=highs)


def _cage(wanted: _Wanted, target: str, found: _Found, meshes: dict[int, Mesh]) -> Instance | None:
    """A cage as it renders; one that does not, as cages often do not, as its mesh is before modifiers."""
    obj = wanted.cages.get(target)
    if obj is None:
        return None
    if obj.as_pointer() in found.targets:
        return _instance(found.targets[obj.as_pointer()], meshes)
    return Instance(obj.name, _read_shape(obj.data), matrix_of(obj.matrix_world))


def _absence(obj: bpy.types.Object) -> str:
    """Why a mesh object of the view layer is not among what renders, and the cure."""
    if obj.is_instancer and not obj.show_instancer_for_render:
        return f"{obj.name}: an instancer hidden from render; switch on Instancing > Show Instancer > Render"
    if obj.hide_render or any(collection.hide_render for collection in obj.users_collection):
        return f"{obj.name}: hidden from render; enable it and its collections in the Outliner (camera icon)"
    return f"{obj.name}: no mesh of its own in the render; see its modifiers, and whether its collections are enabled"


def _instance(entry: _Entry, meshes: dict[int, Mesh]) -> Instance:
    name, key, matrix, owner, cutout = entry
    return Instance(name, meshes[key], matrix, owner, cutout)


def _walk(depsgraph: bpy.types.Depsgraph, wanted: _Wanted, occluding: Occluding) -> _Found:
    """Visit every object as Cycles' sync does. Curves, text and metaballs come twice, once as the mesh they make."""
    targets, mapped = wanted.addresses, wanted.mapped
    pictures, override = Pictures(), depsgraph.view_layer_eval.material_override
    found = _Found(Opacities(override, pictures), Imprints(override, pictures))
    for instance in depsgraph.object_instances:
        obj, data = instance.object, instance.object.data
        owner = instance.parent if instance.is_instance else obj
        address = owner.original.as_pointer()
        casts = _casts_shadow(instance) and occluding.counts(owner.name, own=address in targets)
        if casts and (what := _not_traced(instance)):
            found.unread[obj.name] = what
        if not instance.show_self or not isinstance(data, bpy.types.Mesh):
            continue
        key, matrix = data.as_pointer(), matrix_of(instance.matrix_world)
        found.meshes.setdefault(key, data)
        name = f"{instance.parent.name}/{obj.name}" if instance.is_instance else obj.name
        if casts:
            found.occluders.append((name, key, matrix, owner.name, _cutout(obj, data, found)))
        if not instance.is_instance and address in targets:
            found.targets[address] = (name, key, matrix, owner.name, None)
            if address in mapped:
                what = (obj, data, corners_of(data), _polygons(data), found.imprints, found.lines)
                found.normal_maps[address] = normal_map_of(*what)
    return found


def _cutout(obj: bpy.types.Object, mesh: bpy.types.Mesh, found: _Found) -> Cutout | None:
    """One for all that share mesh and materials, so that they share a tree."""
    materials = tuple(slot.material.name_full if slot.material else "" for slot in obj.material_slots)
    key = (mesh.as_pointer(), materials)
    if key not in found.cutouts:
        covers = [found.opacities.of(material, found.lines) for material in materials_of(obj)]
        found.cutouts[key] = None
        if any(cover.alpha is not None for cover in covers):  # an opaque mesh is not looked at
            corners = corners_of(mesh)
            found.cutouts[key], _ = cutout_of(obj, mesh, corners, _polygons(mesh), found.opacities)
    return found.cutouts[key]


def _casts_shadow(instance: bpy.types.DepsgraphObjectInstance) -> bool:
    """Cycles asks an instance's parent too."""
    return bool(instance.object.visible_shadow and (not instance.is_instance or instance.parent.visible_shadow))


def _not_traced(instance: bpy.types.DepsgraphObjectInstance) -> str:
    """What Cycles would trace of this instance that is no mesh, in words that fit a sentence; else an empty string."""
    obj = instance.object
    if instance.show_self and obj.type in ("CURVES", "POINTCLOUD"):
        return {"CURVES": "hair curves are", "POINTCLOUD": "points are"}[obj.type]
    if instance.show_particles and any(
        system.settings.type == "HAIR" and system.settings.render_type == "PATH" for system in obj.particle_systems
    ):
        return "hair particles are"
    return ""


def matrix_of(matrix: Any) -> Doubles:
    """(4, 4) float64 of a matrix of Blender's."""
    return np.array((*matrix[0], *matrix[1], *matrix[2], *matrix[3]), dtype=np.float64).reshape(4, 4)


def _camera(depsgraph: bpy.types.Depsgraph) -> Camera | None:
    camera = depsgraph.scene_eval.camera
    if camera is None:
        return None
    matrix = matrix_of(camera.evaluated_get(depsgraph).matrix_world)
    backward = matrix[:3, 2]
    x, y, z = -backward / (np.linalg.norm(backward) or 1.0)
    orthographic = camera.type == "CAMERA" and camera.data.type == "ORTHO"
    return Camera(tuple(matrix[:3, 3].tolist()), (float(x), float(y), float(z)), orthographic)


# Meshes


def _read_shape(mesh: bpy.types.Mesh) -> Mesh:
    """Vertices and triangles alone: all that an occluder needs."""
    return Mesh(mesh.name, _positions(mesh), _vertices_of(mesh, corners_of(mesh)))


def _read_surface(mesh: bpy.types.Mesh, owner: str, wanted: _Wanted, *, unwrapped: bool) -> Mesh:
    """unwrapped: with its UVs, where it has faces; one without is refused for that."""
    corners = corners_of(mesh)
    vertices, triangles = _positions(mesh), _vertices_of(mesh, corners)
    layer = _uv_layer(mesh, owner, wanted.uv) if unwrapped and len(corners) else None
    layout = None if layer is None else values_of(layer.uv, "vector", len(mesh.loops), 2)[corners]
    tangents = None
    if layer is not None and wanted.tangents:
        tangents = tangents_of(mesh, owner, layer.name, corners, _WITH_TANGENTS)
    normals = _normals(mesh, vertices, triangles, corners)
    return Mesh(mesh.name, vertices, triangles, layout, normals, corners, tangents)


def _uv_layer(mesh: bpy.types.Mesh, owner: str, name: str | None) -> Any:
    """The named UV map or the active one, None where the mesh has none. Raises InputError for a name it lacks."""
    layers = mesh.uv_layers
    if name is None:
        return layers.active or (layers[0] if layers else None)
    if name not in layers:
        cure = (
            f"choose one of those it has: {', '.join(layer.name for layer in layers)}" if layers else "unwrap it first"
        )
        raise InputError(f"{owner}: no UV map named {name}; {cure}")
    return layers[name]


def _normals(mesh: bpy.types.Mesh, vertices: Floats, triangles: Ints, corners: Ints) -> Floats | None:
    """(T, 3, 3) shading normals as this Blender's Cycles takes them, None where all faces are flat.

    Measured by normal bakes: a wholly flat mesh is flat triangle by triangle, even where a polygon is not planar. In a
    mesh with smooth faces too, a flat polygon is so up to Blender 5.1 unless the mesh has custom normals; from 5.2 on
    it has one normal.
    """
    if mesh.normals_domain == "FACE":
        return None
    normals = values_of(mesh.corner_normals, "vector", len(mesh.loops), 3)[corners]
    if mesh.normals_domain == "CORNER" and bpy.app.version < (5, 2) and not mesh.has_custom_normals:
        flat = _flat(mesh)
        normals[flat] = _face_normals(vertices, triangles[flat])[:, np.newaxis]
    return normals


def _flat(mesh: bpy.types.Mesh) -> NDArray[np.bool_]:
    """(T,) bool: triangles of flat-shaded polygons."""
    sharp = mesh.attributes.get("sharp_face")
    if sharp is None:
        return np.zeros(len(mesh.loop_triangles), dtype=np.bool_)
    faces = np.empty(len(mesh.polygons), dtype=np.bool_)
    sharp.data.foreach_get("value", faces)
    return faces[_polygons(mesh)]


def _face_normals(vertices: Floats, triangles: Ints) -> Floats:
    """(T, 3) unit normals by the right-hand rule; zero for a triangle without area."""
    return unit_normals(vertices[triangles].astype(np.float64)).astype(np.float32)


def _positions(mesh: bpy.types.Mesh) -> Floats:
    if not len(mesh.vertices):
        return np.empty((0, 3), dtype=np.float32)
    return values_of(mesh.attributes["position"].data, "vector", len(mesh.vertices), 3)


def _vertices_of(mesh: bpy.types.Mesh, corners: Ints) -> Ints:
    """(T, 3) vertex indices of corner indices."""
    if not len(mesh.loops):
        return corners
    vertex = np.empty(len(mesh.loops), dtype=np.int32)
    mesh.attributes[".corner_vert"].data.foreach_get("value", vertex)
    return vertex[corners]


def _polygons(mesh: bpy.types.Mesh) -> Ints:
    polygons = np.empty(len(mesh.loop_triangles), dtype=np.int32)
    mesh.loop_triangle_polygons.foreach_get("value", polygons)
    return polygons


def corners_of(mesh: bpy.types.Mesh) -> Ints:
    """(T, 3) corner indices of the triangles.

    Blender holds them as one array of three int32 a triangle, which can be copied whole: its own call takes 0.16 μs a
    triangle. That layout is no promise, so it is checked on a sample, addresses first, and else the call is used.
    """
    triangles = mesh.loop_triangles
    corners = np.empty((len(triangles), 3), dtype=np.int32)
    if not len(triangles):
        return corners
    start, size = triangles[0].as_pointer(), corners.strides[0]
    sample = np.unique(np.linspace(0, len(triangles) - 1, 64).astype(np.int64)).tolist()
    if all(triangles[i].as_pointer() == start + i * size for i in sample):
        ctypes.memmove(corners.ctypes.data, start, corners.nbytes)
        if all(tuple(triangles[i].loops) == tuple(corners[i].tolist()) for i in sample):
            return corners
    triangles.foreach_get("loops", corners.reshape(-1))
    return corners


# The artist's own mesh, for charts


@dataclass(frozen=True, eq=False)
class BaseTriangles:
    """A mesh as the artist made it, before modifiers.

    vertices: (V, 3) float32. triangles: (T, 3) int32 vertices, loops: (T, 3) int32 corners, polygons: (T,) int32.
    """

    vertices: Floats
    triangles: Ints
    loops: Ints
    polygons: Ints


def base_triangles(context: bpy.types.Context, obj: bpy.types.Object) -> BaseTriangles:
    """Triangles of the object's original mesh data, edits in progress among them."""
    mesh = obj.data
    with object_mode(context):
        loops = corners_of(mesh)
        return BaseTriangles(_positions(mesh), _vertices_of(mesh, loops), loops, _polygons(mesh))


def check_room(obj: bpy.types.Object, layer_name: str) -> None:
    """Refuse a mesh that has no room for another UV map. Raises InputError."""
    layers = obj.data.uv_layers
    if layer_name not in layers and len(layers) >= _MOST_LAYERS:
        raise InputError(f"{obj.name}: Blender has no room for another UV map on its mesh; remove one")


def write_uv(
    context: bpy.types.Context,
    obj: bpy.types.Object,
    layer_name: str,
    uv: Floats,
    loops: Ints,
    *,
    activate: bool = False,
) -> str:
    """Write a UV map named `layer_name` into the object's mesh, as a new map or over an earlier one of that name.

    uv: (T, 3, 2) float32, v up; loops: (T, 3) int32 as in `base_triangles`. The other maps stay as they are, the active
    one too unless `activate`. Returns the name that Blender gave it. Raises InputError for a mesh linked from a library
    and for one that has no room for another map.
    """
    mesh = obj.data
    if mesh.library is not None:
        raise InputError(f"{obj.name}: its mesh is linked from {mesh.library.filepath}; make the mesh local first")
    with object_mode(context):
        layer = _own_layer(mesh, obj.name, layer_name, activate)
        values = values_of(layer.uv, "vector", len(mesh.loops), 2)
        values[loops] = uv
        layer.uv.foreach_set("vector", values.reshape(-1))
        mesh.update()
        return str(layer.name)


def _own_layer(mesh: bpy.types.Mesh, owner: str, name: str, activate: bool) -> Any:
    layers = mesh.uv_layers
    active, shown = layers.active_index, next((layer.name for layer in layers if layer.active_render), None)
    layer = layers.get(name) or layers.new(name=name, do_init=False)
    if layer is None:
        raise InputError(f"{owner}: Blender has no room for another UV map on its mesh; remove one")
    name = layer.name
    if activate:
        layers.active = layer
    elif active >= 0:
        layers.active_index = active
    if shown is not None:
        layers[shown].active_render = True
    return layers[name]

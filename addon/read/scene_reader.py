"""What Cycles would see of a scene, as plain arrays: depsgraph in, `core.scene.Scene` out, nothing of Blender kept."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import bpy
import numpy as np

from ...core.base.arrays import Doubles
from ...core.base.errors import InputError
from ...core.base.vectors import length_of
from ...core.scene.cutout import Cutout
from ...core.scene.ground_plane import ground_below
from ...core.scene.normal_map import NormalMap
from ...core.scene.scene import Camera, HighPoly, Instance, Mesh, Scene
from ..materials.cutouts import MaterialOpacities, cutout_of
from ..materials.displacement import MaterialDisplacements
from ..materials.image_pixels import ImagePixels
from ..materials.mesh_layers import materials_of
from ..materials.normal_maps import MaterialNormalMaps, normal_map_of
from ..typed import mesh_of, scene_in, uid_of
from .blender_state import synced
from .block_ref import BlockRef, find, labels_of
from .depsgraph import evaluated
from .displacement import MeshKey, Undisplaced, copied, displaced_meshes, lines_on_subdivision
from .high_low_pairs import HighMeshes
from .mesh_arrays import corners_of, polygons_of, read_shape, read_surface
from .occluder_filter import EVERYTHING, OccluderFilter


@dataclass(frozen=True)
class SceneRequest:
    """What to read. targets: mesh objects in the view layer. uv: the UV maps to bake onto, by default the active ones.
    occluding: who occludes of what renders. highs: what targets are baked from. tangents: the targets' are read, where
    they have UVs; normal_maps: those that reach the normals of their materials are, but for those that are baked from
    others."""

    targets: Sequence[BlockRef]
    uv: Mapping[BlockRef, str] = field(default_factory=dict)
    occluding: OccluderFilter = EVERYTHING
    highs: Mapping[BlockRef, HighMeshes] = field(default_factory=dict)
    tangents: bool = False
    normal_maps: bool = False


def read_scene(
    context: bpy.types.Context, view_layer: bpy.types.ViewLayer, request: SceneRequest
) -> tuple[Scene, list[str]]:
    """Copy the targets, all that occludes as in Cycles, and the camera, with modifiers at render level.

    The scene's targets are those of the request, each once, in its order; all objects in it are called by their labels,
    no two the same. A target mesh without any UV map has uv None. Returns the scene, and a line for each object that
    Cycles would trace and this cannot. Raises InputError, a line naming the object, for a target, or what it is baked
    from, that is missing, no mesh, hidden from render, or without the UV map asked for, or whose faces have no
    tangents.
    """
    wanted = _Wanted(view_layer, request)
    read: list[_Found] = []
    evaluated(context, view_layer, lambda depsgraph: read.append(_read(depsgraph, wanted)))
    (found,) = read
    moved, lines = displaced_meshes(scene_in(context), found.undisplaced, found.meshes)
    found.meshes.update(moved)
    return _assembled(wanted, found), found.warnings + lines


class _Wanted:
    """The objects to read as surfaces: targets, what they are baked from, their cages. Raises InputError."""

    def __init__(self, view_layer: bpy.types.ViewLayer, request: SceneRequest) -> None:
        self.request = request
        self.refs = tuple(dict.fromkeys(request.targets))
        self.given = {ref: request.highs[ref] for ref in self.refs if ref in request.highs}
        there = {obj.session_uid: obj for obj in synced(view_layer)}

        def wanted(ref: BlockRef) -> bpy.types.Object:
            return _checked(ref, there.get(ref.uid), view_layer)

        self.targets = [wanted(ref) for ref in self.refs]
        self.highs = {ref: [wanted(high) for high in each.meshes] for ref, each in self.given.items()}
        self.cages = {ref: wanted(each.cage) for ref, each in self.given.items() if each.cage}
        self.labels = labels_of(bpy.data.objects, self.refs)

    @property
    def surfaces(self) -> list[bpy.types.Object]:
        """Targets and high meshes: all must be in the render."""
        return [*self.targets, *(high for each in self.highs.values() for high in each)]

    @property
    def mapped(self) -> set[int]:
        """Addresses of targets whose normal maps are read."""
        if not self.request.normal_maps:
            return set()
        own = zip(self.refs, self.targets, strict=True)
        return {obj.as_pointer() for ref, obj in own if ref not in self.highs}

    @property
    def addresses(self) -> set[int]:
        """Of all."""
        return {obj.as_pointer() for obj in (*self.surfaces, *self.cages.values())}


def _checked(ref: BlockRef, obj: bpy.types.Object | None, view_layer: bpy.types.ViewLayer) -> bpy.types.Object:
    """An object of the view layer that is to be read as a surface; None where it is not there. Raises InputError."""
    if obj is None:
        place = "the file" if find(bpy.data.objects, ref) is None else f"the view layer {view_layer.name}"
        raise InputError(f"{ref.label}: no such object in {place}; check the name, or include its collection")
    if obj.type != "MESH":
        kind = obj.type.lower().replace("_", " ")
        raise InputError(
            f"{ref.label}: is of type {kind}, which cannot be baked; convert it to a mesh or choose another"
        )
    return obj


# Label, mesh, matrix, the label of whom it belongs to, what of it lets light through.
_Entry = tuple[str, MeshKey, Doubles, str, Cutout | None]


class _Materials:
    """What materials say of opacity, normals and shape, each followed once."""

    def __init__(self, override: bpy.types.Material | None) -> None:
        pixels = ImagePixels()
        self.opacities, self.normal_maps = MaterialOpacities(override, pixels), MaterialNormalMaps(override, pixels)
        self.displacements = MaterialDisplacements(override)
        self.cutouts: dict[tuple[int, ...], Cutout | None] = {}  # by the addresses of mesh and materials


@dataclass
class _Found:
    """One walk over the instances: what occludes, where the targets are, and each distinct evaluated mesh once."""

    materials: _Materials
    lines: list[str] = field(default_factory=list)  # on materials that are not read as they are
    seen: dict[MeshKey, tuple[str, bpy.types.Mesh, Doubles]] = field(default_factory=dict)  # by the first that has it
    meshes: dict[MeshKey, Mesh] = field(default_factory=dict)
    undisplaced: dict[MeshKey, Undisplaced] = field(default_factory=dict)
    camera: Camera | None = None
    standing: list[_Entry] = field(default_factory=list)  # what blocks light, but for the request
    occluders: list[_Entry] = field(default_factory=list)
    private: set[str] = field(default_factory=set)  # labels of occluders that are so for being baked alone
    targets: dict[int, _Entry] = field(default_factory=dict)  # by the address of the original object
    normal_maps: dict[int, NormalMap | None] = field(default_factory=dict)  # of those, by the same
    unread: dict[str, str] = field(default_factory=dict)  # by label: what of it is not traced

    @property
    def warnings(self) -> list[str]:
        """A line for all that is not as in Cycles."""
        return self.lines + [
            f"{name}: its {what} not traced and block no light here; convert them to a mesh"
            for name, what in self.unread.items()
        ]


def _read(depsgraph: bpy.types.Depsgraph, wanted: _Wanted) -> _Found:
    """All that is needed of the depsgraph."""
    request, found = wanted.request, _walk(depsgraph, wanted)
    for obj in wanted.surfaces:
        if obj.as_pointer() not in found.targets:
            raise InputError(_absence(obj, wanted.labels[obj.session_uid]))
    baked = {found.targets[obj.as_pointer()][1] for obj in wanted.targets}
    chosen = {key: name for name, key, *_ in found.targets.values()}
    own = zip(wanted.refs, wanted.targets, strict=True)
    maps = {found.targets[obj.as_pointer()][1]: request.uv.get(ref) for ref, obj in own}
    found.meshes = {
        key: read_surface(mesh, chosen[key], maps.get(key), unwrapped=key in baked, tangents=request.tangents)
        if key in chosen
        else read_shape(mesh)
        for key, (_, mesh, _) in found.seen.items()
    }
    found.camera = _camera(depsgraph)
    for key, (owner, mesh, matrix) in found.seen.items():
        if key[1] and len(found.meshes[key].triangles):
            found.undisplaced[key] = Undisplaced(owner, copied(mesh), matrix, key[1], shaded=key in chosen)
    return found


def _assembled(wanted: _Wanted, found: _Found) -> Scene:
    request, meshes = wanted.request, found.meshes

    def instance_of(obj: bpy.types.Object) -> Instance:
        address = obj.as_pointer()
        return replace(_instance(found.targets[address], meshes), normal_map=found.normal_maps.get(address))

    targets = [instance_of(obj) for obj in wanted.targets]
    highs = {
        ref.label: HighPoly(
            [instance_of(obj) for obj in each], _cage(wanted, ref, found, meshes), wanted.given[ref].extrusion
        )
        for ref, each in wanted.highs.items()
    }
    occluders = [_instance(entry, meshes) for entry in found.occluders if len(meshes[entry[1]].triangles)]
    if request.occluding.ground:
        occluders.append(ground_below([_instance(entry, meshes) for entry in found.standing or found.targets.values()]))
    return Scene(targets, occluders, found.camera, found.private, highs)


def _cage(wanted: _Wanted, target: BlockRef, found: _Found, meshes: Mapping[MeshKey, Mesh]) -> Instance | None:
    """A cage as it renders; one that does not, as cages often do not, as its mesh is before modifiers."""
    obj = wanted.cages.get(target)
    if obj is None:
        return None
    if obj.as_pointer() in found.targets:
        return _instance(found.targets[obj.as_pointer()], meshes)
    return Instance(
        wanted.labels[obj.session_uid],
        read_surface(mesh_of(obj), obj.name, None, unwrapped=False, tangents=False),
        matrix_of(obj.matrix_world),
    )


def _absence(obj: bpy.types.Object, label: str) -> str:
    """Why a mesh object of the view layer is not among what renders, and the cure."""
    if obj.is_instancer and not obj.show_instancer_for_render:
        return f"{label}: an instancer hidden from render; switch on Instancing > Show Instancer > Render"
    if obj.hide_render or any(collection.hide_render for collection in obj.users_collection):
        return f"{label}: hidden from render; enable it and its collections in the Outliner (camera icon)"
    return f"{label}: no mesh of its own in the render; see its modifiers, and whether its collections are enabled"


def _instance(entry: _Entry, meshes: Mapping[MeshKey, Mesh]) -> Instance:
    name, key, matrix, owner, cutout = entry
    return Instance(name, meshes[key], matrix, owner, cutout)


def _walk(depsgraph: bpy.types.Depsgraph, wanted: _Wanted) -> _Found:
    """Visit every object as Cycles' sync does. Curves, text and metaballs come twice, once as the mesh they make."""
    targets, mapped, occluding = wanted.addresses, wanted.mapped, wanted.request.occluding
    displaced = {obj.as_pointer() for obj in wanted.surfaces}  # a cage is as it was made
    view_layer: Any = depsgraph.view_layer_eval
    found = _Found(_Materials(view_layer.material_override))
    instances: Any = depsgraph.object_instances
    for instance in instances:
        obj, data = instance.object, instance.object.data
        owner = instance.parent if instance.is_instance else obj
        address, uid = owner.original.as_pointer(), uid_of(owner)
        standing, own = _casts_shadow(instance), address in targets
        casts = standing and occluding.counts(uid, own=own)
        label, owner_label = (wanted.labels.get(uid_of(each), each.name) for each in (obj, owner))
        if casts and (what := _not_traced(instance)):
            found.unread[label] = what
        if not instance.show_self or not isinstance(data, bpy.types.Mesh):
            continue
        matrix = matrix_of(instance.matrix_world)
        moves = casts or (standing and occluding.ground) or address in displaced
        key = (data.as_pointer(), found.materials.displacements.movers(obj) if moves else ())
        if key not in found.seen:
            found.seen[key] = (label, data, matrix)
            found.lines += lines_on_subdivision(label, obj, depsgraph.scene) if key[1] else []
        name = f"{owner_label}/{label}" if instance.is_instance else label
        if standing:
            found.standing.append((name, key, matrix, owner_label, None))
        if casts:
            found.occluders.append((name, key, matrix, owner_label, _cutout(obj, data, found)))
            if own and not occluding.counts(uid):
                found.private.add(owner_label)
        if not instance.is_instance and address in targets:
            found.targets[address] = (name, key, matrix, owner_label, None)
            if address in mapped:
                corners, polygons = corners_of(data), polygons_of(data)
                found.normal_maps[address] = normal_map_of(
                    obj, data, corners, polygons, found.materials.normal_maps, found.lines
                )
    return found


def _cutout(obj: bpy.types.Object, mesh: bpy.types.Mesh, found: _Found) -> Cutout | None:
    """One for all that share mesh and materials, so that they share a tree."""
    slots = [slot.material.as_pointer() if slot.material else 0 for slot in obj.material_slots]
    materials, key = found.materials, (mesh.as_pointer(), *slots)
    if key not in materials.cutouts:
        covers = [materials.opacities.of(material, found.lines) for material in materials_of(obj)]
        materials.cutouts[key] = None
        if any(cover.alpha is not None for cover in covers):  # an opaque mesh is not looked at
            corners = corners_of(mesh)
            materials.cutouts[key], _ = cutout_of(obj, mesh, corners, polygons_of(mesh), materials.opacities)
    return materials.cutouts[key]


def _casts_shadow(instance: Any) -> bool:
    """Cycles asks an instance's parent too."""
    return bool(instance.object.visible_shadow and (not instance.is_instance or instance.parent.visible_shadow))


def _not_traced(instance: Any) -> str:
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
    scene: Any = depsgraph.scene_eval
    camera = scene.camera
    if camera is None:
        return None
    matrix = matrix_of(camera.evaluated_get(depsgraph).matrix_world)
    backward = matrix[:3, 2]
    x, y, z = -backward / (length_of(backward) or 1.0)
    orthographic = camera.type == "CAMERA" and camera.data.type == "ORTHO"
    return Camera(tuple(matrix[:3, 3].tolist()), (float(x), float(y), float(z)), orthographic)

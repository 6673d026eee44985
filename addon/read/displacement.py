"""Meshes as their materials displace them: asked of Cycles itself, whatever nodes make the displacement.

A bake of positions into colours of corners gives the places of a mesh's corners after displacement, one of normals the
shading normals that Cycles then takes, which differ by its version where edges are sharp or normals custom. Cycles
evaluates a displacement at each vertex once, by the first of its triangles. It is asked of copies that stand alone in a
scene of ours: so whatever is instanced, linked or made by nodes can be asked for, and no other object is exported.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, replace
from itertools import zip_longest
from typing import Any, Literal

import bpy
import numpy as np
from mathutils import Matrix

from ...core.base.arrays import Doubles, Flags, Floats, Ints
from ...core.base.errors import InputError
from ...core.scene.scene import Mesh
from ..materials.displacement import MaterialDisplacement, Movers, lines_on_movers
from ..materials.mesh_layers import values_of
from ..typed import Node, Tree
from .bake_operator import run_operator
from .blender_state import bake_override, silenced
from .cycles_scene import passing_scene
from .mesh_arrays import corners_of, flat_triangles, flatten, positions_of, vertices_of

_NAME = "Occlusion Bake"
_APART = 1e-2  # of the farthest move: by more than that, corners of one vertex have come apart
_NUDGE = 1e-4  # of the largest coordinate, or of 1: so far inside of a triangle Cycles looks at its corners, at most in
# its middle (its kernel/integrator/init_from_bake.h)
_SLIM = 1e-3  # the height of a triangle that is hardly one, in the lengths of its edges
_ROUNDS, _SURE = 4, 0.25  # of taking that back, and up to which share of the way to the middle that is sure

MeshKey = tuple[int, Movers]  # of an evaluated mesh, its address, and what moves it


@dataclass(frozen=True, eq=False)
class Undisplaced:
    """An evaluated mesh before it is displaced. owner: the first object that has it. mesh: a copy of our own. matrix:
    (4, 4) float64, that object's to world: displacement by what is shared is the same for all, as in Cycles. shaded:
    whether its normals are needed, too."""

    owner: str
    mesh: bpy.types.Mesh
    matrix: Doubles
    movers: Movers
    shaded: bool


def lines_on_subdivision(label: str, obj: Any, scene: Any) -> list[str]:
    """On an object that Cycles dices for displacement as finely as it is seen: here its modifier's levels count."""
    last = next((modifier for modifier in reversed(obj.modifiers) if modifier.show_render), None)
    if last is None or last.type != "SUBSURF":
        return []
    if bpy.app.version >= (5, 0):
        adaptive = last.use_adaptive_subdivision
    else:
        cycles = getattr(scene, "cycles", None)  # the add-on's
        adaptive = cycles and cycles.feature_set == "EXPERIMENTAL" and obj.cycles.use_adaptive_subdivision
    return [
        f"{label}: its adaptive subdivision is not followed; it is displaced as the modifier {last.name} subdivides "
        "it for renders; raise its Levels Render for more detail"
    ] * bool(adaptive)


def copied(mesh: bpy.types.Mesh) -> bpy.types.Mesh:
    """An evaluated mesh in the file; `displaced_meshes` removes it."""
    copy = mesh.copy()
    copy.use_auto_texspace = False  # it is that of the mesh before modifiers
    copy.texspace_location, copy.texspace_size = mesh.texspace_location, mesh.texspace_size
    return copy


def displaced_meshes(
    scene: bpy.types.Scene, waiting: Mapping[MeshKey, Undisplaced], meshes: Mapping[MeshKey, Mesh]
) -> tuple[dict[MeshKey, Mesh], list[str]]:
    """Those of `meshes` that are waiting for it as they are displaced, and a line for each that is not, or not as it
    would be in the scene."""
    moved: dict[MeshKey, Mesh] = {}
    lines = lines_on_movers((each.owner, each.movers) for each in waiting.values())
    try:
        for key, each in waiting.items():
            try:
                moved[key] = _displaced(scene, each, meshes[key])
            except InputError as error:
                lines.append(f"{error}; it is baked as if {_names(each)} did not displace it")
    finally:
        for each in waiting.values():
            bpy.data.meshes.remove(each.mesh)
    return moved, lines


def _names(each: Undisplaced) -> str:
    return ", ".join(dict.fromkeys(mover.material.name for mover in each.movers if mover is not None))


@dataclass(frozen=True)
class _Frame:
    """How a mesh stands before Cycles: moved by -centre, then grown by factor, then under matrix. Coordinates of about
    1, strays apart, keep its nudge small beside the triangles."""

    centre: Doubles
    factor: float
    matrix: Doubles

    def within(self, places: Any) -> Doubles:
        """(N, 3) places of the object's in the mesh that Cycles gets."""
        grown: Doubles = (np.asarray(places, dtype=np.float64) - self.centre) * self.factor
        return grown


def _frame_of(each: Undisplaced, rest: Floats) -> _Frame:
    """The object's own where something depends on it, and it can be undone."""
    if any(mover is not None and mover.placed for mover in each.movers) and np.linalg.det(each.matrix[:3, :3]):
        return _Frame(np.zeros(3), 1.0, each.matrix)
    centre = np.median(rest.astype(np.float64), axis=0)
    size = np.abs(rest - centre).max(axis=1)
    return _Frame(centre, 0.5 / (float(np.median(size) or size.max()) or 0.5), np.eye(4))


def _displaced(scene: bpy.types.Scene, each: Undisplaced, mesh: Mesh) -> Mesh:
    """Raises InputError where Cycles is not enabled, or gives up."""
    rest = positions_of(each.mesh)
    frame = _frame_of(each, rest)
    linear = frame.matrix[:3, :3]
    with ExitStack() as stack:
        stack.enter_context(silenced("object_bake_pre", "object_bake_complete", "object_bake_cancel"))
        passing = stack.enter_context(passing_scene(scene, f"{each.owner}: its displacement by {_names(each)}", 1))
        obj = stack.enter_context(_object(passing, each, frame))
        stack.enter_context(_materials(each.mesh, each.movers, frame.factor))
        there = _of_corners(passing, obj, each, "POSITION") - frame.matrix[:3, 3]
        shading = 2.0 * _of_corners(passing, obj, each, "NORMAL") - 1.0 if each.shaded else None
    moved = _moved(each.mesh, mesh, rest, np.asarray(there @ np.linalg.inv(linear).T, dtype=np.float64), frame)
    if shading is None:
        return moved
    across = linear.T @ linear  # Blender takes them out of the world as if they were directions
    return replace(moved, normals=_normals(each.mesh, moved, shading @ across))


def _moved(mesh: bpy.types.Mesh, shape: Mesh, rest: Floats, seen: Doubles, frame: _Frame) -> Mesh:
    """The shape with each vertex moved as its corners are; where those of one vertex come apart, as Cycles before
    Blender 5.2 has it at sharp edges, each corner becomes a vertex.

    rest: (V, 3), where the vertices were. seen: (L, 3), where Cycles has the corners, in the frame.
    """
    corners = corners_of(mesh)
    vertex_of = vertices_of(mesh, np.arange(len(mesh.loops), dtype=np.int32))
    still = frame.within(rest)[vertex_of]
    own, sure = _unnudged(seen, still, corners)
    moves = (own - still) / frame.factor
    by_vertex = np.zeros((len(rest), 3))
    for those in (slice(None), sure):  # the first corner counts, of the sure ones where there are any
        by_vertex[vertex_of[those][::-1]] = moves[those][::-1]
    rounding = 32.0 * np.finfo(np.float32).eps * np.maximum(np.abs(seen), 1.0) / frame.factor
    apart = np.abs(moves - by_vertex[vertex_of]) > _APART * np.abs(moves).max(initial=0.0) + rounding
    if not apart[sure].any():
        return replace(shape, vertices=(rest + by_vertex).astype(np.float32))
    return replace(shape, vertices=(rest[vertex_of] + moves).astype(np.float32), triangles=corners)


def _unnudged(seen: Doubles, start: Doubles, corners: Ints) -> tuple[Doubles, Flags]:
    """(L, 3): the corners' own places, from those seen, and (L,) bool: which of them are surely so.

    What is seen off because of the nudge is taken back, again and again, from where the corners were. The more of the
    way to the middle of its triangle a corner is nudged, the less can be told of it alone: at last it moves as the
    triangle does. In a triangle without area Cycles looks anywhere.
    """
    triangle_of = np.zeros(len(seen), dtype=np.int64)
    numbers = np.arange(len(corners), dtype=np.int64)
    triangle_of[corners[::-1].reshape(-1)] = np.repeat(numbers[::-1], 3)  # the first one is looked at
    own, sure = start, np.ones(len(seen), dtype=np.bool_)
    for turn in range(_ROUNDS):
        inwards = own[corners].mean(axis=1)[triangle_of] - own
        reach = np.maximum(np.linalg.norm(inwards, axis=1), np.finfo(np.float64).tiny)
        share = np.minimum(_NUDGE * np.maximum(np.abs(own).max(axis=1), 1.0) / reach, 1.0)[:, np.newaxis]
        own = own + (1.0 if turn == 0 else 1.0 - share) * (seen - own - share * inwards)
        sure &= share[:, 0] < _SURE
    a, b, c = (own[corners[:, corner]] for corner in range(3))
    long = np.maximum(((b - a) ** 2).sum(axis=1), ((c - a) ** 2).sum(axis=1))
    wide = np.linalg.norm(np.cross(b - a, c - a), axis=1) > _SLIM * long
    return own, sure & wide[triangle_of]


def _normals(mesh: bpy.types.Mesh, moved: Mesh, shading: Doubles) -> Floats | None:
    """(T, 3, 3) unit normals of triangles' corners from those of corners, (L, 3); None where all faces are flat."""
    if flat_triangles(mesh).all() and not mesh.has_custom_normals:
        return None
    lengths = np.linalg.norm(shading, axis=1, keepdims=True)
    unit: Floats = (shading / np.where(lengths > 0.0, lengths, 1.0)).astype(np.float32)
    normals: Floats = unit[corners_of(mesh)]
    flatten(mesh, normals, moved.vertices, moved.triangles)
    return normals


def _of_corners(
    scene: bpy.types.Scene, obj: bpy.types.Object, each: Undisplaced, kind: Literal["POSITION", "NORMAL"]
) -> Doubles:
    """(L, 3) float64: what Cycles has a little inside of a mesh's corners, places in world space, normals as colours.
    Raises InputError where it gives up."""
    with bake_override(bpy.context, obj, scene, scene.view_layers[0]):
        run_operator(
            each.owner,
            "displace it",
            "displacing it",
            type=kind,
            target="VERTEX_COLORS",
            save_mode="INTERNAL",
            use_selected_to_active=False,
            normal_space="OBJECT",
            normal_r="POS_X",
            normal_g="POS_Y",
            normal_b="POS_Z",
        )
    attribute: Any = each.mesh.color_attributes.active_color
    return values_of(attribute.data, "color", len(each.mesh.loops), 4)[:, :3].astype(np.float64)


@contextmanager
def _object(scene: bpy.types.Scene, each: Undisplaced, frame: _Frame) -> Iterator[bpy.types.Object]:
    """An object of the mesh in its frame, with colours to bake into. The matrix hangs on a parent's inverse, the one
    place where Blender keeps a shear."""
    with ExitStack() as stack:
        obj, parent = (bpy.data.objects.new(_NAME, data) for data in (each.mesh, None))
        for made in (obj, parent):
            stack.callback(bpy.data.objects.remove, made)
            scene.collection.objects.link(made)
        obj.parent, obj.matrix_parent_inverse = parent, Matrix(frame.matrix.tolist())
        colours: Any = each.mesh.color_attributes
        colours.active_color = colours.new(_NAME, "FLOAT_COLOR", "CORNER")
        _put_into(frame, obj, each.mesh)
        yield obj


def _put_into(frame: _Frame, obj: bpy.types.Object, mesh: Any) -> None:
    """Generated coordinates are of the shape before it was deformed; in a copy, that takes a shape key."""
    deformed, rest = positions_of(mesh), values_of(mesh.vertices, "undeformed_co", len(mesh.vertices), 3)
    mesh.texspace_location = frame.within(mesh.texspace_location).tolist()
    mesh.texspace_size = (frame.factor * np.array(mesh.texspace_size)).tolist()
    mesh.attributes["position"].data.foreach_set("vector", frame.within(rest).astype(np.float32).reshape(-1))
    if np.array_equal(deformed, rest):
        return
    obj.shape_key_add(name="Rest")
    key: Any = obj.shape_key_add(name="Deformed")
    key.data.foreach_set("co", frame.within(deformed).astype(np.float32).reshape(-1))
    key.value = 1.0


@contextmanager
def _materials(mesh: Any, movers: Movers, factor: float) -> Iterator[None]:
    """Copies of the materials that displace in the mesh's slots, for the time."""
    with ExitStack() as stack:
        copies: dict[MaterialDisplacement | None, bpy.types.Material | None] = {None: None}
        for mover in movers:
            if mover is not None and mover not in copies:
                copies[mover] = copy = _bare(mover.material, factor)
                stack.callback(bpy.data.materials.remove, copy)
        for slot, mover in zip_longest(range(len(mesh.materials)), movers):
            if slot is None:
                mesh.materials.append(copies[mover])
            else:
                mesh.materials[slot] = copies[mover]
        yield


def _bare(material: bpy.types.Material, factor: float) -> bpy.types.Material:
    """A copy that displaces, by so many times as much, and neither bumps nor shades."""
    copy = material.copy()
    copy.displacement_method = "DISPLACEMENT"
    tree: Tree = copy.node_tree
    output: Node = tree.get_output_node("CYCLES")
    grown: Node = tree.nodes.new("ShaderNodeVectorMath")
    grown.operation = "SCALE"
    grown.inputs["Scale"].default_value = factor
    tree.links.new(output.inputs["Displacement"].links[0].from_socket, grown.inputs[0])
    tree.links.new(grown.outputs[0], output.inputs["Displacement"])
    for socket in (output.inputs["Surface"], output.inputs["Volume"]):
        for link in socket.links:
            tree.links.remove(link)
    return copy

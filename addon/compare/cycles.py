"""The same bake by Cycles, on the CPU, for a comparison: every setting that would tell the two apart is matched.

Everything is borrowed. Materials are baked through copies that hang in the object's own slots for the time, so that an
alpha still lets light through while no material, shared or linked, is touched.
"""

from __future__ import annotations

import time
from collections.abc import Collection, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from typing import Any

import bpy
import numpy as np
from mathutils import Matrix
from numpy.typing import NDArray

from ...core.base.errors import InputError
from ...core.scene.scene import Floats, Instance
from ..read.scene_reader import bake_override, borrow, object_mode, passing_object, silenced, synced

UNLIMITED = 1e20  # farther than any scene; Cycles takes 0 for all open, and has no setting for none
# How the bake operator fills an image of ours: its active one, as it is, no margin.
INTO_IMAGE: Any = {
    "target": "IMAGE_TEXTURES",
    "save_mode": "INTERNAL",
    "margin": 0,
    "use_clear": False,
    "use_selected_to_active": False,
    "use_split_materials": False,
}
UNTOUCHED = -1.0  # no occlusion value: what a texel still holds that Cycles did not bake


@dataclass(frozen=True, eq=False)
class CyclesBake:
    """values: (h, w) float32 visibility, row 0 the top, 0 where not covered. coverage: (h, w) bool, the texels Cycles
    baked. seconds: the bake operator alone, its scene export among them."""

    values: Floats
    coverage: NDArray[np.bool_]
    seconds: float


def bake_ao(
    context: bpy.types.Context,
    object_name: str,
    size: tuple[int, int],
    samples: int,
    distance: float | None,
    threads: int,
    seed: int,
    uv: str | None = None,
    hidden: Collection[str] = (),
    ground: Instance | None = None,
) -> CyclesBake:
    """Bake the object's ambient occlusion with Cycles and put everything back, also after a failure.

    size: width and height in texels. distance: rays end there, in scene units; None for no limit. uv: the UV map, by
    default the active one. hidden: objects that occlude nothing, nor do instances of them. ground: occludes beside what
    is in the scene. Raises InputError, a line naming the object, where Cycles refuses or is not enabled.
    """
    obj = _object(context, object_name, uv)
    with ExitStack() as stack:
        stack.enter_context(object_mode(context))
        stack.enter_context(silenced("object_bake_pre", "object_bake_complete", "object_bake_cancel"))
        image = stack.enter_context(_image(size))
        world = stack.enter_context(_world(UNLIMITED if distance is None else distance))
        stack.enter_context(_local_mesh(obj))
        stack.enter_context(_materials(obj, image))
        if ground is not None:
            stack.enter_context(_standing(context.scene, ground))
        for name in hidden:
            borrow(stack, context.view_layer.objects[name], visible_shadow=False)
        _match(stack, context.scene, obj, samples, threads, seed)
        borrow(stack, context.scene, world=world)
        stack.enter_context(bake_override(context, obj, context.scene, context.view_layer))
        seconds = _bake(obj, uv)
        values = _pixels(image)
    coverage = values != UNTOUCHED
    return CyclesBake(np.where(coverage, values, np.float32(0.0)), coverage, seconds)


def _object(context: bpy.types.Context, name: str, uv: str | None) -> bpy.types.Object:
    obj = synced(context.view_layer).get(name)
    if obj is None or obj.type != "MESH":
        raise InputError(f"{name}: no such mesh object in the view layer; check the name")
    if obj.library is not None:
        raise InputError(f"{name}: Cycles bakes no object linked from a library; make it local first")
    if uv is not None and uv not in obj.data.uv_layers:
        raise InputError(
            f"{name}: Cycles bakes onto maps of the mesh itself, and it has none named {uv}; choose another"
        )
    return obj


def _match(
    stack: ExitStack, scene: bpy.types.Scene, obj: bpy.types.Object, samples: int, threads: int, seed: int
) -> None:
    """Cycles' settings for a plain mean of `samples` rays a texel, on as many threads as ours."""
    _choose_cycles(stack, scene, obj.name)
    borrow(stack, scene.render, threads_mode="FIXED", threads=threads, use_motion_blur=False)
    borrow(stack, scene.render, use_bake_multires=False)
    borrow(stack, scene.render.bake, use_multires=False)
    borrow(stack, obj, shadow_terminator_geometry_offset=0.0, hide_viewport=False)
    cycles = scene.cycles
    borrow(stack, cycles, device="CPU", shading_system=False, samples=samples, seed=seed, use_animated_seed=False)
    borrow(stack, cycles, use_adaptive_sampling=False, time_limit=0.0, use_layer_samples="IGNORE")
    borrow(stack, cycles, sample_offset=0, use_sample_subset=False, use_pixel_jitter=True)
    borrow(stack, cycles, auto_scrambling_distance=False, scrambling_distance=1.0)
    borrow(stack, cycles, transparent_max_bounces=1024)  # ours goes through any number of cut layers


def _choose_cycles(stack: ExitStack, scene: bpy.types.Scene, name: str) -> None:
    try:
        borrow(stack, scene.render, engine="CYCLES")
    except TypeError as error:
        raise InputError(
            f"{name}: cannot be compared without Cycles; enable Cycles in Preferences > Add-ons"
        ) from error


def _bake(obj: bpy.types.Object, uv: str | None) -> float:
    """Run the operator and return its seconds. The image keeps what it holds where Cycles bakes nothing."""
    start = time.perf_counter()
    try:
        outcome = bpy.ops.object.bake(
            type="AO",
            **INTO_IMAGE,
            uv_layer=uv or "",
        )
    except RuntimeError as error:
        raise InputError(f"{obj.name}: Cycles cannot bake it: {_one_line(error)}") from error
    seconds = time.perf_counter() - start
    if outcome != {"FINISHED"}:
        raise InputError(f"{obj.name}: Cycles gave up the bake without a reason; see Blender's console")
    return seconds


def _one_line(error: Exception) -> str:
    return " ".join(str(error).removeprefix("Error: ").split())


def _pixels(image: bpy.types.Image) -> Floats:
    width, height = image.size
    pixels = np.empty((height, width, 4), dtype=np.float32)
    image.pixels.foreach_get(pixels.reshape(-1))
    return np.ascontiguousarray(pixels[::-1, :, 0])


@contextmanager
def _image(size: tuple[int, int]) -> Iterator[bpy.types.Image]:
    """A float image of plain data, full of a value that no bake can give: at margin 0 Cycles' alpha is 1 everywhere."""
    image = bpy.data.images.new("Occlusion Bake", *size, alpha=True, float_buffer=True, is_data=True)
    try:
        image.pixels.foreach_set(np.full(4 * size[0] * size[1], UNTOUCHED, dtype=np.float32))
        yield image
    finally:
        bpy.data.images.remove(image)


@contextmanager
def _world(distance: float) -> Iterator[bpy.types.World]:
    """A world of our own for the distance limit: the scene's may be missing, shared or linked."""
    world = bpy.data.worlds.new("Occlusion Bake")
    try:
        world.light_settings.distance = distance
        yield world
    finally:
        bpy.data.worlds.remove(world)


@contextmanager
def _standing(scene: bpy.types.Scene, instance: Instance) -> Iterator[None]:
    """A mesh of the core's as an object of the scene, for the time."""
    mesh = bpy.data.meshes.new(instance.name)
    mesh.from_pydata(instance.mesh.vertices.tolist(), [], instance.mesh.triangles.tolist())
    with passing_object(scene, mesh) as obj:
        obj.matrix_world = Matrix(instance.matrix.tolist())
        yield


@contextmanager
def _local_mesh(obj: bpy.types.Object) -> Iterator[None]:
    """A local copy in place of a mesh linked from a library, which Cycles would refuse."""
    if obj.data.library is None:
        yield
        return
    with ExitStack() as stack:
        copy = obj.data.copy()
        stack.callback(bpy.data.meshes.remove, copy)
        borrow(stack, obj, data=copy)
        yield


@contextmanager
def _materials(obj: bpy.types.Object, image: bpy.types.Image) -> Iterator[None]:
    """Hang a copy of each material, with our image for its active texture, in the slots; the mesh keeps its own."""
    made: dict[str, bpy.types.Material] = {}
    with ExitStack() as stack:
        stack.callback(lambda: [bpy.data.materials.remove(material) for material in made.values()])
        if not obj.material_slots:
            obj.data.materials.append(None)
            stack.callback(obj.data.materials.clear)
        for slot in obj.material_slots:
            key = slot.material.name_full if slot.material else ""
            if key not in made:
                made[key] = with_texture(slot.material, image)
            borrow(stack, slot, link="OBJECT")
            borrow(stack, slot, material=made[key])
        yield


def with_texture(material: bpy.types.Material | None, image: bpy.types.Image) -> bpy.types.Material:
    """A local copy of the material, or a plain one where there are no nodes, with the image active in its tree."""
    if material is None or not _has_nodes(material):
        copy = bpy.data.materials.new("Occlusion Bake")
        if bpy.app.version < (5, 0):  # later always so
            copy.use_nodes = True
    else:
        copy = material.copy()
    nodes = copy.node_tree.nodes
    texture: Any = nodes.new("ShaderNodeTexImage")
    texture.image = image
    nodes.active = texture
    return copy


def _has_nodes(material: bpy.types.Material) -> bool:
    return material.node_tree is not None and (bpy.app.version >= (5, 0) or material.use_nodes)

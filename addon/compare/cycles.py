"""The same bake by Cycles, on the CPU, for a comparison: every setting that would tell the two apart is matched.

Everything is borrowed. Materials are baked through copies that hang in the object's own slots for the time, so that an
alpha still lets light through while no material, shared or linked, is touched.
"""

from __future__ import annotations

import time
from collections.abc import Collection, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from typing import Any

import bpy
import numpy as np
from mathutils import Matrix

from ...core.base.arrays import Flags, Floats, Ints
from ...core.base.errors import InputError
from ...core.charts.udim import corner_of
from ...core.scene.scene import Instance
from ..read.bake_operator import INTO_IMAGE, run_operator, with_texture
from ..read.blender_state import (
    bake_override,
    object_mode,
    passing_object,
    silenced,
    synced,
    temporary_attributes,
    temporary_engine,
)
from ..read.block_ref import find, refs_of
from ..typed import library_of, mesh_of, pixels_in, scene_in, view_layer_in

UNLIMITED = 1e20  # farther than any scene; Cycles takes 0 for all open, and has no setting for none
UNTOUCHED = -1.0  # no occlusion value: what a texel still holds that Cycles did not bake


@dataclass(frozen=True, eq=False)
class CyclesBake:
    """values: (h, w) float32 visibility, row 0 the top, 0 where not covered. coverage: (h, w) bool, the texels Cycles
    baked. seconds: the bake operator alone, its scene export among them."""

    values: Floats
    coverage: Flags
    seconds: float


@dataclass(frozen=True)
class CyclesSettings:
    """size: width and height in texels. distance: rays end there, in scene units; None for no limit."""

    size: tuple[int, int]
    samples: int
    distance: float | None
    threads: int
    seed: int


@dataclass(frozen=True, eq=False)
class Surroundings:
    """Who occludes. hidden: objects that occlude nothing, nor do instances of them. ground: occludes beside what is in
    the scene."""

    hidden: Collection[bpy.types.Object] = ()
    ground: Instance | None = None


WHOLE_SCENE = Surroundings()


def bake_ao(
    context: bpy.types.Context,
    obj: bpy.types.Object,
    settings: CyclesSettings,
    uv: str | None = None,
    *,
    around: Surroundings = WHOLE_SCENE,
    tile: int | None = None,
) -> CyclesBake:
    """Bake the object's ambient occlusion with Cycles and put everything back, also after a failure.

    uv: the UV map, by default the active one. tile: of a UDIM layout, None for the unit square. Raises InputError, a
    line naming the object, where Cycles refuses or is not enabled.
    """
    _check(context, obj, uv)
    with set_up(context, obj.name, settings, around) as (stack, image):
        stack.enter_context(_own_mesh(obj))
        stack.enter_context(_materials(obj, image))
        if tile is not None:
            stack.enter_context(_moved_from(tile, obj, uv))
        seen_as_it_is(stack, obj)
        stack.enter_context(bake_override(context, obj, scene_in(context), view_layer_in(context)))
        seconds = run_bake(obj.name, uv_layer=uv or "")
        return baked_into(image, seconds)


@contextmanager
def set_up(
    context: bpy.types.Context, name: str, settings: CyclesSettings, around: Surroundings
) -> Iterator[tuple[ExitStack, bpy.types.Image]]:
    """All but the object for a bake into an image, which is given, as is what puts everything back. name: of what is
    baked, for messages."""
    with ExitStack() as stack:
        stack.enter_context(object_mode(context))
        stack.enter_context(silenced("object_bake_pre", "object_bake_complete", "object_bake_cancel"))
        image = stack.enter_context(_image(settings.size))
        world = stack.enter_context(_world(UNLIMITED if settings.distance is None else settings.distance))
        scene = scene_in(context)
        if around.ground is not None:
            mesh = new_mesh(around.ground.name, around.ground.mesh.vertices, around.ground.mesh.triangles)
            ground = stack.enter_context(passing_object(scene, mesh))
            ground.matrix_world = Matrix(around.ground.matrix.tolist())
        for hidden in around.hidden:
            temporary_attributes(stack, hidden, visible_shadow=False)
        _match(stack, scene, name, settings)
        temporary_attributes(stack, scene, world=world)
        yield stack, image


def seen_as_it_is(stack: ExitStack, obj: bpy.types.Object) -> None:
    """A surface that is baked: rays start on it, and not off smooth low-poly faces."""
    temporary_attributes(stack, obj, shadow_terminator_geometry_offset=0.0, hide_viewport=False)


def _check(context: bpy.types.Context, obj: bpy.types.Object, uv: str | None) -> None:
    (ref,) = refs_of([obj])
    if find(synced(view_layer_in(context)), ref) is None or obj.type != "MESH":
        raise InputError(f"{ref.label}: no such mesh object in the view layer; include its collection")
    if library_of(obj) is not None:
        raise InputError(f"{ref.label}: Cycles bakes no object linked from a library; make it local first")
    if uv is not None and uv not in mesh_of(obj).uv_layers:
        raise InputError(
            f"{ref.label}: Cycles bakes onto maps of the mesh itself, and it has none named {uv}; choose another"
        )


def _match(stack: ExitStack, scene: bpy.types.Scene, name: str, settings: CyclesSettings) -> None:
    """Cycles' settings for a plain mean of so many rays a texel, on as many threads as ours."""
    _choose_cycles(stack, scene, name)
    temporary_attributes(stack, scene.render, threads_mode="FIXED", threads=settings.threads, use_motion_blur=False)
    temporary_attributes(stack, scene.render, use_bake_multires=False)
    temporary_attributes(stack, scene.render.bake, use_multires=False)
    cycles = scene.cycles
    temporary_attributes(
        stack,
        cycles,
        device="CPU",
        shading_system=False,
        samples=settings.samples,
        seed=settings.seed,
        use_animated_seed=False,
    )
    temporary_attributes(stack, cycles, use_adaptive_sampling=False, time_limit=0.0, use_layer_samples="IGNORE")
    temporary_attributes(stack, cycles, sample_offset=0, use_sample_subset=False, use_pixel_jitter=True)
    temporary_attributes(stack, cycles, auto_scrambling_distance=False, scrambling_distance=1.0)
    temporary_attributes(stack, cycles, transparent_max_bounces=1024)  # ours goes through any number of cut layers


def _choose_cycles(stack: ExitStack, scene: bpy.types.Scene, name: str) -> None:
    try:
        stack.enter_context(temporary_engine(scene, "CYCLES"))
    except TypeError as error:
        raise InputError(
            f"{name}: cannot be compared without Cycles; enable Cycles in Preferences > Add-ons"
        ) from error


def run_bake(name: str, **options: Any) -> float:
    """Run the operator and return its seconds. The image keeps what it holds where Cycles bakes nothing.

    name: of what is baked, for messages. options: of the operator. Raises InputError.
    """
    start = time.perf_counter()
    run_operator(name, "bake it", "the bake", type="AO", **{**INTO_IMAGE, **options})
    return time.perf_counter() - start


def baked_into(image: bpy.types.Image, seconds: float) -> CyclesBake:
    """What the bake has left in the image."""
    values = _pixels(image)
    coverage = values != UNTOUCHED
    return CyclesBake(np.where(coverage, values, np.float32(0.0)), coverage, seconds)


def _pixels(image: bpy.types.Image) -> Floats:
    width, height = image.size
    pixels = np.empty((height, width, 4), dtype=np.float32)
    pixels_in(image).foreach_get(pixels.reshape(-1))
    return np.ascontiguousarray(pixels[::-1, :, 0])


@contextmanager
def _image(size: tuple[int, int]) -> Iterator[bpy.types.Image]:
    """A float image of plain data, full of a value that no bake can give: at margin 0 Cycles' alpha is 1 everywhere."""
    image = bpy.data.images.new("Occlusion Bake", *size, alpha=True, float_buffer=True, is_data=True)
    try:
        pixels_in(image).foreach_set(np.full(4 * size[0] * size[1], UNTOUCHED, dtype=np.float32))
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


def new_mesh(name: str, vertices: Floats, triangles: Ints) -> bpy.types.Mesh:
    """Of plain arrays: (V, 3) float32 and (T, 3) int32."""
    mesh = bpy.data.meshes.new(name)
    mesh.vertices.add(len(vertices))
    mesh.vertices.foreach_set("co", np.ascontiguousarray(vertices).reshape(-1))
    mesh.loops.add(triangles.size)
    mesh.loops.foreach_set("vertex_index", np.ascontiguousarray(triangles).reshape(-1))
    mesh.polygons.add(len(triangles))
    mesh.polygons.foreach_set("loop_start", np.arange(0, triangles.size, 3, dtype=np.int32))
    mesh.update(calc_edges=True)
    return mesh


@contextmanager
def _moved_from(tile: int, obj: bpy.types.Object, uv: str | None) -> Iterator[None]:
    """Its UVs as a tile of theirs has them, after all that modifiers do; Cycles bakes into the unit square alone."""
    warp: Any = obj.modifiers.new("Occlusion Bake", "UV_WARP")
    try:
        column, row = corner_of(tile)
        warp.uv_layer, warp.offset = uv or "", (-column, -row)
        yield
    finally:
        obj.modifiers.remove(warp)


@contextmanager
def _own_mesh(obj: bpy.types.Object) -> Iterator[None]:
    """A copy in place of a mesh linked from a library, which Cycles would refuse, and of one without material slots:
    to take away one that it was given would forget which slot each face has."""
    if library_of(mesh_of(obj)) is None and obj.material_slots:
        yield
        return
    with ExitStack() as stack:
        copy = mesh_of(obj).copy()
        stack.callback(bpy.data.meshes.remove, copy)
        temporary_attributes(stack, obj, data=copy)
        yield


@contextmanager
def _materials(obj: bpy.types.Object, image: bpy.types.Image) -> Iterator[None]:
    """Hang a copy of each material, with our image for its active texture, in the slots; the mesh keeps its own."""
    made: dict[int, bpy.types.Material] = {}
    with ExitStack() as stack:
        stack.callback(_remove_all, made)
        if not obj.material_slots:
            mesh_of(obj).materials.append(None)
        for slot in obj.material_slots:
            key = slot.material.session_uid if slot.material else 0
            if key not in made:
                made[key] = with_texture(slot.material, image)
            temporary_attributes(stack, slot, link="OBJECT")
            temporary_attributes(stack, slot, material=made[key])
        yield


def _remove_all(materials: Mapping[int, bpy.types.Material]) -> None:
    for material in materials.values():
        bpy.data.materials.remove(material)

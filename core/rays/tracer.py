"""Rays from texels: arrays in, sums out."""

from __future__ import annotations

import ctypes
from collections.abc import Sequence
from ctypes import byref, c_void_p
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..base import kernel_api as api
from ..base.arrays import Floats, Longs
from ..scene.scene import Camera
from ..spherical.environment import Environment
from .map_spec import MapSpec, count_images
from .ray_options import ALL_OCCLUDERS, RayOptions
from .texel_surface import TexelSurface
from .trace_scene import TraceScene

CHUNK_RAYS = 256  # the kernel traces all texels' first so many rays, tile by tile, before it goes on
BLOCK = 4  # texels along a block's side: a packet's sixteen


@dataclass(frozen=True)
class TraceOptions:
    """How to trace. count: rays of each texel and map. threads 0: all. packet_width 0: the device's native one.

    camera: in the frame of the scene. coherent: whether rays side by side mostly meet the same triangles; for speed, it
    changes no value but for rounding. occlusion: what counts as an occluder. light: what maps of light see.
    """

    count: int
    seed: int = 0
    occlusion: RayOptions = ALL_OCCLUDERS
    threads: int = 0
    packet_width: int = 0
    camera: Camera | None = None
    coherent: bool = True
    light: Environment | None = None


@dataclass(frozen=True, eq=False)
class Sums:
    """What tracing brings: of each spec as many images as its accumulator has, one after the other.

    all: (M, H, W) float32, or (M, N) of listed texels, the sum over the rays; -1 where the texel faces away from the
    camera, 0 where it has no owner. first_half: the same over the first count // 2 rays, None if not asked for.
    """

    all: Floats
    first_half: Floats | None


def trace(
    scene: TraceScene,
    surface: TexelSurface,
    specs: Sequence[MapSpec],
    options: TraceOptions,
    *,
    halves: bool = True,
    into: Floats | None = None,
    control: api.Control | None = None,
) -> Sums:
    """Trace every owned texel's rays. into: (M, H, W) float32 zeros for the sums, to be looked at while they fill.

    Same input and seed, same bits, whatever the number of threads. Raises Cancelled, MemoryError, InputError.
    """
    shape = (count_images(specs), *surface.owner.shape)
    sums = np.zeros(shape, dtype=np.float32) if into is None else into
    first_half = np.zeros(shape, dtype=np.float32) if halves else None
    halves_rows = None if first_half is None else _rows(first_half, *shape)
    described = surface.described()
    api.check(
        api.library().ob_trace(
            *_what(scene, described, specs, options), _rows(sums, *shape), halves_rows, api.pointer_to(control)
        )
    )
    return Sums(sums, first_half)


def trace_texels(
    scene: TraceScene,
    surface: TexelSurface,
    texels: Longs,
    specs: Sequence[MapSpec],
    options: TraceOptions,
    *,
    control: api.Control | None = None,
) -> Sums:
    """Trace the rays of a list of owned texels (y · W + x); one that stands in it twice gets other rays each time.

    The sums are (M, len(texels)), a row an image. Raises as `trace`.
    """
    shape = (count_images(specs), len(texels))
    sums = np.zeros(shape, dtype=np.float32)
    described = surface.described()
    listed = (api.address(texels, np.int64, len(texels)), len(texels))
    api.check(
        api.library().ob_trace_texels(
            *_what(scene, described, specs, options),
            *listed,
            _rows(sums, *shape),
            None,
            api.pointer_to(control),
        )
    )
    return Sums(sums, None)


def trace_blocks(
    scene: TraceScene,
    surface: TexelSurface,
    blocks: Longs,
    before: int,
    specs: Sequence[MapSpec],
    options: TraceOptions,
    *,
    control: api.Control | None = None,
) -> Sums:
    """Trace rays of the texels of blocks of 4 x 4, numbered row by row: those after the first `before` of the sequence
    that each texel has by its place and the seed, and of which `trace` takes the first ones. Rounds that go on where
    others ended complete them.

    The sums are (M, len(blocks), 16), texels in Morton order, 0 where there is no owner; those of the first half are
    over what of these rays is of the first half of before + count. Raises as `trace`.
    """
    sums, first_half = (np.zeros((count_images(specs), len(blocks), BLOCK**2), dtype=np.float32) for _ in range(2))
    described = surface.described()
    api.check(
        api.library().ob_trace_blocks(
            *_what(scene, described, specs, options),
            api.address(blocks, np.int64, len(blocks)),
            len(blocks),
            before,
            _rows(sums, *sums.shape),
            _rows(first_half, *sums.shape),
            api.pointer_to(control),
        )
    )
    return Sums(sums, first_half)


def trace_cells(
    scene: TraceScene,
    surface: TexelSurface,
    texels: Longs,
    tangents: Floats,
    side: int,
    options: TraceOptions,
    *,
    control: api.Control | None = None,
) -> Floats:
    """How open the cells of the hemisphere are, of listed owned texels: (N, side, side) float32, the mean of V.

    tangents: (N, 4) float32, the direction of u and the sign of the bitangent. side: 8 or 16; options.count: a power of
    two, one a cell at least. The cells' convention stands in hemisphere_cells.py. Raises as `trace`.
    """
    cells = np.zeros((len(texels), side, side), dtype=np.float32)
    described = surface.described()
    count = len(texels)
    listed = (api.address(texels, np.int64, count), count, api.address(tangents, np.float32, count, 4), side)
    place = api.address(cells, np.float32, count, side, side)
    status = api.library().ob_trace_cells(
        scene.handle, byref(described), byref(_settings(options)), *listed, place, api.pointer_to(control)
    )
    api.check(status)
    return cells


def _what(
    scene: TraceScene, described: api.Surface, specs: Sequence[MapSpec], options: TraceOptions
) -> tuple[Any, ...]:
    """The arguments that all tracing begins with."""
    cosine = options.occlusion.lobe_cosine
    maps = (api.Map * len(specs))(
        *(api.Map(e.sampler, e.axis, e.exponent, cosine, e.lobe_share, e.accumulator) for e in specs)
    )
    return scene.handle, byref(described), byref(_settings(options)), maps, len(specs)


def _light(environment: Environment | None) -> Any:
    """A pointer to it as the kernel takes it, which keeps what it points to; the environment keeps the arrays."""
    if environment is None:
        return None
    sampling = environment.sampling
    size = len(environment.radiance)
    arrays = (
        api.address(environment.radiance, np.float32, size, size, 3),
        api.address(sampling.density, np.float32, size, size),
        api.address(sampling.rows, np.float32, size),
        api.address(sampling.columns, np.float32, size, size),
    )
    return ctypes.pointer(api.Light(*arrays, size))


def _settings(options: TraceOptions) -> api.TraceSettings:
    vector = ctypes.c_float * 3
    camera = options.camera or Camera((0.0, 0.0, 0.0), (0.0, 0.0, -1.0))
    return api.TraceSettings(
        options.count,
        options.threads,
        options.packet_width,
        int(camera.orthographic),
        options.seed & 0xFFFFFFFFFFFFFFFF,
        options.occlusion.reach,
        vector(*camera.position),
        vector(*camera.forward),
        int(not options.coherent),
        options.occlusion.nearest,
        int(options.occlusion.falloff),
        _light(options.light),
    )


def _rows(images: Floats, *shape: int) -> ctypes.Array[c_void_p]:
    """The addresses of the images in an array of this shape."""
    api.address(images, np.float32, *shape)
    return (c_void_p * len(images))(*(api.address(image, np.float32, *shape[1:]) for image in images))

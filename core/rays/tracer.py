"""Scenes and rays: the kernel's handles as Python objects, arrays in and arrays out."""

from __future__ import annotations

import ctypes
import math
from collections.abc import Sequence
from ctypes import byref, c_void_p
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..base.errors import InputError
from ..scene.scene import Camera, Doubles, Floats, Ints, Placed
from . import kernel_api as api
from .embree import Device
from .map_spec import Estimator, Falloff

if TYPE_CHECKING:
    from ..scene.cutout import Cutout
    from ..spherical.environment import Environment


@dataclass(frozen=True, eq=False)
class Through:
    """What a mesh lets through: the clear parts of a cutout, and rays that come from behind its triangles."""

    cutout: Cutout | None = None
    front_only: bool = False


OPAQUE = Through()


class Geometry:
    """Triangles in a tree of their own, to be instanced. vertices (V, 3) float32, triangles (T, 3) int32."""

    def __init__(
        self,
        device: Device,
        vertices: Floats,
        triangles: Ints,
        control: api.Control | None = None,
        through: Through = OPAQUE,
    ) -> None:
        self.device, self.through = device, through  # the kernel reads the cutout's arrays where they are
        self.handle = c_void_p()
        mesh = (*_mesh(vertices, triangles), *_through(through, len(triangles)))
        status = api.library().ob_mesh_build(device.handle, *mesh, pointer_to(control), byref(self.handle))
        api.check(status)
        api.release_with(self, "ob_mesh_free", self.handle)


class TraceScene:
    """Everything that blocks rays, in one frame. Fill it, `commit` once, trace as often as wanted."""

    def __init__(self, device: Device) -> None:
        self.device = device
        self.handle = c_void_p()
        api.check(api.library().ob_scene_begin(device.handle, byref(self.handle)))
        api.release_with(self, "ob_scene_free", self.handle)
        self._count = 0
        self._kept: list[Through] = []  # the kernel reads their arrays where they are

    def add(self, vertices: Floats, triangles: Ints, through: Through = OPAQUE) -> int:
        """Triangles in the scene's frame: (V, 3) float32 and (T, 3) int32. Returns their number in it, -1 for none."""
        if not len(triangles):
            return -1
        mesh = (*_mesh(vertices, triangles), *_through(through, len(triangles)))
        api.check(api.library().ob_scene_add_triangles(self.handle, *mesh))
        self._kept.append(through)
        self._count += 1
        return self._count - 1

    def add_instances(self, geometry: Geometry, matrices: Doubles) -> None:
        """The geometry under each of (N, 3, 4) matrices, mesh to scene."""
        rows = np.ascontiguousarray(matrices, dtype=np.float32)
        status = api.library().ob_scene_add_instances(
            self.handle, geometry.handle, api.address(rows, np.float32), len(rows)
        )
        api.check(status)
        self._kept.append(geometry.through)
        self._count += len(rows)

    def commit(self, control: api.Control | None = None) -> None:
        """Build the tree. Raises Cancelled, MemoryError."""
        api.check(api.library().ob_scene_commit(self.handle, pointer_to(control)))

    def visible(self, origins: Floats, directions: Floats, distance: float = np.inf) -> NDArray[np.bool_]:
        """V along rays: origins, directions (N, 3) float32 → (N,) bool, True where nothing is hit before distance."""
        answer = np.zeros(len(origins), dtype=np.uint8)
        pointer = answer.ctypes.data_as(ctypes.POINTER(ctypes.c_uint8))
        rays = (api.address(origins, np.float32), api.address(directions, np.float32), len(origins))
        api.check(api.library().ob_visible(self.handle, *rays, distance, pointer))
        return answer.astype(bool)

    def first_hits(
        self, origins: Floats, directions: Floats, lengths: Floats, threads: int = 0, control: api.Control | None = None
    ) -> Hits:
        """What rays meet first: origins, directions (N, 3) and lengths (N,), in lengths of the direction, float32.

        Raises Cancelled, InputError.
        """
        hits = np.empty(len(origins), dtype=_HIT)
        rays = (api.address(each, np.float32) for each in (origins, directions, lengths))
        where = (hits.ctypes.data, pointer_to(control))
        api.check(api.library().ob_first_hits(self.handle, *rays, len(origins), threads, *where))
        weights = np.stack([1.0 - hits["u"] - hits["v"], hits["u"], hits["v"]], axis=1)
        return Hits(hits["distance"].copy(), hits["geometry"].copy(), hits["triangle"].copy(), weights)


_HIT = np.dtype(
    [(name, np.float32) for name in ("distance", "u", "v")] + [("geometry", np.int32), ("triangle", np.int32)]
)


@dataclass(frozen=True, eq=False)
class Hits:
    """Where rays meet triangles. distance: (N,) float32 in lengths of the direction, inf for none. geometry, triangle:
    (N,) int32, the scene's number of what is met and the triangle of it, -1 for none. weights: (N, 3) float32 of the
    triangle's corners."""

    distance: Floats
    geometry: Ints
    triangle: Ints
    weights: Floats

    @property
    def met(self) -> NDArray[np.bool_]:
        """(N,) bool: rays that meet anything."""
        met: NDArray[np.bool_] = self.geometry >= 0
        return met


CHUNK_RAYS = 256  # the kernel traces all texels' first so many rays, tile by tile, before it goes on


@dataclass(frozen=True)
class Rays:
    """How to trace. distance: scene units, inf = no limit. threads 0: all. packet_width 0: the device's native one.

    coherent: whether rays side by side mostly meet the same triangles; for speed, it changes no value but for rounding.
    nearest: what is nearer does not block. falloff: of what is within the distance, which must then be finite. spread:
    degrees across the cone about a lobe's axis that its rays stay in. light: what maps of light see.
    """

    count: int
    seed: int = 0
    distance: float = np.inf
    threads: int = 0
    packet_width: int = 0
    camera: Camera | None = None  # in the frame of the scene
    coherent: bool = True
    nearest: float = 0.0
    falloff: Falloff = Falloff.NONE
    spread: float = 180.0
    light: Environment | None = None


@dataclass(frozen=True, eq=False)
class Sums:
    """What tracing brings: of each estimator as many images as it counts, one after the other.

    all: (M, H, W) float32, the sum over the rays; -1 where the texel faces away from the camera, 0 where it has no
    owner. first_half: the same over the first count // 2 rays, None if not asked for.
    """

    all: Floats
    first_half: Floats | None


def trace(
    scene: TraceScene,
    surface: Placed,
    owner: Ints,
    estimators: Sequence[Estimator],
    rays: Rays,
    *,
    halves: bool = True,
    into: Floats | None = None,
    control: api.Control | None = None,
) -> Sums:
    """Trace every owned texel's rays. owner: (H, W) int32, the surface's triangle a texel belongs to, -1 none. into:
    (M, H, W) float32 zeros for the sums, to be looked at while they fill.

    Same input and seed, same bits, whatever the number of threads. Raises Cancelled, MemoryError, InputError.
    """
    shape = (images_of(estimators), *owner.shape)
    sums = np.zeros(shape, dtype=np.float32) if into is None else into
    first_half = np.zeros(shape, dtype=np.float32) if halves else None
    described = describe_surface(surface, owner)
    halves_rows = None if first_half is None else _rows(first_half)
    what = _what(scene, described, estimators, rays)
    api.check(api.library().ob_trace(*what, _rows(sums), halves_rows, pointer_to(control)))
    return Sums(sums, first_half)


def trace_texels(
    scene: TraceScene,
    surface: Placed,
    owner: Ints,
    texels: NDArray[np.int64],
    estimators: Sequence[Estimator],
    rays: Rays,
    *,
    control: api.Control | None = None,
) -> Floats:
    """Trace the rays of a list of owned texels (y · W + x); one that stands in it twice gets other rays each time.

    Returns (M, len(texels)) float32, a row an estimator: sums as in `Sums.all`. Raises as `trace`.
    """
    sums = np.zeros((images_of(estimators), len(texels)), dtype=np.float32)
    described = describe_surface(surface, owner)
    what = _what(scene, described, estimators, rays)
    listed = (api.address(texels, np.int64), len(texels))
    api.check(api.library().ob_trace_texels(*what, *listed, _rows(sums), pointer_to(control)))
    return sums


def trace_cells(
    scene: TraceScene,
    surface: Placed,
    owner: Ints,
    texels: NDArray[np.int64],
    tangents: Floats,
    side: int,
    rays: Rays,
    *,
    control: api.Control | None = None,
) -> Floats:
    """How open the cells of the hemisphere are, of listed owned texels: (N, side, side) float32, the mean of V.

    tangents: (N, 4) float32, the direction of u and the sign of the bitangent. side: 8 or 16; rays: a power of two,
    one a cell at least. The cells' convention stands in hemisphere_cells.py. Raises as `trace`.
    """
    cells = np.zeros((len(texels), side, side), dtype=np.float32)
    described = describe_surface(surface, owner)
    listed = (api.address(texels, np.int64), len(texels), api.address(tangents, np.float32), side)
    status = api.library().ob_trace_cells(
        scene.handle, byref(described), byref(_settings(rays)), *listed, cells.ctypes.data, pointer_to(control)
    )
    api.check(status)
    return cells


def images_of(estimators: Sequence[Estimator]) -> int:
    """How many images the sums of these take."""
    return sum(each.counts.images for each in estimators)


def describe_surface(surface: Placed, owner: Ints) -> api.Surface:
    """The surface as the kernel takes it; the caller keeps the arrays alive."""
    return api.Surface(
        api.address(surface.vertices, np.float32),
        api.address(surface.triangles, np.int32),
        api.address(surface.uv, np.float32),
        api.address(surface.normals, np.float32),
        api.address(surface.texel_normals, np.float32),
        api.address(surface.faces, np.float32),
        api.address(surface.spacing, np.float32),
        api.address(owner, np.int32),
        len(surface.vertices),
        len(surface.triangles),
        owner.shape[1],
        owner.shape[0],
    )


def _what(scene: TraceScene, described: api.Surface, estimators: Sequence[Estimator], rays: Rays) -> tuple[Any, ...]:
    """The arguments that all tracing begins with."""
    cosine = math.cos(math.radians(0.5 * rays.spread)) if rays.spread < 180.0 else 0.0
    maps = (api.Map * len(estimators))(
        *(api.Map(e.sampler, e.axis, e.exponent, cosine, e.lobe_share, e.counts) for e in estimators)
    )
    return scene.handle, byref(described), byref(_settings(rays)), maps, len(estimators)


def _light(environment: Environment | None) -> Any:
    """A pointer to it as the kernel takes it, which keeps what it points to; the environment keeps the arrays."""
    if environment is None:
        return None
    sampling = environment.sampling
    arrays = (environment.radiance, sampling.density, sampling.rows, sampling.columns)
    return ctypes.pointer(api.Light(*(api.address(each, np.float32) for each in arrays), len(environment.radiance)))


def _settings(rays: Rays) -> api.TraceSettings:
    vector = ctypes.c_float * 3
    camera = rays.camera or Camera((0.0, 0.0, 0.0), (0.0, 0.0, -1.0))
    return api.TraceSettings(
        rays.count,
        rays.threads,
        rays.packet_width,
        int(camera.orthographic),
        rays.seed & 0xFFFFFFFFFFFFFFFF,
        rays.distance,
        vector(*camera.position),
        vector(*camera.forward),
        int(not rays.coherent),
        rays.nearest,
        int(rays.falloff),
        _light(rays.light),
    )


def _rows(images: Floats) -> ctypes.Array[c_void_p]:
    return (c_void_p * len(images))(*(image.ctypes.data for image in images))


def _mesh(vertices: Floats, triangles: Ints) -> tuple[int | None, int, int | None, int]:
    return api.address(vertices, np.float32), len(vertices), api.address(triangles, np.int32), len(triangles)


def _through(through: Through, triangles: int) -> tuple[Any, int]:
    """As the kernel takes it. Its arrays are not copied. Raises InputError for a cutout of another mesh."""
    cutout = through.cutout
    if cutout is None:
        return None, int(through.front_only)
    if len(cutout.alpha) != triangles:
        raise InputError(f"a cutout of {len(cutout.alpha)} triangles is laid over a mesh of {triangles}; make it anew")
    alphas = (api.Alpha * len(cutout.alphas))(
        *(
            api.Alpha(api.address(each.values, np.float32), *each.values.shape[::-1], int(each.linear), int(each.wrap))
            for each in cutout.alphas
        )
    )
    arrays = (api.address(cutout.uv, np.float32), api.address(cutout.alpha, np.int32))
    return ctypes.pointer(api.Cutout(*arrays, alphas, len(alphas))), int(through.front_only)


def pointer_to(control: api.Control | None) -> object:
    """A control as the kernel takes it."""
    return None if control is None else byref(control)

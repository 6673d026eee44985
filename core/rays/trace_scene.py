"""Scenes that rays are traced in: the kernel's handles as Python objects."""

from __future__ import annotations

import ctypes
from collections.abc import Sequence
from ctypes import byref, c_void_p
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..base import kernel_api as api
from ..base.arrays import Doubles, Flags, Floats, Ints
from ..base.errors import InputError
from ..scene.cutout import Cutout
from .embree import Device


@dataclass(frozen=True, eq=False)
class RayFilter:
    """What a mesh lets through: the clear parts of a cutout, and rays that come from behind its triangles."""

    cutout: Cutout | None = None
    front_only: bool = False


OPAQUE = RayFilter()


class Geometry:
    """Triangles in a tree of their own, to be instanced. vertices (V, 3) float32, triangles (T, 3) int32."""

    def __init__(
        self,
        device: Device,
        vertices: Floats,
        triangles: Ints,
        control: api.Control | None = None,
        ray_filter: RayFilter = OPAQUE,
    ) -> None:
        self.device, self.ray_filter = device, ray_filter  # the kernel reads the cutout's arrays where they are
        self.handle = c_void_p()
        mesh = (*_mesh(vertices, triangles), *_filter_of(ray_filter, len(triangles)))
        status = api.library().ob_mesh_build(device.handle, *mesh, api.pointer_to(control), byref(self.handle))
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
        self._whole: dict[int, Ints] = {}
        self._kept: list[RayFilter] = []  # the kernel reads their arrays where they are

    def add(self, vertices: Floats, triangles: Ints, ray_filter: RayFilter = OPAQUE, whole: Ints | None = None) -> int:
        """Triangles in the scene's frame: (V, 3) float32 and (T, 3) int32. Returns their number in it, -1 for none.

        whole: (T,) int32, which triangle each is a piece of, for those who ask what was hit.
        """
        if not len(triangles):
            return -1
        mesh = (*_mesh(vertices, triangles), *_filter_of(ray_filter, len(triangles)))
        api.check(api.library().ob_scene_add_triangles(self.handle, *mesh))
        self._kept.append(ray_filter)
        if whole is not None:
            self._whole[self._count] = whole
        self._count += 1
        return self._count - 1

    def add_instances(self, geometries: Sequence[Geometry], matrices: Doubles) -> None:
        """Geometries, N of them, each under one of (N, 3, 4) matrices, mesh to scene."""
        rows = np.ascontiguousarray(matrices, dtype=np.float32)
        handles = (c_void_p * len(rows))(*(each.handle.value for each in geometries))
        place = api.address(rows, np.float32, len(geometries), 3, 4)
        api.check(api.library().ob_scene_add_instances(self.handle, handles, place, len(rows)))
        self._kept += {each.ray_filter for each in geometries}
        self._count += len(rows)

    def commit(self, control: api.Control | None = None) -> None:
        """Build the tree. Raises Cancelled, MemoryError."""
        api.check(api.library().ob_scene_commit(self.handle, api.pointer_to(control)))

    def visible(self, origins: Floats, directions: Floats, distance: float = np.inf) -> Flags:
        """V along rays: origins, directions (N, 3) float32 → (N,) bool, True where nothing is hit before distance."""
        answer = np.zeros(len(origins), dtype=np.uint8)
        count = len(origins)
        rays = (*(api.address(each, np.float32, count, 3) for each in (origins, directions)), count)
        pointer = ctypes.cast(api.address(answer, np.uint8, count) or 0, ctypes.POINTER(ctypes.c_uint8))
        api.check(api.library().ob_visible(self.handle, *rays, distance, pointer))
        return answer.astype(bool)

    def first_hits(
        self, origins: Floats, directions: Floats, lengths: Floats, threads: int = 0, control: api.Control | None = None
    ) -> Hits:
        """What rays meet first: origins, directions (N, 3) and lengths (N,), in lengths of the direction, float32.

        Raises Cancelled, InputError.
        """
        hits = np.empty(len(origins), dtype=_HIT)
        count = len(origins)
        rays = (
            *(api.address(each, np.float32, count, 3) for each in (origins, directions)),
            api.address(lengths, np.float32, count),
        )
        where = (api.address(hits, _HIT, count), api.pointer_to(control))
        api.check(api.library().ob_first_hits(self.handle, *rays, len(origins), threads, *where))
        for geometry, whole in self._whole.items():
            here = hits["geometry"] == geometry
            hits["triangle"][here] = whole[hits["triangle"][here]]
        weights = np.stack([1.0 - hits["u"] - hits["v"], hits["u"], hits["v"]], axis=1)
        return Hits(hits["distance"].copy(), hits["geometry"].copy(), hits["triangle"].copy(), weights)


_HIT = np.dtype(
    [(name, np.float32) for name in ("distance", "u", "v")] + [("geometry", np.int32), ("triangle", np.int32)]
)


@dataclass(frozen=True, eq=False)
class Hits:
    """Where rays meet triangles. distance: (N,) float32 in lengths of the direction, inf for none. geometry, triangle:
    (N,) int32, the scene's number of what is met and the triangle of it, -1 for none. weights: (N, 3) float32 of the
    corners of the triangle, or of the piece of it that was traced."""

    distance: Floats
    geometry: Ints
    triangle: Ints
    weights: Floats

    @property
    def met(self) -> Flags:
        """(N,) bool: rays that meet anything."""
        met: Flags = self.geometry >= 0
        return met


def _mesh(vertices: Floats, triangles: Ints) -> tuple[int | None, int, int | None, int]:
    vertex_count, count = len(vertices), len(triangles)
    return (
        api.address(vertices, np.float32, vertex_count, 3),
        vertex_count,
        api.address(triangles, np.int32, count, 3),
        count,
    )


def _filter_of(ray_filter: RayFilter, triangles: int) -> tuple[Any, int]:
    """As the kernel takes it. Its arrays are not copied. Raises InputError for a cutout of another mesh."""
    cutout = ray_filter.cutout
    if cutout is None:
        return None, int(ray_filter.front_only)
    if len(cutout.alpha) != triangles:
        raise InputError(f"a cutout of {len(cutout.alpha)} triangles is laid over a mesh of {triangles}; make it anew")
    alphas = (api.Alpha * len(cutout.alphas))(
        *(
            api.Alpha(
                api.address(each.values, np.float32, *each.values.shape),
                *each.values.shape[::-1],
                int(each.linear),
                int(each.wrap),
            )
            for each in cutout.alphas
        )
    )
    arrays = (
        api.address(cutout.uv, np.float32, triangles, 3, 2),
        api.address(cutout.alpha, np.int32, triangles),
    )
    return ctypes.pointer(api.Cutout(*arrays, alphas, len(alphas))), int(ray_filter.front_only)

"""The kernel's C interface (kernel/include/*.h), as ctypes sees it: structures, loading, errors."""

from __future__ import annotations

import ctypes
import weakref
from ctypes import POINTER, Structure, byref, c_char_p, c_double, c_float, c_int32, c_int64, c_uint8, c_uint64, c_void_p
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .errors import Cancelled, InputError
from .library_faults import cannot_be_loaded

ABI_VERSION = 17
OK, CANCELLED, INVALID, NO_EMBREE, OUT_OF_MEMORY = range(5)
RULE_COVERAGE, RULE_CENTRE = range(2)


class Map(Structure):
    _fields_ = [
        ("sampler", c_int32),
        ("axis", c_int32),
        ("exponent", c_double),
        ("cosine", c_double),
        ("lobe_share", c_double),
        ("accumulator", c_int32),
    ]


class Light(Structure):
    _fields_ = [
        ("radiance", c_void_p),
        ("density", c_void_p),
        ("row_cdf", c_void_p),
        ("column_cdf", c_void_p),
        ("size", c_int32),
    ]


class Alpha(Structure):
    _fields_ = [("values", c_void_p), ("width", c_int32), ("height", c_int32), ("linear", c_int32), ("wrap", c_int32)]


class Cutout(Structure):
    _fields_ = [("uv", c_void_p), ("alpha", c_void_p), ("alphas", POINTER(Alpha)), ("alpha_count", c_int32)]


class Control(Structure):
    """Shared with a running call: set `cancel` to 1 to stop it; done / total tells how far it is."""

    _fields_ = [("cancel", c_int32), ("reserved", c_int32), ("done", c_int64), ("total", c_int64)]


class DeviceInfo(Structure):
    _fields_ = [("version", c_int32 * 3), ("native_width", c_int32), ("vector_width", c_int32)]


class Surface(Structure):
    _fields_ = [
        ("vertices", c_void_p),
        ("triangles", c_void_p),
        ("uv", c_void_p),
        ("normals", c_void_p),
        ("texel_normals", c_void_p),
        ("face_normals", c_void_p),
        ("spacing", c_void_p),
        ("owner", c_void_p),
        ("vertex_count", c_int64),
        ("triangle_count", c_int64),
        ("width", c_int32),
        ("height", c_int32),
    ]


class RasterReport(Structure):
    _fields_ = [("covered", c_int64), ("overlapped", c_int64), ("outside", c_int64), ("degenerate", c_int64)]


class TraceSettings(Structure):
    _fields_ = [
        ("rays", c_int32),
        ("threads", c_int32),
        ("packet_width", c_int32),
        ("orthographic", c_int32),
        ("seed", c_uint64),
        ("distance", c_float),
        ("viewer", c_float * 3),
        ("forward", c_float * 3),
        ("incoherent", c_int32),
        ("nearest", c_float),
        ("falloff", c_int32),
        ("light", POINTER(Light)),
    ]


class Signal(Structure):
    _fields_ = [
        ("value", c_void_p),
        ("noise", c_void_p),
        ("precision", c_void_p),
        ("filtered", c_void_p),
        ("error", c_void_p),
        ("open_shares", c_void_p),
        ("open_share_count", c_int32),
        ("sharpness", c_float),
        ("slope", c_float),
        ("plain", c_int32),
        ("threads", c_int32),
    ]


class Coarse(Structure):
    _fields_ = [
        ("owner", c_void_p),
        ("positions", c_void_p),
        ("normals", c_void_p),
        ("values", POINTER(c_void_p)),
        ("error", c_void_p),
        ("sharpness", c_float),
        ("slope", c_float),
        ("width", c_int32),
        ("height", c_int32),
    ]


class Slab(Structure):
    _fields_ = [("low", c_float), ("high", c_float), ("axis", c_int32)]


class Packing(Structure):
    _fields_ = [
        ("width", c_int32),
        ("height", c_int32),
        ("padding", c_int32),
        ("align", c_int32),
        ("threads", c_int32),
        ("scale", c_double),
        ("kept_padding", c_int32),
        ("reserved", c_int32),
    ]


_HANDLE = c_void_p
_CONTROL = POINTER(Control)
_MESH = [c_void_p, c_int64, c_void_p, c_int64]
_RAY_FILTER = [POINTER(Cutout), c_int32]
_FUNCTIONS: dict[str, list[Any]] = {
    "ob_device_open": [c_char_p, c_int32, POINTER(_HANDLE), POINTER(DeviceInfo)],
    "ob_mesh_build": [_HANDLE, *_MESH, *_RAY_FILTER, _CONTROL, POINTER(_HANDLE)],
    "ob_scene_begin": [_HANDLE, POINTER(_HANDLE)],
    "ob_scene_add_triangles": [_HANDLE, *_MESH, *_RAY_FILTER],
    "ob_scene_add_instances": [_HANDLE, POINTER(_HANDLE), c_void_p, c_int64],
    "ob_scene_commit": [_HANDLE, _CONTROL],
    "ob_rasterize": [
        *[c_void_p, c_int64, c_void_p, c_int32, c_int32, c_int32, c_int32],
        *[c_void_p, c_void_p, POINTER(RasterReport), _CONTROL],
    ],
    "ob_surface_points": [POINTER(Surface), c_int32, c_void_p, c_void_p],
    "ob_fill_margin": [c_void_p, c_int32, c_int32, c_int32, c_float, c_void_p],
    "ob_trace": [
        *[_HANDLE, POINTER(Surface), POINTER(TraceSettings), POINTER(Map), c_int32],
        *[POINTER(c_void_p), POINTER(c_void_p), _CONTROL],
    ],
    "ob_trace_texels": [
        *[_HANDLE, POINTER(Surface), POINTER(TraceSettings), POINTER(Map), c_int32],
        *[c_void_p, c_int64, POINTER(c_void_p), POINTER(c_void_p), _CONTROL],
    ],
    "ob_trace_blocks": [
        *[_HANDLE, POINTER(Surface), POINTER(TraceSettings), POINTER(Map), c_int32],
        *[c_void_p, c_int64, c_int32, POINTER(c_void_p), POINTER(c_void_p), _CONTROL],
    ],
    "ob_trace_cells": [
        *[_HANDLE, POINTER(Surface), POINTER(TraceSettings), c_void_p, c_int64],
        *[c_void_p, c_int32, c_void_p, _CONTROL],
    ],
    "ob_filter_build": [POINTER(Surface), POINTER(Slab), c_int32, _CONTROL, POINTER(_HANDLE)],
    "ob_filter_apply": [_HANDLE, POINTER(Signal), _CONTROL],
    "ob_upsample": [
        *[POINTER(Surface), POINTER(Coarse), c_int32, c_int32],
        *[_CONTROL, POINTER(c_void_p), c_void_p, c_void_p],
    ],
    "ob_interior": [_HANDLE, POINTER(Surface), c_int32, c_void_p, c_int64, c_int32, c_void_p, _CONTROL],
    "ob_first_hits": [_HANDLE, *[c_void_p] * 3, c_int64, c_int32, c_void_p, _CONTROL],
    "ob_components": [c_int64, c_void_p, c_void_p, c_int64, c_void_p, POINTER(c_int64)],
    "ob_smooth_labels": [c_int64, *[c_void_p] * 4, c_int32, c_void_p, _CONTROL],
    "ob_simplify": [*_MESH, c_void_p, c_double, c_int64, c_void_p, c_void_p, c_void_p, _CONTROL],
    "ob_flatten": [*_MESH, c_void_p, c_int64, c_int64, c_int32, c_void_p, c_void_p, c_void_p, _CONTROL],
    "ob_bisect": [*[c_void_p] * 4, c_int64, c_void_p, c_int64, c_void_p, c_int32, c_void_p, _CONTROL],
    "ob_overlaps": [
        *[c_void_p, c_void_p, c_int64, c_double, c_int32, c_int64],
        *[c_void_p, POINTER(c_int64), _CONTROL],
    ],
    "ob_lowest_overlaps": [c_void_p, c_void_p, c_int64, c_int64, c_double, c_int32, c_void_p, _CONTROL],
    "ob_pack": [c_void_p, c_void_p, c_int64, c_int64, POINTER(Packing), c_void_p, _CONTROL],
    "ob_expect_packing": [c_double, c_double, c_int64, POINTER(Packing)],
    "ob_elementary": [c_int32, c_void_p, c_int64, c_void_p],
    "ob_powers": [c_void_p, c_int64, c_float, c_void_p],
    "ob_product": [c_void_p, c_void_p, c_int64, c_int64, c_int64, c_int32, c_void_p],
    "ob_atan2": [c_void_p, c_void_p, c_int64, c_void_p],
    "ob_visible": [_HANDLE, c_void_p, c_void_p, c_int64, c_float, POINTER(c_uint8)],
}
_RELEASERS = ("ob_device_close", "ob_mesh_free", "ob_scene_free", "ob_filter_free")


@cache
def library() -> ctypes.CDLL:
    """The kernel's shared library, from its own wheel. Raises InputError where it is missing or of another version."""
    path = None
    try:
        import occlusion_bake_kernel

        path = occlusion_bake_kernel.library_path()
        kernel = ctypes.CDLL(str(path))
    except (ImportError, OSError) as error:
        raise cannot_be_loaded("the occlusion kernel", path, error) from error
    if kernel.ob_abi_version() != ABI_VERSION:
        raise InputError("the occlusion kernel is of another version than the extension; reinstall the extension")
    kernel.ob_error_message.restype = c_char_p
    for name, arguments in _FUNCTIONS.items():
        getattr(kernel, name).argtypes = arguments
        getattr(kernel, name).restype = c_int32
    for name in _RELEASERS:
        getattr(kernel, name).argtypes = [_HANDLE]
        getattr(kernel, name).restype = None
    kernel.ob_profile.argtypes = [POINTER(c_int64), POINTER(c_int64)]
    kernel.ob_profile.restype = None
    return kernel


def check(status: int) -> None:
    """Turn a call's status into an exception: Cancelled, InputError, MemoryError or RuntimeError."""
    if status == OK:
        return
    message = (library().ob_error_message() or b"").decode(errors="replace")
    if status == CANCELLED:
        raise Cancelled
    if status in (INVALID, NO_EMBREE):
        raise InputError(message)
    if status == OUT_OF_MEMORY:
        raise MemoryError(message)
    raise RuntimeError(message)


def release_with(owner: object, release: str, handle: c_void_p) -> None:
    """Release a handle when its owner is gone; at the end of the process the system takes it."""
    weakref.finalize(owner, getattr(library(), release), handle).atexit = False


def address(array: NDArray[Any] | None, dtype: type | np.dtype[Any], *shape: int) -> int | None:
    """Where an array lies that the kernel reads or writes; None for None. The caller keeps it alive through the call.

    All that crosses into the kernel goes through here: it believes what it is told of dtype, layout and lengths. Raises
    TypeError for an array that is not contiguous, or of another dtype or shape.
    """
    if array is None:
        return None
    if array.dtype != np.dtype(dtype) or array.shape != shape or not array.flags.c_contiguous:
        layout = "contiguous" if array.flags.c_contiguous else "strided"
        raise TypeError(
            f"the kernel wants contiguous {np.dtype(dtype)} of shape {shape}, not {layout} {array.dtype} of shape "
            f"{array.shape}"
        )
    return int(array.ctypes.data)


def profile() -> tuple[int, int]:
    """Processor cycles inside Embree and in all, of every trace so far; zeros unless built for profiling."""
    embree, everything = c_int64(), c_int64()
    library().ob_profile(byref(embree), byref(everything))
    return embree.value, everything.value


def pointer_to(control: Control | None) -> object:
    """A control as the kernel takes it."""
    return None if control is None else byref(control)

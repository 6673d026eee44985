"""Which Embree to trace with: the embreex wheel's (AVX-512), else the one that Blender brings or the system has."""

from __future__ import annotations

import importlib.util
import os
import sys
from collections.abc import Iterator
from ctypes import byref, c_void_p
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from ..base.errors import InputError
from .kernel_api import DeviceInfo, check, library, release_with

OVERRIDE = "OCCLUSION_BAKE_EMBREE"  # a path; nothing else is tried then
_NAMES = {"win32": "embree4*.dll", "darwin": "libembree4*.dylib"}
_SONAMES = {"win32": "embree4.dll", "darwin": "libembree4.4.dylib"}


class Device:
    """Embree, loaded and running. Held by the scenes made with it."""

    def __init__(self, path: str, threads: int) -> None:
        handle, info = c_void_p(), DeviceInfo()
        check(library().ob_device_open(os.fsencode(path), threads, byref(handle), byref(info)))
        self.handle = handle
        release_with(self, "ob_device_close", handle)
        self.path = path
        self.version = ".".join(str(part) for part in info.version)
        self.native_width = int(info.native_width)

    @property
    def description(self) -> str:
        """One line for reports: version, packet width, where it came from."""
        return f"{self.version}, {self.native_width}-wide, {self.path}"


@dataclass(frozen=True)
class _Refusal:
    path: str
    reason: str


@cache
def open_device(threads: int = 0) -> Device:
    """The first Embree that works; threads = 0 is all of the machine's. Raises InputError naming what was tried."""
    override = os.environ.get(OVERRIDE)
    refusals = []
    for path in [override] if override else candidates():
        try:
            return Device(path, threads)
        except InputError as error:
            refusals.append(_Refusal(path, str(error)))
    if override:
        raise InputError(f"Embree from {OVERRIDE}: {refusals[0].reason}; correct the path or unset the variable")
    tried = "; ".join(refusal.reason for refusal in refusals) or "none found"
    raise InputError(
        f"no usable Embree ({tried}); reinstall the extension with its wheels, or set {OVERRIDE} to a libembree4"
    )


def candidates() -> Iterator[str]:
    """Paths of Embree libraries, best first, ending with the bare name that the process or the system may resolve."""
    pattern = _NAMES.get(sys.platform, "libembree4*.so*")
    for folder in (*_wheel_folders("embreex"), *_wheel_folders("bpy"), *_blender_folders()):
        yield from (str(path) for path in sorted(folder.glob(pattern)))
    yield _SONAMES.get(sys.platform, "libembree4.so.4")


def _wheel_folders(package: str) -> Iterator[Path]:
    spec = importlib.util.find_spec(package) if package not in sys.modules else sys.modules[package].__spec__
    for place in (spec.submodule_search_locations or []) if spec else []:
        root = Path(place)
        yield from (root.parent / f"{package}.libs", root / ".dylibs", root / "lib", root)


def _blender_folders() -> Iterator[Path]:
    """Official Blenders keep their libraries beside the executable."""
    program = Path(
        sys.executable if "bpy" not in sys.modules else getattr(sys.modules["bpy"].app, "binary_path", "") or "."
    )
    yield from (program.parent / "lib", program.parent / "blender.shared", program.parent.parent / "Resources" / "lib")

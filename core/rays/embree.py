"""Which Embree to trace with: the embreex wheel's (AVX-512), else the one that Blender brings or the system has."""

from __future__ import annotations

import importlib.util
import os
import sys
from collections.abc import Iterator
from ctypes import byref, c_void_p
from ctypes.util import find_library
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from ..base.errors import InputError
from ..base.kernel_api import DeviceInfo, check, library, release_with
from ..base.library_faults import explained

OVERRIDE = "OCCLUSION_BAKE_EMBREE"  # a path; nothing else is tried then
_NAMES = {"win32": "embree4*.dll", "darwin": "libembree4*.dylib"}
_SONAME = "libembree4.so.4"


class Device:
    """Embree, loaded and running. Held by the scenes made with it."""

    def __init__(self, path: str, threads: int) -> None:
        handle, info = c_void_p(), DeviceInfo()
        check(library().ob_device_open(os.fsencode(path), threads, byref(handle), byref(info)))
        self.handle = handle
        release_with(self, "ob_device_close", handle)
        self.path = path
        self.version = ".".join(str(part) for part in info.version)
        self.native_width, self.vector_width = int(info.native_width), int(info.vector_width)

    @property
    def description(self) -> str:
        """One line for reports: version, how wide its packets and our own vectors are, where it came from."""
        return f"{self.version}, {self.native_width}-wide packets, {self.vector_width}-wide vectors, {self.path}"


@dataclass(frozen=True)
class _Refusal:
    path: str
    reason: str


def open_device(threads: int = 0) -> Device:
    """The first Embree that works; threads = 0 is all of the machine's. One for each number, for as long as the process
    lives. Raises InputError naming what was tried."""
    return _opened(threads)


@cache
def _opened(threads: int) -> Device:
    library()  # that this cannot be loaded is no fault of any Embree
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
    raise InputError(f"no usable Embree ({tried}); {_cure(refusals)}")


def _cure(refusals: list[_Refusal]) -> str:
    """That of the first whose fault is known. Bare names are the system's, which need not be there."""
    for refusal in refusals:
        path = Path(refusal.path)
        if path.is_absolute() and (known := explained(path, refusal.reason)):
            cause, cure = known
            return f"{path.name}: {cause}; {cure}"
    return f"reinstall the extension with its wheels, or set {OVERRIDE} to a libembree4"


def candidates() -> Iterator[str]:
    """Paths of Embree libraries, best first, the system's last. None is searched for in the working directory, where
    anybody may have put one."""
    pattern = _NAMES.get(sys.platform, "libembree4*.so*")
    for folder in (*_wheel_folders("embreex"), *_wheel_folders("bpy"), *_blender_folders()):
        if folder.is_absolute():
            yield from (str(path) for path in sorted(folder.glob(pattern)))
    yield from _of_the_system()


def _wheel_folders(package: str) -> Iterator[Path]:
    spec = importlib.util.find_spec(package) if package not in sys.modules else sys.modules[package].__spec__
    if spec is None or spec.origin is None:  # any folder of that name makes a package without an origin
        return
    for place in spec.submodule_search_locations or []:
        root = Path(place)
        yield from (root.parent / f"{package}.libs", root / ".dylibs", root / "lib", root)


def _blender_folders() -> Iterator[Path]:
    """Official Blenders keep their libraries beside the executable; Blender as a module has none."""
    program = sys.modules["bpy"].app.binary_path if "bpy" in sys.modules else sys.executable
    if program:
        home = Path(program).parent
        yield from (home / "lib", home / "blender.shared", home.parent / "Resources" / "lib")


def _of_the_system() -> Iterator[str]:
    """The system's own. Linux finds it by its bare name, which other systems would look up in the working directory."""
    if sys.platform not in _NAMES:
        yield _SONAME
    elif (found := find_library("embree4")) and Path(found).is_absolute():
        yield found

"""Why a library cannot be loaded: the loader's own words where this system has them, and those that others are known
to have."""

from __future__ import annotations

import ctypes
import shutil
import sys
from pathlib import Path

import occlusion_bake_kernel
import pytest
from occlusion_bake.core.base.library_faults import cannot_be_loaded

_MACHINE = slice(18, 20)  # of an ELF file's header: e_machine
_AARCH64, _X86_64 = (183).to_bytes(2, "little"), (62).to_bytes(2, "little")
on_linux = pytest.mark.skipif(sys.platform != "linux", reason="glibc's words")


def refused(path: Path) -> str:
    """What is said of a library that this system does not load."""
    with pytest.raises(OSError) as error:
        ctypes.CDLL(str(path))
    line = str(cannot_be_loaded("the kernel", path, error.value))
    assert "\n" not in line and line.startswith("the kernel cannot be loaded: ")
    return line


@pytest.fixture
def kernel(tmp_path: Path) -> Path:
    """A copy of the kernel's library, to be broken."""
    path = tmp_path / "libocclusion_kernel.so"
    shutil.copy(occlusion_bake_kernel.library_path(), path)
    return path


@on_linux
def test_of_another_processor(kernel: Path) -> None:
    data = bytearray(kernel.read_bytes())
    data[_MACHINE] = _X86_64 if data[_MACHINE] == _AARCH64 else _AARCH64
    kernel.write_bytes(data)
    assert "made for another system or processor; install the extension's zip for Linux on " in refused(kernel)


@on_linux
def test_of_another_system(kernel: Path) -> None:
    kernel.write_bytes(b"MZ" + kernel.read_bytes()[2:])
    assert "made for another system or processor" in refused(kernel)


@on_linux
def test_without_a_library_that_it_needs(kernel: Path) -> None:
    kernel.write_bytes(kernel.read_bytes().replace(b"\0libc.so.6\0", b"\0libq.so.6\0"))
    assert "it needs libq.so.6, which this system has not; install the package that brings libq.so.6" in refused(kernel)


@on_linux
def test_of_a_newer_c_library(kernel: Path) -> None:
    data = kernel.read_bytes()
    if (at := data.find(b"\0GLIBC_2.14\0")) < 0:
        pytest.skip("this kernel asks for no glibc 2.14")
    kernel.write_bytes(data[:at] + b"\0GLIBC_9.14\0" + data[at + 12 :])
    assert "older than the 9.14 it asks for; bake on a newer system" in refused(kernel)


@on_linux
def test_not_there(tmp_path: Path) -> None:
    assert "it is not installed; reinstall the extension" in refused(tmp_path / "libgone.so")


@pytest.mark.parametrize(
    ("said", "cause", "cure"),
    [
        (
            "dlopen(/u/k.dylib, 0x0006): tried: '/u/k.dylib' (mach-o file, but is an incompatible architecture "
            "(have 'x86_64', need 'arm64e' or 'arm64'))",
            "made for another system or processor",
            "install the extension's zip for",
        ),
        (
            "dlopen(/u/k.dylib, 0x0006): tried: '/u/k.dylib' (code signature in <1B2C> '/u/k.dylib' not valid for use "
            "in process: library load disallowed by system policy)",
            "macOS holds it back",
            f"xattr -dr com.apple.quarantine '{Path('/u')}'",
        ),
        (
            "dlopen(/u/k.dylib, 0x0006): Library not loaded: @rpath/libtbb.12.dylib\n  Referenced from: /u/k.dylib",
            "it needs @rpath/libtbb.12.dylib",
            "reinstall the extension",
        ),
        ("[WinError 193] %1 ist keine zulässige Win32-Anwendung", "another system or processor", "the extension's zip"),
        (
            "Could not find module 'C:\\u\\k.dll' (or one of its dependencies). Try using the full path with "
            "constructor syntax.",
            "a library that it needs",
            "Visual C++ Redistributable",
        ),
        (
            "C:\\u\\k.dll cannot be loaded: Windows refused it (Windows error 4551)",
            "virus scanner",
            "allow what lies in",
        ),
        ("[WinError 206] Der Dateiname ist zu lang", "longer than Windows takes", "BLENDER_USER_RESOURCES"),
        (
            "/u/k.so: failed to map segment from shared object",
            "not let run from where it lies",
            f"allow it for {Path('/u')}",
        ),
        ("No module named 'occlusion_bake_kernel'", "it is not installed", "reinstall the extension"),
    ],
)
def test_known_words_of_every_system(said: str, cause: str, cure: str) -> None:
    line = str(cannot_be_loaded("the kernel", Path("/u/k.so"), said))
    told, _, rest = line.removeprefix("the kernel cannot be loaded: ").partition("; ")
    assert cause in told and cure in rest and "\n" not in line


def test_of_unknown_words_no_cause_is_made_up() -> None:
    line = str(cannot_be_loaded("the kernel", Path("/u/k.so"), "the moon is full\nand more"))
    assert line == "the kernel cannot be loaded (the moon is full); reinstall the extension"

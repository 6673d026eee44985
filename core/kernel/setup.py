"""The kernel as a wheel: one shared library that every Python loads through ctypes."""

import os
import re
import shutil
import sys
import sysconfig
from pathlib import Path

from setuptools import Distribution, setup
from setuptools.command.bdist_wheel import bdist_wheel
from setuptools.command.build_py import build_py

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE))  # a build front end does not run this file from its own folder

import toolchain  # noqa: E402

PACKAGE = "occlusion_bake_kernel"


def version() -> str:
    """The extension's version: from its manifest above this folder, or from PKG-INFO in a source archive."""
    for folder in (HERE, *HERE.parents):
        if (manifest := folder / "blender_manifest.toml").is_file():
            return first(r'^version\s*=\s*"([^"]+)"', manifest)
    if (record := HERE / "PKG-INFO").is_file():
        return first(r"^Version: (\S+)", record)
    raise SystemExit(f"no blender_manifest.toml in or above {HERE}; build the kernel from a checkout")


def first(pattern: str, path: Path) -> str:
    found = re.search(pattern, path.read_text(encoding="utf-8"), re.MULTILINE)
    if found is None:
        raise SystemExit(f"{path}: no version in it")
    return found[1]


def platform_tag() -> str:
    """Wheel platform. On Linux it names the C library it was built against, the oldest it is sure to run on."""
    if wanted := toolchain.target():
        return wanted.tag
    tag = sysconfig.get_platform().replace("-", "_").replace(".", "_")
    if not tag.startswith("linux_"):
        return tag
    try:
        name, number = (os.confstr("CS_GNU_LIBC_VERSION") or "").split()
    except (ValueError, OSError):  # another C library, musl say
        return tag
    return tag.replace("linux", "manylinux_" + "_".join(number.split(".")[:2]), 1) if name == "glibc" else tag


class BuildLibrary(build_py):
    """The package's Python, and the library beside it."""

    def run(self) -> None:
        super().run()
        library = Path(self.build_lib) / PACKAGE / toolchain.library_name()
        toolchain.build_library(library, toolchain.objects(platform_tag()))
        licences = library.with_name("licences")
        shutil.rmtree(licences, ignore_errors=True)
        licences.mkdir()
        for name, text in toolchain.linked_licences().items():
            shutil.copyfile(text, licences / name)


class AnyPython(bdist_wheel):
    """Tagged for a platform and for no Python in particular: the library knows nothing of Python."""

    def get_tag(self) -> tuple[str, str, str]:
        return "py3", "none", platform_tag()


class Compiled(Distribution):
    def has_ext_modules(self) -> bool:
        return True


setup(
    name=PACKAGE,
    version=version(),
    description="The native kernel of Occlusion Bake",
    license="GPL-3.0-or-later",
    python_requires=">=3.11",
    packages=[PACKAGE],
    distclass=Compiled,
    cmdclass={"build_py": BuildLibrary, "bdist_wheel": AnyPython},
    options={"build": {"build_base": f"build/{platform_tag()}"}},  # no library gets into another platform's wheel
)

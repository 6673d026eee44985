"""How much of the kernel's time is inside Embree: a build that counts processor cycles."""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
from typing import Any

from ...core.base.kernel_api import profile
from ...core.rays.map_spec import AO, reflection
from ...samples.scenes import SCENES, build
from ...tests.oracles.settings import flat_settings
from ..bake_here import bake_here
from ..pages import ROOT, filled
from ..sweep import in_child
from ..tables import table

RAYS = (16, 64, 256)
_BUILD = """import sys, pathlib, toolchain
folder = pathlib.Path(sys.argv[1])
toolchain.build_library(folder / toolchain.library_name(), folder / 'objects')"""


def measure(chosen: argparse.Namespace) -> dict[str, list[float]]:
    """Bake each scene's first target with the counting kernel."""
    environment = with_profile_build()
    return {name: in_child(shares, name, environment=environment) for name in SCENES}


def with_profile_build() -> dict[str, str]:
    """Build the kernel for profiling, beside the installed one; the environment of a process that uses it."""
    folder, source = ROOT / "build" / "figures" / "profile", ROOT / "core" / "kernel"
    package = folder / "occlusion_bake_kernel"
    package.mkdir(parents=True, exist_ok=True)
    (package / "__init__.py").write_bytes((source / package.name / "__init__.py").read_bytes())
    environment = {**os.environ, "OCCLUSION_KERNEL_PROFILE": "1", "PYTHONPATH": str(source)}
    subprocess.run([sys.executable, "-c", _BUILD, str(package)], env=environment, check=True, stdout=subprocess.DEVNULL)
    paths = os.pathsep.join(filter(None, [str(folder), os.environ.get("PYTHONPATH", "")]))
    return {**os.environ, "PYTHONPATH": paths}


def page(result: dict[str, Any]) -> list[str]:
    """The section of the page."""
    rows = [(name, *(f"{100 * each:.1f} %" for each in row)) for name, row in result.items()]
    return filled(__file__, rows=table(["scene", *(f"{rays} rays" for rays in RAYS)], rows))


def shares(name: str) -> list[float]:
    """Of a scene, for each number of rays."""
    target, found = build(name).targets[0], []
    for rays in RAYS:
        before = profile()
        bake_here([target], flat_settings((AO, reflection(10.0)), rays=rays))
        embree, everything = (after - start for after, start in zip(profile(), before, strict=True))
        found.append(embree / everything)
    return found

"""How much of the kernel's time is inside Embree: a build that counts processor cycles."""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
from typing import Any

from ..addon.cli.hard_exit import leave
from ..core.rays.kernel_api import profile
from ..core.rays.map_spec import AO, reflection
from ..samples.scenes import SCENES, build
from ..tests.oracles.settings import flat_settings
from .ours import bake_here
from .pages import ROOT, answer_of

RAYS = (16, 64, 256)


def measure(chosen: argparse.Namespace) -> dict[str, Any]:
    """Bake each scene's first target with the counting kernel."""
    result: dict[str, Any] = answer_of("share", environment=with_profile_build())
    print(result)
    return result


def with_profile_build() -> dict[str, str]:
    """Build the kernel for profiling, beside the installed one; the environment of a process that uses it."""
    folder = ROOT / "build" / "figures" / "profile"
    package = folder / "occlusion_bake_kernel"
    package.mkdir(parents=True, exist_ok=True)
    source = ROOT / "core" / "kernel"
    (package / "__init__.py").write_bytes((source / "occlusion_bake_kernel" / "__init__.py").read_bytes())
    build_it = (
        "import sys, pathlib, toolchain; folder = pathlib.Path(sys.argv[1]); "
        "toolchain.build_library(folder / toolchain.library_name(), folder / 'objects')"
    )
    environment = {**os.environ, "OCCLUSION_KERNEL_PROFILE": "1", "PYTHONPATH": str(source)}
    subprocess.run(
        [sys.executable, "-c", build_it, str(package)], env=environment, check=True, stdout=subprocess.DEVNULL
    )
    paths = os.pathsep.join(filter(None, [str(folder), os.environ.get("PYTHONPATH", "")]))
    return {**os.environ, "PYTHONPATH": paths}


def page(result: dict[str, Any]) -> list[str]:
    """The section of the page."""
    head = " | ".join(f"{rays} rays" for rays in RAYS)
    lines = [
        "## Share of the kernel's time inside Embree",
        "",
        "Processor cycles of all threads, first target of each sample scene, 1024x1024, AO and RO 10; the rest makes "
        "the tables, the texels' footprints and the rays, and adds up. Goal: 85 %.",
        "",
        f"| scene | {head} |",
        "|---|" + "---|" * len(RAYS),
    ]
    return lines + [f"| {name} | {' | '.join(f'{100 * each:.1f} %' for each in row)} |" for name, row in result.items()]


def _child() -> None:
    shares: dict[str, list[float]] = {}
    for name in SCENES:
        target = build(name).targets[0]
        for rays in RAYS:
            before = profile()
            bake_here([target], flat_settings((AO, reflection(10.0)), rays=rays))
            embree, everything = (after - start for after, start in zip(profile(), before, strict=True))
            shares.setdefault(name, []).append(embree / everything)
    print(json.dumps(shares))


if __name__ == "__main__":
    _child()
    leave(0)

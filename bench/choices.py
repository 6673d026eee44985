"""What the kernel's choices cost and gain, one turned at a time, in a build for profiling (kernel/src/profile.h)."""

from __future__ import annotations

import argparse
import json
import os
import statistics
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from typing import Any

import bpy
import numpy as np

from ..addon.cli.hard_exit import leave
from ..addon.read.scene_reader import SceneRequest, read_scene
from ..core.base.arrays import Floats, Ints
from ..core.rays.embree import Device, open_device
from ..core.rays.map_spec import AO
from ..core.rays.occluders import Occluders
from ..core.rays.ray_options import RayOptions
from ..core.rays.texel_surface import TexelSurface
from ..core.rays.tracer import TraceOptions, trace
from ..core.scene.checks import zero_area
from ..core.scene.scene import Scene
from ..core.scene.world_mesh import world_surface
from ..core.texels.rasterize import rasterize
from .pages import MODELS, answer_of
from .share import with_profile_build
from .versus.scenes import build

SIZE, RAYS = 512, (16, 64)
SCENES = ("suzanne", "thinwall", "foliage", "thousands", "sculpt", "instances")


@dataclass(frozen=True)
class Choice:
    """One way to trace. tunables: of profile.h. distance: as a share of the object's diagonal, 0 for no limit."""

    group: str
    name: str
    width: int = 16
    distance: float = 0.0
    coherent: bool = True
    tunables: dict[str, str] = field(default_factory=dict)


_SHIPPED = "packets of 16, robust, medium quality, coherent, no limit"  # of scenes with more texels than triangles
SHIPS = Choice("as it ships", _SHIPPED)
CHOICES = (
    *(replace(SHIPS, group="packet width", name=str(width), width=width) for width in (8, 4, 1)),
    replace(SHIPS, group="robust", name="off", tunables={"OCCLUSION_SCENE_FLAGS": "0"}),
    replace(SHIPS, group="tree quality", name="low", tunables={"OCCLUSION_BUILD_QUALITY": "0"}),
    # A robust scene of high quality gets the tree of medium: Embree splits no triangles there.
    replace(
        SHIPS,
        group="tree quality",
        name="high, robust off",
        tunables={"OCCLUSION_BUILD_QUALITY": "2", "OCCLUSION_SCENE_FLAGS": "0"},
    ),
    replace(SHIPS, group="query flag", name="incoherent", coherent=False),
    replace(SHIPS, group="distance", name="10 % of the diagonal", distance=0.1),
    replace(SHIPS, group="distance", name="1 % of the diagonal", distance=0.01),
)

# By hand: code that was tried and not kept cannot be measured again by a script.
TRIED = (
    "Tried and left: the rays of a tile of 8 x 8 texels sorted by direction (cells of an octahedron, a counting sort "
    "of 1024 to 4096 rays) before they are put into packets. At 8 to 32 rays a texel, 1024x1024: 1.1 to 1.25 times the "
    "rays a second on `suzanne` and `foliage`, 1.0 on the bench's `part`, 0.75 to 0.95 on its `gaps` and on "
    "`thinwall`. Where triangles are smaller than texels (`sculpt`) it gained 1.0 to 1.15 at most: what lies next to "
    "the texels parts the lanes, whichever way they go. Embree's compact flag: 0.72 to 0.90 times on `sculpt`, "
    "`suzanne` and `thousands`, the tree as fast to build."
)


def measure(chosen: argparse.Namespace) -> dict[str, Any]:
    """Every scene in a process of its own."""
    environment = with_profile_build()
    result = {}
    for scene in SCENES:
        result[scene] = answer_of("choices", scene, chosen.rounds, environment=environment)
        print(scene, result[scene], flush=True)
    return result


def page(result: dict[str, Any]) -> list[str]:
    """The section of the page."""
    few, many = RAYS
    lines = [
        "## The kernel's choices",
        "",
        f"AO, {SIZE}x{SIZE}, one choice turned at a time, each in turns with what ships ({_SHIPPED}). Rays a second "
        f"as many times those of what ships, at {few} and at {many} rays a texel; build: seconds for the tree, as many "
        "times those; differ: the share of texels whose value is another. Ratios of medians. Scenes with more "
        "triangles than texels ship as incoherent: here `thousands`, `sculpt` and `instances`.",
    ]
    for scene, rows in result.items():
        shipped = rows[0][2:5]
        lines += [
            "",
            f"`{scene}`, as it ships: {shipped[0]:.1f} and {shipped[1]:.1f} million rays a second, {shipped[2]:.2f} s "
            "for the tree.",
            "",
            f"| | | {few} rays | {many} rays | build | differ |",
            "|---|---|---|---|---|---|",
        ]
        for group, name, *ratios, differ in rows[1:]:
            shown = " | ".join(f"{ratio:.2f}" for ratio in ratios)
            lines.append(f"| {group} | {name} | {shown} | {100.0 * differ:.2f} % |")
    return [*lines, "", TRIED]


def _child(name: str, rounds: int) -> None:
    targets = build(name, MODELS).targets[:1]  # first: it replaces the file, and the view layer with it
    scene, _ = read_scene(bpy.context, bpy.context.view_layer, SceneRequest(targets))
    mesh = scene.targets[0].mesh
    assert mesh.uv is not None
    owner = rasterize(mesh.name, mesh.uv, SIZE, SIZE, skip=zero_area(mesh)).owner
    device = open_device(0)
    pairs: list[list[tuple[_Run, _Run]]] = [[] for _ in CHOICES]
    for _ in range(rounds):
        for choice, row in zip(CHOICES, pairs, strict=True):
            row.append((_run(scene, owner, device, SHIPS), _run(scene, owner, device, choice)))
    ships = _medians([pair[0] for row in pairs for pair in row])
    rows = [_row(choice, row) for choice, row in zip(CHOICES, pairs, strict=True)]
    print(json.dumps([[SHIPS.group, SHIPS.name, *ships, 0.0], *rows]))


@dataclass(frozen=True, eq=False)
class _Run:
    rates: tuple[float, ...]  # million rays a second
    build: float  # seconds
    values: Floats


def _medians(runs: list[_Run]) -> list[float]:
    figures = [(*run.rates, run.build) for run in runs]
    return [statistics.median(each) for each in zip(*figures, strict=True)]


def _row(choice: Choice, pairs: list[tuple[_Run, _Run]]) -> list[Any]:
    ship, turned = (_medians(list(runs)) for runs in zip(*pairs, strict=True))
    differ = float(np.mean(pairs[0][1].values != pairs[0][0].values))
    return [choice.group, choice.name, *(mine / its for mine, its in zip(turned, ship, strict=True)), differ]


def _run(scene: Scene, owner: Ints, device: Device, choice: Choice) -> _Run:
    target = scene.targets[0]
    with _turned(choice.tunables):
        start = time.perf_counter()
        frame = Occluders(device, scene.occluders).frame_for(target)
        seconds = time.perf_counter() - start
        surface = world_surface(target, frame.origin)
        diagonal = float(np.linalg.norm(np.ptp(surface.vertices, axis=0)))
        distance = choice.distance * diagonal if choice.distance else None
        texels = np.count_nonzero(owner >= 0)
        rates = []
        for count in RAYS:
            rays = TraceOptions(count, 1, RayOptions(distance), packet_width=choice.width, coherent=choice.coherent)
            start = time.perf_counter()
            sums = trace(frame.scene, TexelSurface(surface, owner), (AO,), rays, halves=False)
            rates.append(texels * count / (time.perf_counter() - start) / 1e6)
    return _Run(tuple(rates), seconds, sums.all[0][owner >= 0])


@contextmanager
def _turned(tunables: dict[str, str]) -> Iterator[None]:
    os.environ.update(tunables)
    try:
        yield
    finally:
        for name in tunables:
            del os.environ[name]


if __name__ == "__main__":
    _child(sys.argv[1], int(sys.argv[2]))
    leave(0)

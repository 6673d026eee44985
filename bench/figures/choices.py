"""What the kernel's choices cost and gain, one turned at a time, in a build for profiling (kernel/src/profile.h)."""

from __future__ import annotations

import argparse
import time
from dataclasses import dataclass, field, replace
from functools import cache, partial
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np

from ...core.base.arrays import Floats
from ...core.rays.embree import open_device
from ...core.rays.map_spec import AO
from ...core.rays.occluders import Occluders
from ...core.rays.ray_options import RayOptions
from ...core.rays.texel_surface import TexelSurface
from ...core.rays.tracer import TraceOptions, trace
from ...core.scene.world_mesh import world_surface
from ...samples.bench_scenes import build
from ..pages import MODELS, apart, filled
from ..subject import Subject, subject_of
from ..sweep import in_child, in_turns, medians
from .share import with_profile_build

SIZE, RAYS = 512, (16, 64)
_device = cache(open_device)
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


# Of scenes with more texels than triangles.
SHIPS = Choice("as it ships", "packets of 16, robust, medium quality, coherent, no limit")
NOT_ROBUST = {"OCCLUSION_SCENE_FLAGS": "0"}
CHOICES = (
    *(replace(SHIPS, group="packet width", name=str(width), width=width) for width in (8, 4, 1)),
    replace(SHIPS, group="robust", name="off", tunables=NOT_ROBUST),
    replace(SHIPS, group="tree quality", name="low", tunables={"OCCLUSION_BUILD_QUALITY": "0"}),
    # A robust scene of high quality gets the tree of medium: Embree splits no triangles there.
    Choice("tree quality", "high, robust off", tunables={"OCCLUSION_BUILD_QUALITY": "2", **NOT_ROBUST}),
    replace(SHIPS, group="query flag", name="incoherent", coherent=False),
    replace(SHIPS, group="distance", name="10 % of the diagonal", distance=0.1),
    replace(SHIPS, group="distance", name="1 % of the diagonal", distance=0.01),
)


def measure(chosen: argparse.Namespace) -> dict[str, Any]:
    """Every scene in a process of its own."""
    environment = with_profile_build()
    return {scene: in_child(ratios, scene, chosen.rounds, environment=environment) for scene in SCENES}


def page(result: dict[str, Any]) -> list[str]:
    """The section of the page."""
    scenes = apart(_scene(scene, *rows) for scene, rows in result.items())
    return filled(__file__, size=SIZE, rays=RAYS, ships=SHIPS.name, scenes=scenes)


def _scene(scene: str, ships: list[Any], *turned: list[Any]) -> list[str]:
    rows = [(*figures, 100.0 * differ) for *figures, differ in turned]
    return filled(
        Path(__file__).with_name("choices_scene.md"), scene=scene, ships=tuple(ships[2:]), rows=rows, rays=RAYS
    )


def ratios(scene: str, rounds: int) -> list[Any]:
    """Of a scene: what ships, its figures as they are; then each choice, its figures as many times those."""
    subject = subject_of(build(scene, MODELS).targets[:1], SIZE)
    ships: list[dict[str, float]] = []
    rows = []
    for choice in CHOICES:
        runs = in_turns({side.name: partial(_traced, subject, side) for side in (SHIPS, choice)}, rounds)
        (ship, values), (turned, others) = (zip(*each, strict=True) for each in runs.values())
        ships += ship
        times = [mine / its for mine, its in zip(medians(turned).values(), medians(ship).values(), strict=True)]
        rows.append([choice.group, choice.name, *times, float(np.mean(values[0] != others[0]))])
    return [[SHIPS.group, SHIPS.name, *medians(ships).values(), 0.0], *rows]


def _traced(subject: Subject, choice: Choice, _: int) -> tuple[dict[str, float], Floats]:
    """Million rays a second at each of RAYS, seconds for the tree, and the values."""
    (target,), device = subject.scene.targets, _device()
    with patch.dict("os.environ", choice.tunables):
        start = time.perf_counter()
        frame = Occluders(device, subject.scene.occluders).frame_for(target, rays=1e12)  # all flat
        build_seconds = time.perf_counter() - start
        mesh = world_surface(target, frame.origin)
        diagonal = float(np.linalg.norm(np.ptp(mesh.vertices, axis=0)))
        limits = RayOptions(choice.distance * diagonal if choice.distance else None)
        rates = {}
        for count in RAYS:
            rays = TraceOptions(count, 1, limits, packet_width=choice.width, coherent=choice.coherent)
            start = time.perf_counter()
            sums = trace(frame.scene, TexelSurface(mesh, subject.owner), (AO,), rays, halves=False)
            rates[str(count)] = np.count_nonzero(subject.covered) * count / (time.perf_counter() - start) / 1e6
    return {**rates, "build": build_seconds}, sums.all[0][subject.covered]

"""Many objects, each of them baked: what the trees of all the others cost."""

from __future__ import annotations

import argparse
import math
import statistics
import time
from typing import Any

import numpy as np

from ...core.bake import bake
from ...core.scene.scene import Instance, Mesh, Scene
from ...tests.oracles.settings import flat_settings
from ...tests.oracles.shapes import grid
from ..pages import filled

COUNTS = (50, 200, 800)
SIDE = 50  # cells along a prop's sides


def measure(chosen: argparse.Namespace) -> list[dict[str, Any]]:
    """Seconds by the number of props, the numbers in turns."""
    scenes = {count: _scattered(count) for count in COUNTS}
    times: dict[int, list[float]] = {count: [] for count in COUNTS}
    settings = flat_settings(width=32, height=32, rays=16)
    for _ in range(chosen.rounds):
        for count, scene in scenes.items():
            start = time.perf_counter()
            for _ in bake(scene, settings):
                pass
            times[count].append(time.perf_counter() - start)
    return [{"props": count, "seconds": seconds} for count, seconds in times.items()]


def page(result: list[dict[str, Any]]) -> list[str]:
    """The section of the page."""
    medians = {each["props"]: statistics.median(each["seconds"]) for each in result}
    fewest = min(medians)
    return filled(
        __file__,
        rows=[
            {
                "props": count,
                "triangles": count * 2 * SIDE**2,
                "seconds": seconds,
                "each": seconds / count,
                "times": seconds / medians[fewest],
                "bound": count * math.log(count) / (fewest * math.log(fewest)),
            }
            for count, seconds in medians.items()
        ],
    )


def _scattered(count: int) -> Scene:
    rng = np.random.default_rng(1)
    side = float(count) ** (1.0 / 3.0)
    props = []
    for number in range(count):
        turn, _ = np.linalg.qr(rng.normal(size=(3, 3)))
        matrix = np.eye(4)
        matrix[:3, :3] = turn * np.sign(np.linalg.det(turn))
        matrix[:3, 3] = rng.uniform(-side, side, 3)
        props.append(Instance(f"prop {number}", _prop(), matrix))
    return Scene(props, props)


def _prop() -> Mesh:
    """A wavy sheet of its own."""
    mesh = grid(0.5, SIDE)
    mesh.vertices[:, 2] = 0.05 * np.sin(9.0 * mesh.vertices[:, 0]) * np.cos(9.0 * mesh.vertices[:, 1])
    return mesh

"""Light from an environment by rays from the lobe, from the light, and from both: how the errors fall.

Beside a wall (V is not 1) and in the open (V is 1 everywhere), under a small sun in a weak sky, which the light's own
rays find, and by a narrow lobe under a smooth sky, which the lobe's own rays fit. What is measured is the light itself,
the mean of V L f/p; the share that a bake tells, a ratio of two such means over the same rays, is exact in the open.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from ...core.base.arrays import Doubles, Floats
from ...core.rays.embree import open_device
from ...core.rays.map_spec import light
from ...core.rays.texel_surface import TexelSurface
from ...core.rays.trace_scene import TraceScene
from ...core.rays.tracer import TraceOptions, trace
from ...core.scene.world_mesh import WorldMesh
from ...core.spherical.environment import Environment, from_function
from ...tests.oracles.shapes import patch
from ..plots import panels, save

RAYS = (4, 16, 64, 256, 1024)
TRUTH_RAYS = 1 << 14
WAYS = {"the light's": 0.0, "half of each": 0.5, "the lobe's": 1.0}
COLOURS = {"the light's": "#d95f02", "half of each": "#1b9e77", "the lobe's": "#7570b3"}
_TEXELS = 32  # along the side of a patch so small that all see the same
_SUN = np.array([0.6, 0.2, 0.77])


@dataclass(frozen=True, eq=False)
class Case:
    """A light and a lobe, beside a wall or in the open."""

    title: str
    environment: Environment
    exponent: float | None
    wall: bool


def cases() -> list[Case]:
    """A sun by the cosine and a sky by a narrow lobe, each beside a wall and in the open."""
    sun, sky = from_function(_sun, 256), from_function(_sky, 256)
    lights: list[tuple[str, Environment, float | None]] = [
        ("A small sun, diffuse", sun, None),
        ("A smooth sky, exponent 200", sky, 200.0),
    ]
    places = {"beside a wall": True, "in the open": False}
    return [Case(f"{each[0]}, {place}", *each[1:], wall) for place, wall in places.items() for each in lights]


def errors(case: Case) -> dict[str, list[float]]:
    """RMSE over its mean, by the way rays are drawn and for each of `RAYS`, of the kernel's own sets."""
    scene = _scene(wall=case.wall)
    truth = np.mean([_light(scene, case, 0.5, TRUTH_RAYS, seed) for seed in (101, 102)])

    def rmse(share: float, rays: int) -> float:
        return float(np.sqrt(np.mean((_light(scene, case, share, rays, 7) / truth - 1.0) ** 2)))

    return {way: [rmse(share, rays) for rays in RAYS] for way, share in WAYS.items()}


def draw(folder: Path) -> None:
    """Measure and draw convergence_light.png."""
    title = "Light: rays from both, by the balance heuristic, fail nowhere"
    figure, axes = panels(2, 2, title, 3.1)
    for axis, case in zip(axes, cases(), strict=True):
        found = errors(case)
        for way, values in found.items():
            axis.loglog(RAYS, values, marker="s", color=COLOURS[way], label=f"{way} rays")
            print(f"{case.title}; {way}: {', '.join(f'{value:.4f}' for value in values)}")
        axis.set(title=case.title, xlabel="rays a texel", ylabel="RMSE over the mean")
        axis.legend()
    save(figure, folder / "convergence_light.png")


def _sun(ways: Doubles) -> Doubles:
    """0.2 from all sides, and 400 within 2.6 degrees of the sun."""
    level = 0.2 + 400.0 * (ways @ (_SUN / np.linalg.norm(_SUN)) > 0.999)
    return np.repeat(level[:, np.newaxis], 3, axis=1)


def _sky(ways: Doubles) -> Doubles:
    """1 + 0.3 x."""
    return np.repeat((1.0 + 0.3 * ways[:, :1]), 3, axis=1)


def _scene(*, wall: bool) -> TraceScene:
    """Nothing, or a wall that stands on the floor a little to the left, and cuts the lobes."""
    scene = TraceScene(open_device(0))
    if wall:
        corners = np.array([(-1, -4096, -1), (-1, 4096, -1), (-1, 4096, 8), (-1, -4096, 8)], dtype=np.float32)
        scene.add(corners, np.array([(0, 1, 2), (0, 2, 3)], dtype=np.int32))
    scene.commit()
    return scene


def _light(scene: TraceScene, case: Case, share: float, rays: int, seed: int) -> Floats:
    """(H, W): what each texel of a patch tells of the light."""
    square = patch(2.0**-10)
    assert square.uv is not None
    mesh = WorldMesh(square.vertices, square.triangles, square.uv)
    owner = np.tril(np.ones((_TEXELS, _TEXELS), dtype=np.int32))[::-1].copy()
    estimator = replace(light(case.exponent), lobe_share=share)
    options = TraceOptions(rays, seed, light=case.environment)
    sums = trace(scene, TexelSurface(mesh, owner), (estimator,), options, halves=False)
    told: Floats = sums.all[0] / np.float32(rays)
    return told

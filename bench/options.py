"""What the options do, and what they cost: the picture and the table of docs/options.md.

python -m occlusion_bake.bench.options [--rounds N] [--size N] [--picture FILE]
"""

from __future__ import annotations

import argparse
import statistics
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from ..addon.cli.hard_exit import run_and_exit
from ..core.bake import Baked, bake
from ..core.base.arrays import Doubles
from ..core.base.vectors import unit
from ..core.maps.bent_normals import BentNormalMap
from ..core.rays.map_spec import AO, light
from ..core.rays.ray_options import Falloff
from ..core.scene.ground_plane import ground_below
from ..core.scene.image_texture import ImageTexture
from ..core.scene.normal_map import NormalMap, NormalMapLayer
from ..core.scene.scene import Scene
from ..core.solve.directional import DirectionalSettings
from ..core.spherical.directional_format import DirectionalFormat
from ..core.spherical.environment import from_function
from ..samples.scenes import build
from ..tests.oracles.blender import read
from ..tests.oracles.settings import flat_settings
from .pages import ROOT
from .sweep import in_turns
from .tables import table

PICTURE = ROOT / "docs" / "pictures" / "options.png"
_FAR = {"distance": 1.0}
OPTIONS: dict[str, dict[str, Any]] = {
    "AO": {},
    "distance 1": _FAR,
    "falloff linear": {**_FAR, "falloff": Falloff.LINEAR},
    "falloff smooth": {**_FAR, "falloff": Falloff.SMOOTH},
    "minimum distance 0.2": {**_FAR, "nearest": 0.2},
    "spread 60 degrees": {"spread": 60.0},
    "front faces only": {"front_only": True},
    "ground": {},
    "normal map": {"normal_maps": True},
    "bent normals": {"bent": BentNormalMap()},
    "share of a sunset's light": {"maps": (light(),)},
    "code sh_3, 256 rays": {"code": DirectionalSettings(DirectionalFormat("sh", 3))},
}


def main(arguments: Sequence[str]) -> int:
    """Bake each option, draw the picture, print the table."""
    parser = argparse.ArgumentParser("python -m occlusion_bake.bench.options")
    parser.add_argument("--rounds", type=int, default=3, help="how often each is timed (3)")
    parser.add_argument("--size", type=int, default=512, help="texels a side (512)")
    parser.add_argument("--picture", type=Path, default=PICTURE, help=f"where the picture goes ({PICTURE})")
    chosen = parser.parse_args(arguments)
    build("suzanne")
    scene = _with_waves(replace(read(["Suzanne"], tangents=True)[0], environment=from_function(_sunset, 256)))
    scenes = {"ground": replace(scene, occluders=[*scene.occluders, ground_below(scene.targets)])}
    cases = {name: partial(_bake, scenes.get(name, scene), chosen.size, values) for name, values in OPTIONS.items()}
    bakes = in_turns(cases, chosen.rounds)
    _draw({name: runs[-1] for name, runs in bakes.items()}, chosen.picture)
    seconds = {name: statistics.median(sum(run.seconds.values()) for run in runs) for name, runs in bakes.items()}
    rows = [(name, f"{taken / seconds['AO']:.2f}") for name, taken in seconds.items()]
    print(*table(["option", "times AO alone"], rows), sep="\n")
    return 0


def _with_waves(scene: Scene) -> Scene:
    """The target with a normal map of waves along both UVs."""
    (target,) = scene.targets
    mesh = target.mesh
    assert mesh.uv is not None and mesh.tangents is not None
    v, u = (np.indices((512, 512)) + 0.5) / 512.0
    slopes = [0.7 * np.sin(80.0 * np.pi * u), 0.7 * np.sin(80.0 * np.pi * v), np.ones_like(u)]
    waves = unit(np.stack(slopes, axis=2))
    layer = NormalMapLayer(ImageTexture((0.5 + 0.5 * waves).astype(np.float32)), mesh.tangents)
    laid = NormalMap([layer], np.zeros(len(mesh.triangles), dtype=np.int32), mesh.uv)
    return replace(scene, targets=[replace(target, normal_map=laid)])


def _sunset(ways: Doubles) -> Doubles:
    """Warm from one side, blue from above, nothing from below."""
    sun = np.clip(ways @ np.array([0.8, 0.3, 0.52]), 0.0, 1.0) ** 64
    sky = np.where(ways[:, 2] > 0.0, 0.3 + 0.4 * ways[:, 2], 0.0)
    light: Doubles = 6.0 * sun[:, None] * [1.0, 0.6, 0.25] + sky[:, None] * [0.5, 0.7, 1.0]
    return light


def _bake(scene: Scene, size: int, values: Mapping[str, Any], _: int) -> Baked:
    settings = {"maps": (AO,), "width": size, "height": size, "error": 1 / 255, **values}
    (baked,) = bake(scene, flat_settings(**settings))
    return baked


def _draw(bakes: Mapping[str, Baked], path: Path) -> None:
    figure = Figure(figsize=(12, 9.6))
    for axis, (name, baked) in zip(figure.subplots(3, 4).flat, bakes.items(), strict=True):
        values = list(baked.maps.values())[-1].values
        if values.ndim == 3 and values.shape[2] > 3:  # a code: three of its numbers, about their middle
            values = 0.5 + 0.35 * values[..., 1:4]
        axis.imshow(np.clip(values, 0.0, 1.0), cmap="gray", vmin=0.0, vmax=1.0)
        axis.set_title(name, fontsize=11)
        axis.axis("off")
    figure.tight_layout()
    figure.savefig(path, dpi=80)


if __name__ == "__main__":
    run_and_exit(main)

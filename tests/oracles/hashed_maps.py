"""A scene in a file, baked with maps of all kinds: a line each, its values hashed.

hashed_maps.py make FILE: the scene. hashed_maps.py hash FILE: what comes of it. It is made once, for that takes sines,
and hashed wherever the same should come of it.
"""

from __future__ import annotations

import hashlib
import pickle
import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...core.bake import bake
from ...core.charts.unwrap import unwrap
from ...core.finish.baked import Baked
from ...core.maps.bent_normals import BentNormalMap
from ...core.rays.map_spec import AO, light, reflection
from ...core.scene.scene import Camera, HighPoly, Scene
from ...core.solve.directional import DirectionalSettings
from ...core.spherical.directional_format import named_format
from ...core.spherical.environment import from_function
from ...core.texels.vertex_bake import corner_image, corner_values, with_corner_cells
from . import shapes
from .settings import flat_settings

SIZE = 48


def stage() -> Scene:
    """A smooth ball on a floor, beside a wall, turned and off the origin."""
    ball = shapes.with_tangents(shapes.sphere((0.2, 0.1, 0.7), 0.6, 24), (0.6, 0.8, 0.0))
    wall = shapes.quad((1, -2, 0), (0, 4, 0), (0, 0, 1.5), name="wall")
    under = shapes.matrix((10.0, -7.0, 3.0), 1.3, True)
    camera = Camera((6.0, -9.0, 8.0), (0.6, -0.6, -0.5))
    return shapes.scene(ball, wall, shapes.plane(2.0), under=under, camera=camera)


def hashes(scene: Scene) -> Iterator[str]:
    """A line for each result: what was done, which map, the hash of its values."""
    target = scene.targets[0]
    size: dict[str, Any] = {"width": SIZE, "height": SIZE}
    sky = from_function(lambda ways: np.abs(ways) + np.maximum(ways[:, 2:], 0.0), 32)
    lit = replace(scene, environment=sky)
    runs = {
        "to an error": flat_settings((AO, reflection(10)), **size, error=0.01),
        "divided": flat_settings((reflection(30, from_camera=True),), **size, rays=16, divide_horizon=True),
        "bent": flat_settings((AO,), **size, rays=16, bent=BentNormalMap()),
        "light": flat_settings((light(), light(20.0, from_camera=True)), **size, rays=16),
        **{name: flat_settings((), **size, rays=16, code=_code(name)) for name in ("sh_3", "mask_8", "cells_16")},
    }
    for name, settings in runs.items():
        for baked in bake(lit, settings):
            yield from (f"{name} {line}" for line in _maps(baked))
    from_itself = replace(scene, highs={target.name: HighPoly([target], extrusion=0.1)})
    for baked in bake(from_itself, flat_settings((AO,), **size, rays=16)):
        yield from (f"high to low {line}" for line in _maps(baked))
    width, height = corner_image(len(target.mesh.triangles))
    for baked in bake(with_corner_cells(scene), flat_settings((AO,), width=width, height=height, rays=16)):
        colours = corner_values(baked.maps["ao"].values, target.mesh)
        yield f"colours ao {_hash(colours)}"
    charts = unwrap(target.name, target.mesh.vertices, target.mesh.triangles, size=256)
    yield f"charts uv {_hash(charts.uv)}"


def _code(name: str) -> DirectionalSettings:
    return DirectionalSettings(named_format(name))


def _maps(baked: Baked) -> Iterator[str]:
    """A map and its error, each with a hash."""
    for name, each in baked.maps.items():
        yield f"{name} {_hash(each.values)}"
        if each.error:
            yield f"error of {name} {_hash(np.array([each.error, each.p99]))}"


def _hash(values: NDArray[Any]) -> str:
    return hashlib.blake2b(np.ascontiguousarray(values).tobytes(), digest_size=12).hexdigest()


def main(verb: str, path: Path) -> None:
    if verb == "make":
        path.write_bytes(pickle.dumps(stage()))
        return
    for line in hashes(pickle.loads(path.read_bytes())):
        sys.stdout.write(f"{line}\n")


if __name__ == "__main__":
    main(sys.argv[1], Path(sys.argv[2]))

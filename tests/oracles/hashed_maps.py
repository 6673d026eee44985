"""hashed_maps.py FILE: a pickled scene is baked with maps of all kinds; a line each, its values hashed."""

from __future__ import annotations

import hashlib
import pickle
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np

from ...core.bake import bake
from ...core.maps.bent_normals import BentNormalMap
from ...core.rays.map_spec import AO, light, reflection
from ...core.solve.directional import DirectionalSettings
from ...core.spherical.directional_format import named_format
from ...core.spherical.environment import from_function
from .settings import flat_settings

SIZE = 48


def main(path: str) -> None:
    sky = from_function(lambda ways: np.abs(ways) + np.maximum(ways[:, 2:], 0.0), 32)
    scene = replace(pickle.loads(Path(path).read_bytes()), environment=sky)
    code = DirectionalSettings(named_format("sh_3"))
    runs = {
        "to an error": flat_settings((AO, reflection(10)), width=SIZE, height=SIZE, error=0.01),
        "divided": flat_settings(
            (reflection(30, from_camera=True),), width=SIZE, height=SIZE, rays=16, divide_horizon=True
        ),
        "bent": flat_settings((AO,), width=SIZE, height=SIZE, rays=16, bent=BentNormalMap()),
        "light": flat_settings((light(), light(20.0, from_camera=True)), width=SIZE, height=SIZE, rays=16),
        "code": flat_settings((), width=SIZE, height=SIZE, rays=16, code=code),
    }
    for name, settings in runs.items():
        for baked in bake(scene, settings):
            for of, each in baked.maps.items():
                digest = hashlib.blake2b(np.ascontiguousarray(each.values).tobytes(), digest_size=12).hexdigest()
                sys.stdout.write(f"{name} {of} {digest}\n")


if __name__ == "__main__":
    main(sys.argv[1])

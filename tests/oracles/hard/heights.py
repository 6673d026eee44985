"""What stands up only because its material displaces it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ....core.base.arrays import Floats
from ....core.scene.scene import Mesh, Scene
from ..shapes import grid, scene
from .case import Case


def _dunes(name: str, half: float, height: float, waves: float) -> Mesh:
    """Waves of that many half periods about a height."""
    flat = grid(half, 32, name=name)
    x, y = (waves * np.pi * flat.vertices[:, axis] for axis in (0, 1))
    raised: Floats = np.column_stack([flat.vertices[:, :2], height + 0.25 * np.sin(x) * np.cos(y)]).astype(np.float32)
    return replace(flat, vertices=raised)


def _under_an_awning() -> Scene:
    """Dunes, and others above them."""
    return scene(_dunes("dunes", 1.0, 0.0, 2.0), _dunes("awning", 0.6, 0.6, 1.0))


CASES = (
    Case(
        "displaced by a material",
        "In Blender's file both meshes are one plane, and their materials displace them: the meshes as they are then, "
        "within noise.",
        "",
        _under_an_awning,
        twin=_under_an_awning,
        displaced=True,
    ),
)

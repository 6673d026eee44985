"""The horizon of reflection occlusion: a floor under a ball, seen low by a camera, as it stands and divided.

Draws docs/pictures/truth/horizon.png.
"""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from typing import Any

import numpy as np

from ...core.bake import bake
from ...core.base.arrays import Doubles
from ...core.finish.baked import BakedMap
from ...core.rays.map_spec import reflection
from ...core.scene.scene import Camera
from ...tests.oracles.formulas import open_horizon
from ...tests.oracles.settings import flat_settings
from ...tests.oracles.shapes import plane, sphere
from ...tests.oracles.shapes import scene as scene_of
from ..pages import ROOT, filled
from ..tables import table

PICTURE = ROOT / "docs" / "pictures" / "truth" / "horizon.png"
EXPONENTS = (10.0, 64.0)
FLOOR, RADIUS = 8.0, 0.6  # side of the floor; of the ball that lies on it
CAMERA = Camera((-3.9, 0.0, 0.35), (1.0, 0.0, 0.0))
SIZE = 256
COLUMNS = ("exponent", "R from the normal", "open by the formula", "as it stands", "divided")
Maps = Mapping[bool, Mapping[str, BakedMap]]


def measure(_: argparse.Namespace) -> dict[str, Any]:
    """Bake the floor both ways, draw the picture; how much an open piece of the floor is, beside the formula."""
    maps = _baked(1024)
    _draw(maps)
    rows = [_row(maps, exponent) for exponent in EXPONENTS]
    return {"rows": rows, "picture": str(PICTURE.relative_to(ROOT))}


def page(result: Mapping[str, Any]) -> list[str]:
    """The section of the page."""
    values = ("formula", "kept", "divided")
    rows = [
        (f"{each['exponent']:g}", f"{each['angle']:.1f}°", *(f"{each[name]:.4f}" for name in values))
        for each in result["rows"]
    ]
    return filled(__file__, pieces=table(COLUMNS, rows), picture=PICTURE.name)


def _baked(rays: int) -> Maps:
    floor, ball = plane(0.5 * FLOOR, name="floor"), sphere((0.0, 0.0, RADIUS), RADIUS, 96)
    scene = scene_of(floor, ball, camera=CAMERA)
    estimators = tuple(reflection(exponent, from_camera=True) for exponent in EXPONENTS)
    both = {}
    for divided in (False, True):
        (baked,) = bake(scene, flat_settings(estimators, width=SIZE, height=SIZE, rays=rays, divide_horizon=divided))
        both[divided] = baked.maps
    return both


def _row(maps: Maps, exponent: float) -> dict[str, float]:
    """An open piece of the floor, 8 texels a side, in front of the camera and clear of the ball."""
    piece = np.s_[SIZE - 16 : SIZE - 8, SIZE // 2 - 4 : SIZE // 2 + 4]
    angles = _angles()[piece]
    name = reflection(exponent).name
    return {
        "exponent": exponent,
        "angle": float(np.degrees(angles.mean())),
        "formula": float(np.mean([open_horizon(exponent, angle) for angle in angles.ravel()])),
        "kept": float(maps[False][name].values[piece].mean()),
        "divided": float(maps[True][name].values[piece].mean()),
    }


def _angles() -> Doubles:
    """Between R and the floor's normal, at each texel's middle."""
    middle = FLOOR * ((np.arange(SIZE) + 0.5) / SIZE - 0.5)
    x, y = np.meshgrid(middle, middle[::-1])
    eye = CAMERA.position
    return np.arctan2(np.hypot(x - eye[0], y - eye[1]), eye[2])


def _draw(maps: Maps) -> None:
    """Columns: as it stands, divided. Rows: the exponents. The floor from above, the camera at the left."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(5.6, 5.7), layout="constrained")
    axes = figure.subplots(2, 2)
    for row, exponent in zip(axes, EXPONENTS, strict=True):
        for axis, divided in zip(row, (False, True), strict=True):
            values = maps[divided][reflection(exponent).name].values
            axis.imshow(np.clip(values, 0.0, 1.0), cmap="gray", vmin=0.0, vmax=1.0, interpolation="nearest")
            axis.plot(SIZE * (CAMERA.position[0] / FLOOR + 0.5), SIZE / 2, marker=">", color="tab:orange", markersize=9)
            axis.set(xticks=[], yticks=[], title=f"exponent {exponent:g}, {'divided' if divided else 'as it stands'}")
    PICTURE.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(PICTURE, dpi=80)

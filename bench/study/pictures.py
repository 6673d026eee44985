"""What one ray a texel looks like: AO in the open, and RO of a sample scene seen from its camera."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from matplotlib import pyplot as plt

from ...core.rays.map_spec import reflection, sampled
from ...tests.oracles.naive_estimators import one_ray_estimates
from ...tests.oracles.wall_and_open import EXPONENTS, cases
from ..plots import COLOURS, panels, save

TEXELS = 64  # a side, of the open floor
SCENE, TEXTURE = "suzanne", 512
RAYS = (1, 100)
SIZE = (384, 240)  # of a panel, in pixels
SAMPLERS = {"uniform sphere": "uniform_sphere", "lobe": "importance"}
GREYS = 48  # levels of grey kept: noise of 256 would make a large file


def draw(folder: Path) -> None:
    """Both pictures."""
    draw_open(folder)
    draw_reflections(folder)


def draw_open(folder: Path) -> None:
    """open_one_ray.png: a texture of an open floor by each estimator, one random ray a texel."""
    estimators = [case for case in cases("open") if case.map == "AO"]
    figure, axes = panels(1, 3, "AO in the open, one ray a texel: only the cosine's rays all count the same", 3.9)
    for axis, case in zip(axes, estimators, strict=True):
        texture = one_ray_estimates(case, TEXELS**2, seed=0).reshape(TEXELS, TEXELS)
        shown = axis.imshow(texture, cmap="gray", vmin=0, vmax=2, interpolation="nearest")
        told = f"mean {texture.mean():.3f}, from {texture.min():.2f} to {texture.max():.2f}"
        axis.set(xticks=[], yticks=[], xlabel=told)
        axis.set_title(f"{case.name}: spread {texture.std():.2f}", color=COLOURS[case.name])
        axis.grid(visible=False)
        axis.spines[:].set_visible(False)
    figure.colorbar(shown, ax=axes, shrink=0.8, extend="max", label="value (1 is right)", ticks=[0, 0.5, 1, 1.5, 2])
    save(figure, folder / "open_one_ray.png")


def draw_reflections(folder: Path) -> None:
    """reflections.png: naive above, lobe below, by exponent and number of rays, pixel for pixel. Needs Blender."""
    from .seen import Views

    views, columns = Views(SCENE, SIZE), [(exponent, rays) for exponent in EXPONENTS for rays in RAYS]
    (width, height), gap, left, top = SIZE, 6, 34, 30
    whole = (left + len(columns) * (width + gap), top + len(SAMPLERS) * (height + gap))
    figure = plt.figure(figsize=(whole[0] / 100, whole[1] / 100), dpi=100)
    centred: dict[str, Any] = {"ha": "center", "va": "center", "size": 14}
    for x, (exponent, rays) in enumerate(columns):
        corner, head = left + x * (width + gap), f"exponent {exponent:g}, N = {rays}"
        figure.text((corner + width / 2) / whole[0], 1 - 15 / whole[1], head, **centred)
        for y, sampler in enumerate(SAMPLERS.values()):
            picture = views.seen(sampled(reflection(exponent, from_camera=True), sampler), rays, TEXTURE)
            bottom = whole[1] - top - y * (height + gap) - height
            figure.figimage(picture, corner, bottom, cmap="gray", vmin=0, vmax=1, origin="upper")
    for y, name in enumerate(SAMPLERS):
        middle = whole[1] - top - y * (height + gap) - height / 2
        figure.text(15 / whole[0], middle / whole[1], name, rotation=90, **centred)
    save(figure, folder / "reflections.png", colours=GREYS)

"""What one ray a texel looks like: AO in the open, and RO of a sample scene seen from its camera."""

from __future__ import annotations

from collections.abc import Sequence
from io import BytesIO
from pathlib import Path

from matplotlib import pyplot as plt
from PIL import Image

from ...core.base.arrays import Doubles
from ...core.rays.map_spec import MapSpec, Sampler, reflection
from . import style
from .cases import EXPONENTS, cases
from .naive import one_ray_estimates

TEXELS = 64  # a side, of the open floor
SCENE, TEXTURE = "suzanne", 512
RAYS = (1, 100)
SIZE = (384, 240)  # of a panel, in pixels
GREYS = 48  # levels of grey kept: noise of 256 would make a large file


def draw_open(folder: Path) -> None:
    """open_one_ray.png: a texture of an open floor by each estimator, one random ray a texel."""
    estimators = [case for case in cases("open") if case.map == "AO"]
    figure, axes = style.panels(1, 3, "AO in the open, one ray a texel: only the cosine's rays all count the same", 3.9)
    for axis, case in zip(axes, estimators, strict=True):
        texture = one_ray_estimates(case, TEXELS**2, seed=0).reshape(TEXELS, TEXELS)
        shown = axis.imshow(texture, cmap="gray", vmin=0, vmax=2, interpolation="nearest")
        axis.set(
            xticks=[], yticks=[], xlabel=f"mean {texture.mean():.3f}, from {texture.min():.2f} to {texture.max():.2f}"
        )
        axis.set_title(f"{case.name}: spread {texture.std():.2f}", color=style.COLOURS[case.name])
        axis.grid(visible=False)
        axis.spines[:].set_visible(False)
    figure.colorbar(shown, ax=axes, shrink=0.8, extend="max", label="value (1 is right)", ticks=[0, 0.5, 1, 1.5, 2])
    style.save(figure, folder / "open_one_ray.png")


def draw_reflections(folder: Path) -> None:
    """reflections.png: naive above, lobe below, by exponent and number of rays. Needs Blender as a module."""
    from .seen import Views

    views = Views(SCENE, SIZE)
    rows: dict[Sampler, list[Doubles]] = {Sampler.UNIFORM_SPHERE: [], Sampler.LOBE: []}
    columns = [(exponent, rays) for exponent in EXPONENTS for rays in RAYS]
    for exponent, rays in columns:
        plain = reflection(exponent, from_camera=True)
        for sampler, row in rows.items():
            row.append(views.seen(MapSpec(plain.name, exponent, plain.axis, sampler), rays, TEXTURE))
    heads = [f"exponent {exponent:g}, N = {rays}" for exponent, rays in columns]
    _compose(list(rows.values()), heads, ("uniform sphere", "lobe"), folder / "reflections.png")


def _compose(rows: Sequence[Sequence[Doubles]], heads: Sequence[str], names: Sequence[str], path: Path) -> None:
    """Pixel for pixel, heads above the columns and names beside the rows."""
    (width, height), gap, left, top = SIZE, 6, 34, 30
    whole = (left + len(heads) * (width + gap), top + len(rows) * (height + gap))
    figure = plt.figure(figsize=(whole[0] / 100, whole[1] / 100), dpi=100)
    for y, row in enumerate(rows):
        bottom = whole[1] - top - y * (height + gap) - height
        figure.text(
            15 / whole[0], (bottom + height / 2) / whole[1], names[y], rotation=90, ha="center", va="center", size=14
        )
        for x, picture in enumerate(row):
            corner = left + x * (width + gap)
            figure.figimage(picture, corner, bottom, cmap="gray", vmin=0, vmax=1, origin="upper")
            if y == 0:
                figure.text(
                    (corner + width / 2) / whole[0], 1 - 15 / whole[1], heads[x], ha="center", va="center", size=14
                )
    buffer = BytesIO()
    figure.savefig(buffer, format="png", dpi=100)
    plt.close(figure)
    style.compact(Image.open(buffer), GREYS, path)

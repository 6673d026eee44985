"""How far one bake is from another: figures, and a picture to look at."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..base.arrays import Doubles, Flags, Floats
from ..base.errors import InputError
from .image_file import openimageio

_GAP = 8
_PAPER, _INK, _UNCOVERED = 1.0, 0.1, 0.45
_SMALLEST_PANEL = 384
# Position from -1 to 1, then red, green, blue. Blue against red stays apart in every common colour blindness, the
# lightness falls evenly on both sides, and no stop is the grey of uncovered texels.
_DIVERGING = np.array(
    [
        [-1.0, 0.03, 0.12, 0.42],
        [-0.5, 0.25, 0.50, 0.85],
        [0.0, 0.97, 0.97, 0.97],
        [0.5, 0.92, 0.45, 0.30],
        [1.0, 0.45, 0.02, 0.08],
    ]
)


@dataclass(frozen=True)
class Comparison:
    """Differences of ours - reference over the compared texels, in visibility.

    texels: how many. rmse: root of the mean square. bias: mean, above 0 where ours is brighter. p99: 99th percentile of
    the size of the difference. worst: its maximum.
    """

    texels: int
    rmse: float
    bias: float
    p99: float
    worst: float


def compare(ours: Floats, reference: Floats, mask: Flags) -> Comparison:
    """Compare two bakes of the same surface.

    ours, reference: (h, w) float32. mask: (h, w) bool, the texels that count. Computed in float64. Raises InputError
    for shapes that differ, an empty mask, or values under it that are not finite.
    """
    difference = _difference(ours, reference, mask)
    size = np.abs(difference)
    return Comparison(
        texels=len(difference),
        rmse=float(np.sqrt(np.mean(difference**2))),
        bias=float(np.mean(difference)),
        p99=float(np.percentile(size, 99.0)),
        worst=float(size.max()),
    )


def noise(a: Floats, b: Floats, mask: Flags) -> float:
    """The noise of one bake (its RMSE about its own expectation) from two that differ by their seed alone.

    The difference of two independent equals has twice the variance of one, so sigma = sqrt(mean((a - b)²) / 2); what
    both have in common, bias, cancels. a, b, mask: as in `compare`, as are the errors.
    """
    return compare(a, b, mask).rmse / math.sqrt(2.0)


def comparison_image(
    ours: Floats, reference: Floats, mask: Flags, names: tuple[str, str] = ("Occlusion Bake", "Cycles")
) -> Floats:
    """Three panels side by side, with captions: ours, reference, and the signed difference with its colour bar.

    Arguments and errors as in `compare`; names: captions of the first two panels. Returns (h', w', 3) float32 in
    [0, 1], to be written at depth 8. Panels show the linear values as grey as they are: an occlusion map is looked at
    raw, and 0.5 then appears half-way between black and white. Difference: blue where ours is darker, red where it is
    brighter, white where they agree; the bar ends at the 99th percentile, rounded up to 1, 2 or 5 times a power of ten.
    Uncovered texels are grey. Small images are enlarged by whole factors. Captions are drawn with the font that
    OpenImageIO carries; where it finds none they stay empty.
    """
    figures = compare(ours, reference, mask)
    reach = _readable(figures.p99 or figures.worst)
    signed = np.subtract(ours, reference, dtype=np.float64) / reach
    shown = [_grey(ours, mask), _grey(reference, mask), _coloured(signed, mask)]
    factor = max(1, math.ceil(_SMALLEST_PANEL / mask.shape[1]))
    shown = [panel.repeat(factor, axis=0).repeat(factor, axis=1) for panel in shown]
    width = shown[0].shape[1]
    line = max(24, width // 18)
    titles = [*names, f"{names[0]} minus {names[1]}"]
    under = [_mean_caption(ours, mask), _mean_caption(reference, mask), ""]
    columns = [_column(panel, title, text, line) for panel, title, text in zip(shown, titles, under, strict=True)]
    columns[2][-2 * line :] = _legend(width, line, reach, figures)
    return _beside(columns)


def _difference(ours: Floats, reference: Floats, mask: Flags) -> Doubles:
    if not ours.shape == reference.shape == mask.shape or mask.ndim != 2:
        raise InputError(
            f"comparison: images {ours.shape} and {reference.shape} and mask {mask.shape} differ; bake at one size"
        )
    if not mask.any():
        raise InputError("comparison: no texel is covered in both images; check that they use the same UV map")
    difference: Doubles = ours[mask].astype(np.float64) - reference[mask]
    broken = int(np.count_nonzero(~np.isfinite(difference)))
    if broken:
        raise InputError(f"comparison: {broken} texels are not finite numbers; bake the image that holds them again")
    return difference


def _readable(size: float) -> float:
    """`size` rounded up to 1, 2 or 5 times a power of ten; 0.001 for two images that agree."""
    if size <= 0.0:
        return 1e-3
    decade = 10.0 ** math.floor(math.log10(size))
    return next((step * decade for step in (1.0, 2.0, 5.0) if size <= step * decade * (1.0 + 1e-9)), 10.0 * decade)


def _grey(values: Floats, mask: Flags) -> Floats:
    shown = np.where(mask, np.clip(values, 0.0, 1.0), np.float32(_UNCOVERED))
    return np.repeat(shown[..., None], 3, axis=2).astype(np.float32)


def _coloured(signed: Doubles, mask: Flags) -> Floats:
    """Colours of differences in units of the bar's end, (h, w, 3)."""
    signed = np.where(mask, signed, 0.0)
    channels = [np.interp(signed, _DIVERGING[:, 0], _DIVERGING[:, 1 + channel]) for channel in range(3)]
    return np.where(mask[..., None], np.stack(channels, axis=-1), _UNCOVERED).astype(np.float32)


def _mean_caption(values: Floats, mask: Flags) -> str:
    return f"mean {values[mask].mean(dtype=np.float64):.4f}, {np.count_nonzero(mask):,} texels"


def _column(panel: Floats, title: str, text: str, line: int) -> Floats:
    """A panel under its title, with two lines of room beneath it."""
    width = panel.shape[1]
    above, below = _paper(line, width), _paper(2 * line, width)
    return np.concatenate([_written(above, title, line), panel, _written(below, text, line)])


def _legend(width: int, line: int, reach: float, figures: Comparison) -> Floats:
    """The colour bar with its ends named, above the figures: (2 * line, width, 3)."""
    bar = _paper(line, width)
    inner = slice(3 * width // 10, width - 3 * width // 10)
    ramp = np.linspace(-1.0, 1.0, inner.stop - inner.start)[None]
    bar[line // 4 : -(line // 4), inner] = _coloured(ramp, np.ones_like(ramp, dtype=bool))
    bar[:, : inner.start] = _written(_paper(line, inner.start), f"darker -{reach:g}", line)
    bar[:, inner.stop :] = _written(_paper(line, width - inner.stop), f"+{reach:g} brighter", line)
    text = f"RMSE {figures.rmse:.4g}, bias {figures.bias:+.2g}, 99 % within {figures.p99:.2g}"
    return np.concatenate([bar, _written(_paper(line, width), text, line)])


def _beside(columns: list[Floats]) -> Floats:
    height = columns[0].shape[0]
    gap = _paper(height, _GAP)
    row = np.concatenate([gap, columns[0], gap, columns[1], gap, columns[2], gap], axis=1)
    edge = _paper(_GAP, row.shape[1])
    return np.concatenate([edge, row, edge])


def _paper(height: int, width: int) -> Floats:
    return np.full((height, width, 3), _PAPER, dtype=np.float32)


def _written(strip: Floats, text: str, line: int) -> Floats:
    """The strip with one line of text in its middle, at most `line` high and shrunk to its width."""
    if not text:
        return strip
    library = openimageio()
    height, width, _ = strip.shape
    size = round(0.7 * line)
    extent = library.ImageBufAlgo.text_size(text, size)
    if extent.width > width - _GAP:
        size = max(6, size * (width - _GAP) // extent.width)
    canvas: Any = library.ImageBuf(library.ImageSpec(width, height, 3, "float"))
    canvas.set_pixels(library.ROI(0, width, 0, height, 0, 1, 0, 3), strip)
    drawn = library.ImageBufAlgo.render_text(
        canvas, width // 2, 7 * line // 10, text, size, "", (_INK, _INK, _INK), "center", "baseline"
    )
    canvas.geterror()  # a missing font is no fault of the comparison; an error left unread would be printed at exit
    return np.clip(canvas.get_pixels("float"), 0.0, 1.0).astype(np.float32) if drawn else strip

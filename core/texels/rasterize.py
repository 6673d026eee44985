"""UV triangles to texels: which triangle owns each, how much of it is covered, where it lies on the surface."""

from __future__ import annotations

from collections.abc import Iterator
from ctypes import byref
from dataclasses import dataclass

import numpy as np

from ..base import kernel_api as api
from ..base.arrays import Flags, Floats, Ints, Longs
from ..base.errors import InputError

_MUCH_UNOWNED = 0.25  # of the surface in triangles without a texel: the image is too small for them


@dataclass(frozen=True, eq=False)
class Texels:
    """The texels of one mesh in one image.

    owner: (H, W) int32, the triangle that covers most of the texel, -1 none. coverage: (H, W) float32, the share of the
    texel that triangles cover, at most 1. count: those with an owner; overlapped: those that triangles cover more than
    wholly. warnings: a line each on UVs that cannot be baked as they are.
    """

    owner: Ints
    coverage: Floats
    count: int
    overlapped: int
    warnings: list[str]

    @property
    def covered(self) -> Flags:
        """(H, W) bool: texels that some triangle covers in part; conservative, none is left out."""
        mask: Flags = self.owner >= 0
        return mask


def rasterize(
    name: str,
    uv: Floats,
    width: int,
    height: int,
    *,
    skip: Flags | None = None,
    tiled: bool = False,
    threads: int = 0,
    control: api.Control | None = None,
) -> Texels:
    """Find the texels of (T, 3, 2) UVs in a width × height image; `skip` (T,) leaves triangles out. tiled: what lies
    outside of the image is in those of other tiles.

    The largest coverage owns a texel; of equals the later triangle, as in Cycles. Raises InputError where no texel is
    covered, Cancelled.
    """
    owner = np.empty((height, width), dtype=np.int32)
    coverage = np.empty((height, width), dtype=np.float32)
    report = _rasterize(uv, owner, coverage, api.RULE_COVERAGE, skip, threads, control)
    if report.covered == 0:
        raise InputError(f"{name}: {_why_none(report, uv)}; unwrap it anew, or bake with chart UVs (--uv charts)")
    if tiled:
        report.outside = 0  # other tiles have it
    warnings = _warnings(name, report, uv, owner, skip)
    return Texels(owner, coverage, int(report.covered), int(report.overlapped), warnings)


def owners_by_centre(uv: Floats, width: int, height: int, *, threads: int = 0) -> Ints:
    """(H, W) int32 owners by Cycles' rule: the last triangle over (x + 0.501, y + 0.502), y from below; -1 none."""
    owner = np.empty((height, width), dtype=np.int32)
    _rasterize(uv, owner, None, api.RULE_CENTRE, None, threads, None)
    return owner


def in_bands(texels: Longs, size: int) -> Iterator[Longs]:
    """So many of the listed texels at a time: what is worked out for each need not be held for all."""
    return (texels[start : start + size] for start in range(0, len(texels), size))


def _rasterize(
    uv: Floats,
    owner: Ints,
    coverage: Floats | None,
    rule: int,
    skip: Flags | None,
    threads: int,
    control: api.Control | None,
) -> api.RasterReport:
    height, width = owner.shape
    report = api.RasterReport()
    flags = None if skip is None else np.ascontiguousarray(skip, dtype=np.uint8)
    status = api.library().ob_rasterize(
        api.address(uv, np.float32, len(uv), 3, 2),
        len(uv),
        api.address(flags, np.uint8, len(uv)),
        width,
        height,
        rule,
        threads,
        api.address(owner, np.int32, height, width),
        api.address(coverage, np.float32, height, width),
        byref(report),
        api.pointer_to(control),
    )
    api.check(status)
    return report


def _why_none(report: api.RasterReport, uv: Floats) -> str:
    if report.outside == len(uv):
        return "all of its UVs lie outside the 0-1 square"
    counts = (
        f"of {len(uv)} triangles {report.degenerate} have no area in the texture, {report.outside} leave its square"
    )
    return f"its UVs cover no texel ({counts})"


def _warnings(name: str, report: api.RasterReport, uv: Floats, owner: Ints, skip: Flags | None) -> list[str]:
    lines = []
    if report.overlapped:
        share = 100.0 * report.overlapped / max(report.covered, 1)
        lines.append(
            f"{name}: UVs overlap on {report.overlapped} of {report.covered} texels ({share:.1f} %); "
            "each shows one of its faces"
        )
    if report.outside:
        lines.append(f"{name}: {report.outside} triangles leave the 0-1 UV square; what lies outside is not baked")
    if report.degenerate:
        lines.append(f"{name}: {report.degenerate} triangles have no area in the texture and get no texels")
    if not report.overlapped and not report.outside and (share := _unowned_share(uv, owner, skip)) >= _MUCH_UNOWNED:
        lines.append(
            f"{name}: {100.0 * share:.0f} % of its surface in the texture lies in triangles without a texel of their "
            "own; detail finer than texels is averaged, and a larger image shows it"
        )
    return lines


def _unowned_share(uv: Floats, owner: Ints, skip: Flags | None) -> float:
    """The share, by area in the texture, of the triangles that own no texel; those that are skipped do not count."""
    edges = uv[:, 1:] - uv[:, :1]
    areas = np.abs(edges[:, 0, 0] * edges[:, 1, 1] - edges[:, 0, 1] * edges[:, 1, 0]).astype(np.float64)
    areas[~np.isfinite(areas)] = 0.0
    if skip is not None:
        areas[skip] = 0.0
    whole = float(areas.sum())
    owned = np.zeros(len(areas) + 1, dtype=np.bool_)
    owned[owner] = True  # -1, none, is the last
    areas[owned[:-1]] = 0.0
    return float(areas.sum()) / whole if whole > 0.0 else 0.0

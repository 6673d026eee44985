"""Texels that see the surface badly: at its rim, thinner than a texel, mirrored, overlapping, at seams, stretched."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np

from ....core.base.arrays import Doubles
from ....core.scene.scene import Mesh, Scene
from ..shapes import SKEW, UNIT_SQUARE, bowl, box, cylinder, grid, plane, quads, scene, sphere
from .case import Case, Judged, View
from .faces import ball as ball_above
from .faces import outer_open, paper_box, shadow
from .seams import no_seam, scattered

VAST = 4000.0  # half the side of a floor: what it leaves of the sky below the horizon is 4e-4 at most
OPENING = np.radians(60.0)


def _turned_charts() -> Scene:
    """The paper box, each of its charts turned by 30° so that most texels at their rims have their centre off them."""
    made = paper_box(0.0)
    assert made.uv is not None
    uv = made.uv.astype(np.float64).reshape(-1, 6, 2)  # a chart is two triangles
    middle = 0.5 * (uv.min(axis=1, keepdims=True) + uv.max(axis=1, keepdims=True))
    cos, sin = np.cos(np.pi / 6), np.sin(np.pi / 6)
    turned = middle + 0.7 * (uv - middle) @ np.array([(cos, sin), (-sin, cos)])
    return scene(replace(made, uv=turned.reshape(-1, 3, 2).astype(np.float32)), under=SKEW)


STRIPS = 24


def _strips() -> Mesh:
    """The four sides of a paper box cut into strips, each a chart a tenth of a texel wide (at 64)."""
    inner, outer = 0.99, 1.0
    edges = np.linspace(-1.0, 1.0, STRIPS // 4 + 1)
    sheets = []
    for half, flip in ((outer, False), (inner, True)):
        for side in range(4):
            out = np.array([(0, -1), (1, 0), (0, 1), (-1, 0)])[side]
            along = np.array([(1, 0), (0, 1), (-1, 0), (0, -1)])[side]
            for a, b in pairwise(edges):
                foot = half * np.array([out + a * along, out + b * along])
                corners = np.array([(*foot[0], -half), (*foot[1], -half), (*foot[1], half), (*foot[0], half)])
                sheets.append(corners[::-1] if flip else corners)
    count = len(sheets)
    starts = (np.arange(count, dtype=np.int64) + 0.45) / count
    uv = starts[:, None, None] * np.array([1.0, 0.0]) + UNIT_SQUARE * np.array([0.1 / 64, 0.8]) + np.array([0, 0.1])
    return quads(np.stack(sheets), uv, "strips")


def _thin_charts() -> Scene:
    """Strips and the caps that close them; the caps are an object of their own."""
    shells = [box((-h, -h, -h), (h, h, h), name=name) for h, name in ((1.0, "caps"), (0.99, "inner caps"))]
    caps = [replace(shell, triangles=np.ascontiguousarray(shell.triangles[8:]), uv=None) for shell in shells]
    return scene(_strips(), *caps, under=SKEW)


def _strip_open(view: View) -> Doubles:
    return np.where(view.owner < 2 * STRIPS, 1.0, 0.0)


def _plain_floor() -> Scene:
    return scene(plane(2.0), ball_above(), under=SKEW)


def _evenly_spread() -> Scene:
    """Cells whose UVs are as many to a tile: each has others at its place in the other tiles."""
    made = grid(2.0, 16)
    assert made.uv is not None
    return scene(replace(made, uv=made.uv * np.float32(2.0)), ball_above(), under=SKEW)


def _mirrored_uv() -> Scene:
    made = plane(2.0)
    assert made.uv is not None
    return scene(
        replace(made, uv=made.uv * np.array([-1, 1], np.float32) + np.array([1, 0], np.float32)),
        ball_above(),
        under=SKEW,
    )


def _overlapping() -> Scene:
    """The paper box with the inner sheet's charts on the outer's: the later triangles are the inner ones."""
    made = paper_box(0.0)
    assert made.uv is not None
    return scene(replace(made, uv=np.concatenate([made.uv[:12], made.uv[:12]])), under=SKEW)


def _seam_ball() -> Scene:
    return scene(scattered(sphere((0, 0, 1.5), segments=64), 4), plane(VAST), under=SKEW)


def _seam_cylinder() -> Scene:
    return scene(scattered(cylinder(segments=96), 6), plane(VAST, -0.25), under=SKEW)


def _seam_bowl() -> Scene:
    return scene(scattered(bowl(OPENING), 4), under=SKEW)


def _over_vast_floor(view: View) -> Doubles:
    """A convex body sees the sky's part of its hemisphere: (1 + n_z)/2, whatever its height."""
    up = view.target.matrix[:3, 2] / np.linalg.norm(view.target.matrix[:3, 2])
    return 0.5 + 0.5 * (view.points[1] @ up)


def _in_bowl(view: View) -> Doubles:
    """The same at every point: (1 - cos θ)/2."""
    return np.full(view.covered.shape, 0.5 - 0.5 * np.cos(OPENING))


def _long(size: tuple[int, int]) -> Case:
    width, height = size
    return Case(
        f"non-square texture, {width}x{height}",
        "The exact shadow of a ball on a floor.",
        "",
        _plain_floor,
        expected=shadow,
        size=size,
        slack=2.5e-2,
        mean_slack=1e-3,
    )


def _all_strips(judged: Judged) -> list[str]:
    found = len(np.unique(judged.view.owner[judged.view.covered] // 2))
    return [] if found == 2 * STRIPS else [f"{found} of {2 * STRIPS} strips have texels"]


CASES = (
    Case(
        "texels whose centre lies off the mesh",
        "Charts turned by 30° in a coarse texture, of a box of two sheets a side: 1 outside, 0 inside, to the rim.",
        "It bakes the texels whose centre a triangle covers, and no others.",
        _turned_charts,
        expected=outer_open,
        size=(48, 48),
        rays=32,
    ),
    Case(
        "charts thinner than a texel",
        "Strips a tenth of a texel wide, those outside a box 1, those inside 0; every strip gets its texels.",
        "It leaves out every strip that no texel's centre hits.",
        _thin_charts,
        expected=_strip_open,
        extra=_all_strips,
    ),
    Case(
        "a grid over four UDIM tiles",
        "The exact shadow of a ball on a floor, in all four, though tile for tile the UVs are alike.",
        "Baked with the four in one image.",
        _evenly_spread,
        expected=shadow,
        tiles=(2, 2),
        slack=1e-2,
        mean_slack=1e-3,
    ),
    Case(
        "mirrored UVs",
        "The texture of the unmirrored UVs, mirrored, within noise.",
        "",
        _mirrored_uv,
        twin=_plain_floor,
        from_twin=lambda image: image[:, ::-1],
    ),
    Case(
        "overlapping UVs",
        "Each texel shows one face, the later of equals, here the inside of a box: 0. A line warns of it.",
        "",
        _overlapping,
        expected=lambda view: np.zeros(view.covered.shape),
        warns="overlap",
    ),
    Case(
        "UV seams on a ball",
        "Over a vast floor, in four charts, each turned otherwise: (1 + n_z)/2, and both sides of a seam agree.",
        "",
        _seam_ball,
        expected=_over_vast_floor,
        slack=1e-2,
        mean_slack=1e-3,
        extra=no_seam(2e-2),
    ),
    Case(
        "UV seams on a cylinder",
        "Standing over a vast floor, in six charts: (1 + n_z)/2, and both sides of a seam agree.",
        "",
        _seam_cylinder,
        expected=_over_vast_floor,
        slack=1e-2,
        mean_slack=1e-3,
        extra=no_seam(2e-2),
    ),
    Case(
        "UV seams in a bowl",
        "The inside of a ball with an opening of half-angle 60°, in four charts: 0.25 everywhere, at seams too.",
        "",
        _seam_bowl,
        expected=_in_bowl,
        slack=6e-3,
        mean_slack=1e-3,
        extra=no_seam(1e-2),
    ),
    _long((256, 16)),
    _long((32, 64)),
)

"""Faces that lie on, near or in one another, face the wrong way, or hardly exist."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np

from ....core.base.arrays import Doubles
from ....core.scene.scene import Mesh, Scene
from ..shapes import (
    SKEW,
    UNIT_SQUARE,
    box,
    grid,
    grid_cells,
    in_cell,
    joined,
    moved,
    plane,
    quad,
    quads,
    rimmed_room,
    scene,
    skewed,
    sphere,
    turned_over,
)
from . import exact
from .case import Case, View

BALL = ((0.2, 0.1, 0.7), 0.6)
GAPS = (1e-7, 1e-6, 1e-5, 1e-4, 1e-3)


def ball(smooth: bool = True) -> Mesh:
    """The one above the floor, of 96 segments: its silhouette is 1e-3 smaller than a true ball's."""
    return sphere(*BALL, segments=96, smooth=smooth)


def shadow(view: View) -> Doubles:
    """Of the ball, on the floor."""
    return exact.ball_above_floor(view.local, *BALL)


def _on_floor() -> Scene:
    return scene(plane(2.0), ball(), under=SKEW)


def _coincident() -> Scene:
    """Two more floors where the floor is, cut up and turned otherwise, so that no bit of them agrees."""
    return scene(plane(2.0), ball(), grid(3.0, 7, 0.4, "again"), plane(2.5, name="below", up=-1.0), under=SKEW)


def _gap_tiles() -> list[Mesh]:
    """Five floor tiles side by side, a chart each."""
    cells = grid_cells(len(GAPS), 1)
    return [quad((i / 5 - 0.5, -0.5, 0), (0.18, 0, 0), (0, 1, 0), cell, 0.05, "tiles") for i, cell in enumerate(cells)]


def _near_above() -> Scene:
    """Each tile in a closed box of its own, the lid at its gap."""
    lids = [box((i / 5 - 0.505, -0.51, -0.1), (i / 5 - 0.315, 0.51, gap), name=f"{gap}") for i, gap in enumerate(GAPS)]
    return scene(joined(_gap_tiles(), "tiles"), *lids, under=skewed((1, 2, 3)))


def _near_below() -> Scene:
    sheets = [quad((i / 5 - 0.505, -0.6, -gap), (0.19, 0, 0), (0, 1.2, 0), name=f"{gap}") for i, gap in enumerate(GAPS)]
    return scene(joined(_gap_tiles(), "tiles"), *sheets, under=skewed((1, 2, 3)))


def _closed_from(smallest: float, view: View) -> Doubles:
    """0 on the tiles (two triangles each) whose gap is as large, else 1."""
    return np.where(np.array(GAPS)[np.maximum(view.owner, 0) // 2] >= smallest, 0.0, 1.0)


def _standing() -> Scene:
    """A box on a wide slab, their faces in one plane."""
    slab = box((-2000, -2000, -50), (2000, 2000, 0), name="slab")
    return scene(box((-1, -1, 0), (1, 1, 2)), slab, under=skewed((1, 2, 3)))


def _stood(view: View) -> Doubles:
    """By the direction of the face: the bottom closed, the sides half open, the top open."""
    linear = view.target.matrix[:3, :3]
    visible: Doubles = 0.5 + 0.5 * np.round((view.geometric @ linear)[..., 2], 3)
    return visible


def _half_sunk() -> Scene:
    return scene(plane(2.0), sphere(radius=1.0, segments=128), under=SKEW)


def _sunk(view: View) -> Doubles:
    """Known but for the texels that the ball's outline crosses."""
    right = exact.ball_half_sunk(view.local, 1.0)
    near = np.abs(np.linalg.norm(view.local[..., :2], axis=-1) - 1.0) < 0.07
    return np.where(near, np.nan, right)


def paper_box(thickness: float) -> Mesh:
    """A box of two sheets: the outer, the first twelve triangles, faces out, the inner, so much smaller, faces in."""
    left, right = grid_cells(2, 1)
    inner = 1.0 - thickness
    return joined(
        [
            box(cell=left, name="outer"),
            box((-inner, -inner, -inner), (inner, inner, inner), right, inward=True, name="inner"),
        ],
        "paper box",
    )


def _paper() -> Scene:
    return scene(paper_box(0.0), under=SKEW)


def outer_open(view: View) -> Doubles:
    """1 on the first twelve triangles, 0 on the others."""
    return np.where(view.owner < 12, 1.0, 0.0)


SHEET = ((-0.7, -0.4), (0.5, 0.6), 0.5)


def _sheet() -> Scene:
    low, high, height = SHEET
    lid = quad((*low, height), (high[0] - low[0], 0, 0), (0, high[1] - low[1], 0), name="sheet")
    return scene(plane(1.0), lid, under=SKEW)


def _inside_out() -> Scene:
    """A box inside out beside one that is not, out of each other's reach."""
    left, right = grid_cells(2, 1)
    pair = joined([moved(box(cell=left), (-10, 0, 0)), moved(box(cell=right, inward=True), (10, 0, 0))], "boxes")
    return scene(pair, under=skewed((5, 6, 7)))


def _every_other() -> Scene:
    made = box()
    triangles, uv = made.triangles.copy(), np.array(made.uv)
    triangles[1::2], uv[1::2] = triangles[1::2][:, [0, 2, 1]], uv[1::2][:, [0, 2, 1]]
    return scene(replace(made, triangles=triangles, uv=uv), under=SKEW)


PAGES, PAGE_WIDTH = 12, 400.0


def _fan() -> Scene:
    """Twelve pages on one edge, the edge's two vertices shared by all of them."""
    turn = 2 * np.pi * np.arange(PAGES, dtype=np.int64) / PAGES
    ends = np.stack([np.cos(turn), np.zeros(PAGES), np.sin(turn)], axis=-1)
    half = np.array([0, 0.5 * PAGE_WIDTH, 0])
    corners = np.concatenate([[-half, half], ends - half, ends + half])
    i = np.arange(PAGES, dtype=np.int64)
    faces = np.stack([np.zeros_like(i), i + 2, i + 2 + PAGES, np.ones_like(i)], axis=1).astype(np.int32)
    uv = np.stack([in_cell(UNIT_SQUARE, cell, 0.06) for cell in grid_cells(4, 3)])
    return scene(quads(corners, uv, "pages", faces), under=skewed((1, 2, 3)))


def _between_pages(view: View) -> Doubles:
    """A page sees past the end of the next: A = (1 - cos φ)/2, φ up from the page, away from the edge."""
    points = view.local
    distance = np.linalg.norm(points[..., [0, 2]], axis=-1)
    step = 2 * np.pi / PAGES
    angle = np.arctan2(np.sin(step), np.cos(step) - distance)
    middle = (np.abs(points[..., 1]) < 0.25 * PAGE_WIDTH) & (distance < 0.8)
    return np.where(middle, 0.5 - 0.5 * np.cos(angle), np.nan)


def _needle_floor() -> Mesh:
    """A floor of 200 strips, every other one 1e-6 wide, each cut along its diagonal: needles of 4,000,000 : 1."""
    steps = np.tile([0.04 - 1e-6, 1e-6], 100)
    edges = np.concatenate([[0.0], np.cumsum(steps)])
    corners = np.stack([UNIT_SQUARE * (b - a, 4.0) + (a - 2.0, -2.0) for a, b in pairwise(edges)])
    return quads(np.concatenate([corners, np.zeros((*corners.shape[:2], 1))], axis=2), (corners + 2) / 4, "floor")


def _needles() -> Scene:
    return scene(_needle_floor(), ball(), under=SKEW)


def _doubled() -> Scene:
    """A floor with every other triangle twice."""
    made = grid(2.0, 7, name="floor")
    assert made.uv is not None
    triangles, uv = np.concatenate([made.triangles, made.triangles[::2]]), np.concatenate([made.uv, made.uv[::2]])
    return scene(replace(made, triangles=triangles, uv=uv), ball(), under=SKEW)


def _undoubled() -> Scene:
    return scene(grid(2.0, 7, name="floor"), ball(), under=SKEW)


def _flat_triangles() -> Scene:
    """A floor with triangles on one line, or in one point, that claim the whole texture."""
    made = grid(2.0, 7, name="floor")
    assert made.uv is not None
    flat = np.array([(0, 3, 6), (0, 9, 18), (5, 5, 5), (7, 7, 20)], dtype=np.int32)
    wide = np.repeat(np.array([[(0, 0), (2, 0), (0, 2)]], dtype=np.float32), len(flat), axis=0)
    triangles, uv = np.concatenate([made.triangles, flat]), np.concatenate([made.uv, wide])
    return scene(replace(made, triangles=triangles, uv=uv), ball(), under=SKEW)


def hollow_ball(smooth: bool) -> Mesh:
    """A closed ball of 24 segments, seen from inside."""
    return turned_over(sphere(segments=24, smooth=smooth))


def _cavities() -> Scene:
    """A closed room and a closed ball in one mesh."""
    left, right = grid_cells(2, 1)
    hollow = moved(hollow_ball(smooth=False), (4, 0, 0))
    assert hollow.uv is not None
    hollow = replace(hollow, uv=in_cell(hollow.uv.astype(np.float64), right, 0.03).astype(np.float32))
    room = box((-1, -1, -1), (1, 1, 1), left, inward=True)
    return scene(joined([room, hollow], "cavities"), under=skewed((100, 200, -300), 0.3))


def _room_edges(wedge: float) -> Scene:
    """Strips of 2e-4 along the edges of a closed room, squeezed so that some of its edges are sharp."""
    squeeze = np.eye(4)
    squeeze[1, 2] = wedge
    return scene(*rimmed_room(2e-4), under=SKEW @ squeeze)


CASES = (
    Case(
        "coincident faces",
        "Sheets that lie in the floor, either way up, change nothing: the bits of the floor alone.",
        "Dark patches: rounding decides whether a ray meets the other sheet.",
        _coincident,
        twin=_on_floor,
        bits=True,
    ),
    Case(
        "nearly coincident faces above",
        "Sheets 1e-6 to 1e-3 of the object's size above the floor close it: 0. At 1e-7 the two count as one: 1.",
        "At 1e-7 rounding decides: a gradient.",
        _near_above,
        expected=lambda view: _closed_from(1e-6, view),
    ),
    Case(
        "nearly coincident faces below",
        "Sheets 1e-7 to 1e-3 of the object's size below an open floor: 1.",
        "At 1e-7 dark, by rounding.",
        _near_below,
        expected=lambda view: np.ones(view.covered.shape),
    ),
    Case(
        "box standing on a slab",
        "Faces in one plane: the bottom 0, the sides 0.5 at every height, the top 1. (On a sheet the bottom would be "
        "1: there a box on a sheet and two sheets back to back are the same.)",
        "",
        _standing,
        expected=_stood,
        slack=2e-3,
        mean_slack=1e-3,
    ),
    Case(
        "interpenetrating meshes",
        "A ball sunk to its middle into the floor: 0 within its outline, the exact shadow of half a ball without.",
        "",
        _half_sunk,
        expected=_sunk,
        slack=6e-3,
        mean_slack=1.5e-3,
    ),
    Case(
        "back-to-back sheets",
        "A box of two coincident sheets a side: 1 on the outer, 0 on the inner.",
        "Dark wedges on the outer sheets, by rounding.",
        _paper,
        expected=outer_open,
        rays=32,
    ),
    Case(
        "open sheet",
        "A sheet with its back to the floor shades it as well as its front would: the exact parallel rectangle.",
        "",
        _sheet,
        expected=lambda view: exact.rectangle_above(view.local, *SHEET),
        slack=2e-3,
        mean_slack=2e-4,
    ),
    Case(
        "flipped winding",
        "A box inside out bakes its inside: 0. One beside it that is not: 1.",
        "",
        _inside_out,
        expected=outer_open,
        distance=8.0,
    ),
    Case(
        "mixed winding",
        "Of a box with every other triangle turned over, those see the inside: 0. The others: 1.",
        "",
        _every_other,
        expected=lambda view: np.where(view.owner % 2 == 1, 0.0, 1.0),
    ),
    Case(
        "non-manifold fan",
        "Twelve pages on one edge: each sees its own gap alone, (1 - cos φ)/2.",
        "",
        _fan,
        expected=_between_pages,
        slack=6e-3,
        mean_slack=1e-3,
    ),
    Case(
        "slivers",
        "A floor of needles of 4,000,000 : 1 between strips: the exact shadow of a ball, as on any floor.",
        "",
        _needles,
        expected=shadow,
        slack=8e-3,
        mean_slack=1e-3,
    ),
    Case(
        "duplicate triangles",
        "Half the floor's triangles twice: the bits of the floor without the copies.",
        "Dark triangles: a doubled one blocks the other, by rounding.",
        _doubled,
        twin=_undoubled,
        bits=True,
        size=(62, 47),  # no diagonal meets a texel's centre: there two triangles tie, and the doubled one would win
        warns="overlap",
    ),
    Case(
        "zero-area triangles",
        "Triangles on one line or in one point own no texel, whatever their UVs: the bits of the floor without them. A "
        "line tells of them.",
        "They own the texture, and it shows them.",
        _flat_triangles,
        twin=_undoubled,
        bits=True,
        warns="zero area",
    ),
    Case(
        "closed cavities",
        "Inside a closed room and a closed ball: 0, without one ray lost.",
        "",
        _cavities,
        expected=lambda view: np.zeros(view.covered.shape),
        rays=32,
    ),
    Case(
        "edges of a closed room",
        "Texels no wider than 2e-4 of the room, along its edges: 0, without one ray lost.",
        "A ray or two get out.",
        lambda: _room_edges(0.0),
        expected=lambda view: np.zeros(view.covered.shape),
    ),
    Case(
        "sharp edges of a closed room",
        "The same where walls meet at 14°.",
        "Some rays get out.",
        lambda: _room_edges(4.0),
        expected=lambda view: np.zeros(view.covered.shape),
    ),
)

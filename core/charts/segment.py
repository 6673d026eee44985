"""Where a mesh is cut into charts.

Parts that are planes, and small ones that can be laid flat, stay as they are. The rest is cut on a simplified mesh, in
halves until each piece can be laid flat; then pieces are joined as long as they can be laid flat together; all that is
carried over to the mesh itself, done again there, and looked after.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ..base.arrays import Flags, Longs
from ..base.kernel_api import Control
from .borders import settled
from .chart_mesh import ChartMesh, halves_of, triangle_groups
from .coarse import CoarseMesh
from .flat_charts import Cuts, FlatCharts, lay_flat
from .joins import SMALL, Tree, absorbed, joined, replayed
from .repair import Joins, Layout, good_charts
from .stages import Stages

# The most stretch of a chart, L2 and its 95th percentile: of a piece, of what pieces are joined to, and of a chart that
# has come out of the full mesh with more.
_PIECE, _JOINED, _CHART = (1.05, 1.2), (1.07, 1.3), (1.15, 1.5)
# What has to be cut comes to charts of at most this part of the surface, more only where they fill so much of their
# box: a few large ones of any outline leave an image half empty.
_LARGEST, _FULL = 0.2, 0.9
_WORTH_CUTTING = 1.5  # of that: what is hardly larger would leave slivers
_FEW = 1_000  # triangles: parts of no more are laid flat as they are, where that goes; others cost too much to try
_EDGE = 0.5  # surfaces that turn by more than 60 degrees (1 - cosine) at an edge part there, where edges close a chart


def laid_out(mesh: ChartMesh, stages: Stages) -> Layout:
    """Charts of a mesh, each flat by itself, with little stretch and without overlap. Raises Cancelled."""
    locked = _locked(mesh)
    part = triangle_groups(mesh, (mesh.twin >= 0) & ~locked)[0]
    slit = np.zeros(len(mesh.twin), np.bool_)
    flat = lay_flat(mesh, Cuts(part.astype(np.int64), slit), stages.control, most=_FEW)
    easy = flat.good(*_PIECE)
    hard = np.flatnonzero(~easy[part])
    if not len(hard):
        return Layout(Cuts(flat.label, slit), flat.uv)
    halves = halves_of(hard)
    rest = mesh if len(hard) == len(mesh.triangles) else mesh.part(hard)
    cuts, joins = _cut(rest, locked[halves], _LARGEST * float(mesh.area.sum()), stages)
    control = stages.enter("laying charts flat", 0.6, 0.8)
    layout = good_charts(rest, cuts, lambda charts: charts.good(*_CHART), joins, control)
    label, uv = flat.label + layout.cuts.count, flat.uv
    label[hard], slit[halves], uv[hard] = layout.cuts.label, layout.cuts.slit, layout.uv
    return Layout(Cuts(np.unique(label, return_inverse=True)[1].ravel(), slit), uv)


def _locked(mesh: ChartMesh) -> Flags:
    """(3 T,) bool: marked half-edges that part one side of the surface from the other."""
    region = triangle_groups(mesh, (mesh.twin >= 0) & ~mesh.seam)[0]
    return mesh.between(region)


def _cut(mesh: ChartMesh, locked: Flags, largest: float, stages: Stages) -> tuple[Cuts, Joins]:
    """Cuts of a mesh into charts of at most so large an area, and how those were joined."""
    coarse = CoarseMesh.of(mesh, locked, stages.enter("simplifying the mesh", 0.05, 0.25))

    def small(flat: FlatCharts, most: float) -> Flags:
        return np.asarray((flat.areas <= most) | (flat.fill >= _FULL))

    def piece_fits(flat: FlatCharts) -> Flags:
        return np.asarray(flat.good(*_PIECE) & small(flat, _WORTH_CUTTING * largest))

    def fits(flat: FlatCharts) -> Flags:
        return np.asarray(flat.good(*_JOINED) & small(flat, largest))

    label = _pieces(coarse, piece_fits, stages.enter("cutting charts", 0.25, 0.45))
    control = stages.enter("joining charts", 0.45, 0.6)
    tree = joined(coarse.mesh, label, coarse.locked, fits, control)
    carried = label[coarse.origin]
    leaf = _leaves(mesh, settled(mesh, carried, locked, control), carried, tree)
    cuts, name = replayed(mesh, leaf, locked, tree)
    return cuts, Joins(tree, name, leaf)


def _pieces(coarse: CoarseMesh, fits: Callable[[FlatCharts], Flags], control: Control | None) -> Longs:
    """(T',) charts of the simplified mesh: its parts as they are where they can be laid flat, else what sharp edges
    make of them, cut in halves until all fit."""
    mesh, inner = coarse.mesh, (coarse.mesh.twin >= 0) & ~coarse.locked
    label = triangle_groups(mesh, inner)[0].astype(np.int64)
    uncut = np.zeros(len(mesh.twin), np.bool_)
    hard = np.flatnonzero(~lay_flat(mesh, Cuts(label, uncut), control).good(*_PIECE)[label])
    if len(hard):
        part, faces = mesh.part(hard), _faces(mesh, inner)[hard]
        cuts = Cuts(np.unique(faces, return_inverse=True)[1].ravel(), uncut[halves_of(hard)])
        label[hard] = int(label.max()) + 1 + good_charts(part, cuts, fits, None, control).cuts.label
        label = np.unique(label, return_inverse=True)[1].ravel()
    return absorbed(mesh, label, coarse.locked, fits, control)


def _faces(mesh: ChartMesh, inner: Flags) -> Longs:
    """(T,) what sharp edges part, of all half-edges `inner`; not small from small: a rough surface would be dust."""
    smooth = inner & (mesh.crease(np.arange(len(mesh.twin), dtype=np.int64)) < _EDGE)
    face, count = triangle_groups(mesh, smooth)
    small = (np.bincount(face, mesh.area, count) < SMALL)[face]
    smooth |= inner & np.repeat(small, 3) & small[mesh.across]
    return triangle_groups(mesh, smooth)[0].astype(np.int64)


def _leaves(mesh: ChartMesh, pieces: Longs, carried: Longs, tree: Tree) -> Longs:
    """(T,) leaves of the tree for pieces of the full mesh: each leaf's largest piece; others get other numbers."""
    pair, slot = np.unique(pieces * tree.leaves + carried, return_inverse=True)
    piece, leaf = pair // tree.leaves, pair % tree.leaves
    order = np.argsort(np.bincount(slot.ravel(), mesh.area), kind="stable")  # the largest is written last, and stays
    main = np.zeros(int(pieces.max()) + 1, np.int64)
    main[piece[order]] = leaf[order]
    largest = np.full(tree.leaves, -1, dtype=np.int64)
    order = np.argsort(np.bincount(pieces, mesh.area), kind="stable")
    largest[main[order]] = order
    own = np.arange(len(main), dtype=np.int64)
    return np.where(largest[main] == own, main, tree.leaves + len(tree.children) + own)[pieces]

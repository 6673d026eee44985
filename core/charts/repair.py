"""Charts laid flat one by one, and cut again until each of them is good."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ..base.arrays import Doubles, Flags, Longs
from ..base.kernel_api import Control
from .chart_mesh import ChartMesh, halves_of, triangle_groups
from .divide import divided, in_order
from .flat_charts import Cuts, FlatCharts, lay_flat
from .joins import Tree


@dataclass(frozen=True, eq=False)
class Layout:
    """Good charts. cuts: where they are; uv: (T, 3, 2), each by itself, in the units of the surface."""

    cuts: Cuts
    uv: Doubles


@dataclass(frozen=True, eq=False)
class Joins:
    """How charts came together. name: (C,) what the tree calls each chart, -1 what is not of the tree. leaf: (T,) the
    leaf of the tree that each triangle belongs to."""

    tree: Tree
    name: Longs
    leaf: Longs


def good_charts(
    mesh: ChartMesh,
    cuts: Cuts,
    fits: Callable[[FlatCharts], Flags],
    joins: Joins | None = None,
    control: Control | None = None,
) -> Layout:
    """Lay charts flat; those that do not fit are cut in two, until all do. Raises Cancelled.

    joins: charts that were joined part again as they came together before they are cut anew. One polygon that does not
    fit stays as it is if it can be laid flat without overlap, else it falls into triangles.
    """
    if joins is None:
        joins = Joins(Tree(0), np.full(cuts.count, -1, dtype=np.int64), np.zeros(len(mesh.triangles), np.int64))
    name = joins.name
    uv = np.zeros((len(mesh.triangles), 3, 2))
    pending = np.ones(cuts.count, np.bool_)
    while pending.any():
        chosen = np.flatnonzero(pending[cuts.label])
        part, inner, charts = _taken(mesh, cuts, chosen)
        flat = lay_flat(part, inner, control)
        uv[chosen] = flat.uv
        bad = ~fits(flat)
        second, parts = _unjoined(inner, bad, Joins(joins.tree, name[charts], joins.leaf[chosen]))
        side, names = np.zeros(len(mesh.triangles), np.int64), np.full((cuts.count, 2), -1, dtype=np.int64)
        names[charts] = parts
        side[chosen] = second + _cut(part, inner, bad & (parts[:, 0] < 0), flat, control)
        cuts, name, pending = _renumbered(mesh, cuts, side, names)
    return Layout(cuts, uv)


def _taken(mesh: ChartMesh, cuts: Cuts, chosen: Longs) -> tuple[ChartMesh, Cuts, Longs]:
    """Some charts by themselves, numbered from 0, and their numbers before."""
    charts, label = np.unique(cuts.label[chosen], return_inverse=True)
    part = mesh if len(chosen) == len(mesh.triangles) else mesh.part(chosen)
    return part, Cuts(label.ravel(), cuts.slit[halves_of(chosen)]), charts


def _unjoined(cuts: Cuts, wanted: Flags, joins: Joins) -> tuple[Longs, Longs]:
    """How the wanted charts come apart as they came together: (T,) which of its two parts each triangle is of, 0 or 1;
    (C, 2) the names of the two, -1 where a chart was not joined, or all of it is of one part."""
    side, names = np.zeros(len(cuts.label), np.int64), np.full((cuts.count, 2), -1, dtype=np.int64)
    wanted = wanted & (joins.name >= joins.tree.leaves)
    order, starts = in_order(cuts, wanted)
    for chart, start, end in zip(np.flatnonzero(wanted), starts[:-1], starts[1:], strict=True):
        parts = joins.tree.parts(int(joins.name[chart]))
        if parts is None:
            continue
        own = order[start:end]
        second = np.isin(joins.leaf[own], joins.tree.leaves_of(parts[1]))
        if second.any() and not second.all():
            side[own], names[chart] = second, parts
    return side, names


def _cut(mesh: ChartMesh, cuts: Cuts, wanted: Flags, flat: FlatCharts, control: Control | None) -> Longs:
    """(T,) the sides of the wanted charts, cut in two, 0 or 1; a number for each triangle of one that neither can be
    cut nor lies flat without overlap; 0 in all others."""
    side = divided(mesh, cuts, wanted, flat.overlap, control=control).astype(np.int64)
    second, size = np.bincount(cuts.label, side, cuts.count), np.bincount(cuts.label, minlength=cuts.count)
    whole = (second == 0) | (second == size)
    # A polygon that is no surface, or lies on itself; triangles alone do not.
    loose = np.flatnonzero((wanted & whole & (~flat.laid | (flat.overlap[:, 0] >= 0)))[cuts.label])
    side[loose] = np.arange(len(loose), dtype=np.int64)
    return side


def _renumbered(mesh: ChartMesh, cuts: Cuts, side: Longs, names: Longs) -> tuple[Cuts, Longs, Flags]:
    """The cuts, with charts that were split as several; each one's name; which of them are yet to be laid flat.

    names: (C, 2) of a chart's two sides; a side in several pieces has none.
    """
    whole = cuts.count
    cuts, before, which = split(mesh, cuts, side)
    pieces = np.bincount(before * 2 + which, minlength=2 * whole)
    name = np.where(pieces[before * 2 + which] > 1, -1, names[before, which])
    return cuts, name, np.bincount(before, minlength=whole)[before] > 1


def split(mesh: ChartMesh, cuts: Cuts, side: Longs) -> tuple[Cuts, Longs, Longs]:
    """The cuts, with each connected part of a chart's sides, (T,) from 0, as a chart; of each the chart that it was of,
    and whether it was of the first side, 0, or another, 1."""
    key = cuts.label * (int(side.max(initial=0)) + 1) + side
    same = cuts.joined(mesh) & ~mesh.between(key)
    group, count = triangle_groups(mesh, same, key)
    before, which = np.zeros(count, np.int64), np.zeros(count, np.int64)
    before[group], which[group] = cuts.label, np.minimum(side, 1)
    return Cuts(group.astype(np.int64), cuts.slit), before, which

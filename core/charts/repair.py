"""Charts laid flat one by one, and cut again until each of them is good."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ..base.arrays import Doubles, Flags, Longs
from ..base.kernel_api import Control
from .chart_mesh import ChartMesh, halves_of, triangle_groups
from .divide import divided
from .flat_charts import Cuts, FlatCharts, lay_flat
from .joins import Tree

_ROUNDS = 64  # of cutting; each halves what is not good


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
    fit stays as it is if it can be laid flat at all, else it falls into triangles.
    """
    name = np.full(cuts.count, -1) if joins is None else joins.name
    uv = np.zeros((len(mesh.triangles), 3, 2))
    pending = np.ones(cuts.count, np.bool_)
    for _ in range(_ROUNDS):
        chosen = np.flatnonzero(pending[cuts.label])
        if not len(chosen):
            break
        part, inner, charts = _taken(mesh, cuts, chosen)
        flat = lay_flat(part, inner, control)
        uv[chosen] = flat.uv
        side, names = np.zeros(len(mesh.triangles), np.int64), np.stack([name, name], axis=1)
        for chart, own in zip(*members_of(inner, ~fits(flat)), strict=True):
            whole, members = charts[chart], chosen[own]
            names[whole], side[members] = _parted(part, inner, flat, chart, own, int(name[whole]), joins, members)
        cuts, name, pending = _renumbered(mesh, cuts, side, names)
    return Layout(cuts, uv)


def _taken(mesh: ChartMesh, cuts: Cuts, chosen: Longs) -> tuple[ChartMesh, Cuts, Longs]:
    """Some charts by themselves, numbered from 0, and their numbers before."""
    charts, label = np.unique(cuts.label[chosen], return_inverse=True)
    part = mesh if len(chosen) == len(mesh.triangles) else mesh.part(chosen)
    return part, Cuts(label.ravel(), cuts.slit[halves_of(chosen)]), charts


def members_of(cuts: Cuts, wanted: Flags) -> tuple[Longs, list[Longs]]:
    """The wanted charts, and the triangles of each, in rising order."""
    charts = np.flatnonzero(wanted)
    chosen = np.flatnonzero(wanted[cuts.label])
    order = chosen[np.argsort(cuts.label[chosen], kind="stable")]
    return charts, np.split(order, np.searchsorted(cuts.label[order], charts[1:])) if len(charts) else []


def _parted(
    mesh: ChartMesh,
    cuts: Cuts,
    flat: FlatCharts,
    chart: int,
    own: Longs,
    name: int,
    joins: Joins | None,
    members: Longs,
) -> tuple[tuple[int, int], Longs]:
    """How a chart that does not fit is cut: names for its two sides, and the side of each of its triangles, or a number
    for each triangle; 0 throughout where it stays."""
    parts = joins.tree.parts(name) if joins is not None and name >= 0 else None
    if joins is not None and parts is not None:
        second = np.isin(joins.leaf[members], joins.tree.leaves_of(parts[1]))
        if second.any() and not second.all():
            return parts, second.astype(np.int64)
    first, other = (int(at) for at in np.searchsorted(own, flat.overlap[chart]))
    apart = (first, other) if flat.overlap[chart, 0] >= 0 else None
    second = divided(mesh.part(own), cuts.slit[halves_of(own)], apart)
    if second.any() and not second.all():
        return (-1, -1), second.astype(np.int64)
    # A polygon that is no surface; triangles alone are.
    return (-1, -1), np.zeros(len(own), np.int64) if flat.laid[chart] else np.arange(len(own))


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
    same = cuts.joined(mesh) & (key[mesh.across] == np.repeat(key, 3))
    group, count = triangle_groups(mesh, same, key)
    before, which = np.zeros(count, np.int64), np.zeros(count, np.int64)
    before[group], which[group] = cuts.label, np.minimum(side, 1)
    return Cuts(group.astype(np.int64), cuts.slit), before, which

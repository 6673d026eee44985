"""A chart that cannot be laid flat as it is, cut in two."""

from __future__ import annotations

import heapq

import numpy as np

from ..base.arrays import Flags, Longs
from .bisect import halves
from .chart_mesh import ChartMesh, components, corner_classes, following


def divided(mesh: ChartMesh, slit: Flags, apart: tuple[int, int] | None) -> Flags:
    """(T,) bool: which side of the cut the triangles of one chart are on; False throughout where it is one polygon.

    mesh: the chart alone; slit: (3 T,) bool, half-edges that are cut already. apart: two triangles that are to be on
    different sides, as they lie on one another, or None. A ring is cut across twice, so that both sides are discs.
    """
    joined = (mesh.twin >= 0) & ~slit
    if mesh.polygon.max() == 0:
        return np.zeros(len(mesh.triangles), np.bool_)
    if apart is None and (bridge := _bridge(mesh, joined)) is not None:
        joined[bridge] = joined[mesh.twin[bridge]] = False
        middle = bridge[len(bridge) // 2]
        apart = int(middle // 3), int(mesh.across[middle])
        if mesh.polygon[apart[0]] == mesh.polygon[apart[1]]:
            apart = None
    neighbours = np.where(joined, mesh.across, -1).reshape(-1, 3)
    weight = mesh.cost(np.arange(len(mesh.twin))).reshape(-1, 3)
    return halves(mesh.corners, neighbours, mesh.polygon, weight, apart)


def _bridge(mesh: ChartMesh, joined: Flags) -> Longs | None:
    """The shortest path of half-edges between two borders of a chart; None where it has one border, or none."""
    vertex, count = corner_classes(mesh.twin, joined)
    rim = np.flatnonzero(~joined)
    loop = components(count, vertex[rim].astype(np.int64), vertex[following(rim)].astype(np.int64))[0]
    rims = np.unique(loop[vertex[rim]])
    if len(rims) < 2:
        return None
    start = np.zeros(count, np.bool_)
    on_rim = np.zeros(count, np.bool_)
    on_rim[vertex[rim]] = True
    start[vertex[rim]] = loop[vertex[rim]] == rims[0]
    return _shortest(mesh, joined, vertex.astype(np.int64), start, on_rim & ~start)


def _shortest(mesh: ChartMesh, joined: Flags, vertex: Longs, start: Flags, goal: Flags) -> Longs | None:
    """Dijkstra's path of inner half-edges from one of the vertices `start` to one of `goal`."""
    inner = np.flatnonzero(joined & (mesh.polygon[mesh.across] != np.repeat(mesh.polygon, 3)))
    tail, head = vertex[inner], vertex[following(inner)]
    order = np.argsort(tail, kind="stable")
    first = np.searchsorted(tail[order], np.arange(len(start) + 1))
    cost = mesh.cost(inner)
    reached = np.full(len(start), np.inf)
    by = np.full(len(start), -1)
    reached[start] = 0.0
    queue = [(0.0, int(v)) for v in np.flatnonzero(start)]
    while queue:
        far, v = heapq.heappop(queue)
        if far > reached[v]:
            continue
        if goal[v]:
            path = []
            while by[v] >= 0:
                path.append(inner[by[v]])
                v = int(tail[by[v]])
            return np.array(path[::-1], np.int64)
        for e in order[first[v] : first[v + 1]]:
            w, further = int(head[e]), far + float(cost[e])
            if further < reached[w] and not start[w]:
                reached[w], by[w] = further, e
                heapq.heappush(queue, (further, w))
    return None

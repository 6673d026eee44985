"""A mesh charted by each of three, judged, and its picture: a row of the figure."""

from __future__ import annotations

from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import Any

from ...tests.oracles.charts.judge import judged
from ...tests.oracles.charts.polygon_mesh import PolygonMesh
from ..pages import ROOT
from ..sweep import in_turns
from .chart_meshes import FIGURES, mesh_of
from .chart_sheets import draw
from .charters import PADDING, Layout, by_smart_project, by_us, by_xatlas

OURS, XATLAS, SMART = "ours", "xatlas", "Smart UV Project"
PICTURES = ROOT / "docs" / "pictures" / "charts"


def charted(name: str, models: str, rounds: int) -> dict[str, Any]:
    """One of FIGURES: its triangles, and by who charted it, what `judged` finds and the seconds, or why there is
    nothing."""
    obj = FIGURES[name](Path(models))
    mesh = mesh_of(obj)
    runs = in_turns({OURS: partial(_run, by_us, mesh), SMART: partial(_run, by_smart_project, obj)}, rounds)
    rows = {by: _row(mesh, made[0], [run.seconds for run in made]) for by, made in runs.items()}
    beside = by_xatlas(mesh)
    rows[XATLAS] = {"why": beside} if isinstance(beside, str) else _row(mesh, beside, [beside.seconds])
    PICTURES.mkdir(parents=True, exist_ok=True)
    draw(obj, mesh, runs[OURS][0].uv, PICTURES / f"{name}.png")
    return {"triangles": len(mesh.triangles), "by": {by: rows[by] for by in (OURS, XATLAS, SMART)}}


def _run(make: Any, given: Any, _: int) -> Layout:
    layout: Layout = make(given)
    return layout


def _row(mesh: PolygonMesh, layout: Layout, seconds: list[float]) -> dict[str, Any]:
    return {**asdict(judged(mesh, layout.uv, layout.size, PADDING)), "seconds": seconds}

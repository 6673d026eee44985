"""Charts where a mesh has no UVs, beside xatlas at its defaults and Smart UV Project, with a picture of each sheet; and
of very many pieces and triangles.

python -m occlusion_bake.bench.figures.charts [MESH...] measures these anew and leaves the others as they are.
"""

from __future__ import annotations

import argparse
import json
import statistics
import sys
from pathlib import Path
from typing import Any

from ...addon.cli.hard_exit import leave
from ..pages import MODELS, ROOT, filled, write_json
from ..sweep import in_child
from ..tables import table
from .chart_crowds import crowd, crowd_names
from .chart_meshes import FIGURES, figure_names
from .chart_row import OURS, charted
from .chart_sheets import CHECK
from .charters import ACROSS, LIMIT, PADDING, SIZE

COLUMNS = ("mesh", "charts by", "median s", "charts", "L2 stretch", "p95", "used", "padding", "mirrored", "overlaps")
CROWD_COLUMNS = ("", "triangles", "s", "memory", "charts", "used", "padding")
_KEPT = ROOT / "build" / "figures" / "charts_by_mesh.json"


def measure(chosen: argparse.Namespace) -> dict[str, Any]:
    """Every mesh that is there, or those of `chosen.meshes`, each in a process of its own; what was measured of others
    goes with them."""
    names = getattr(chosen, "meshes", None) or figure_names(chosen.models)
    kept = json.loads(_KEPT.read_text(encoding="utf-8")) if _KEPT.exists() else {}
    for name in names:
        kept[name] = in_child(charted, name, str(chosen.models), chosen.rounds)
        write_json(_KEPT, kept)
        print(name, {by: row.get("charts", row.get("why")) for by, row in kept[name]["by"].items()}, flush=True)
    crowds = {name: in_child(crowd, name, str(chosen.models)) for name in crowd_names(chosen.models)}
    return {"meshes": {name: kept[name] for name in FIGURES if name in kept}, "crowds": crowds}


def page(result: dict[str, Any]) -> list[str]:
    """The section of the page."""
    rows = [
        (f"{name}, {found['triangles']:,} triangles" if by == OURS else "", by, *_cells(row))
        for name, found in result["meshes"].items()
        for by, row in found["by"].items()
    ]
    pictures = "\n\n".join(f"![{name}](pictures/charts/{name}.png)" for name in result["meshes"])
    crowds = table(CROWD_COLUMNS, ((name, *_crowd_cells(row)) for name, row in result["crowds"].items()))
    told = {"size": SIZE, "padding": PADDING, "limit": LIMIT, "across": ACROSS, "check": CHECK}
    return filled(__file__, rows=table(COLUMNS, rows), crowds=crowds, pictures=pictures, **told)


def _crowd_cells(row: dict[str, Any]) -> list[str]:
    return [
        f"{row['triangles']:,}",
        f"{row['seconds']:.1f}",
        f"{row['gigabytes']:.2f} GB",
        f"{row['charts']:,}",
        f"{100.0 * row['used']:.0f} %",
        f"{row['padding']}",
    ]


def _cells(row: dict[str, Any]) -> list[str]:
    """Of the table; where there was no layout, why."""
    if "why" in row:
        return [row["why"], *("—" for _ in COLUMNS[3:])]
    deepest = f", {row['deepest']:.2g} deep" if row["overlaps"] else ""
    return [
        f"{statistics.median(row['seconds']):.2f}",
        f"{row['charts']:,}",
        _ratio(row["l2"]),
        _ratio(row["p95"]),
        f"{100.0 * row['used']:.0f} %",
        f"{row['padding']}" if row["padding"] >= 0 else "shared",
        f"{row['mirrored']:,}",
        f"{row['overlaps']:,}{deepest}",
    ]


def _ratio(value: float) -> str:
    return f"{value:.3f}" if value < 100.0 else f"{value:.1g}"


def main(arguments: list[str]) -> int:
    """The command: measure some meshes and print the section."""
    parser = argparse.ArgumentParser("python -m occlusion_bake.bench.figures.charts", description=__doc__)
    parser.add_argument("meshes", nargs="*", metavar="MESH", help=f"which: {', '.join(FIGURES)} (all)")
    parser.add_argument("--rounds", type=int, default=3, help="alternating runs of each (3)")
    parser.add_argument("--models", type=Path, default=MODELS, help="folder of models")
    chosen = parser.parse_args(arguments)
    if unknown := sorted({*chosen.meshes} - {*FIGURES}):
        parser.error(f"{', '.join(unknown)}: no such mesh; choose from {', '.join(FIGURES)}")
    print(*page(measure(chosen)), sep="\n")
    return 0


if __name__ == "__main__":
    leave(main(sys.argv[1:]))

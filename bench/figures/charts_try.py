"""What charts of meshes are like, a line a mesh: for whoever tunes them.

python -m occlusion_bake.bench.figures.charts_try [--size N] [--padding N] [--quick] MESH...

MESH is bunny, igea, rocker, spot or another of the figure of charts, any file that the command reads, or
KIND[:SIZE[:SEED[:DEFECT]]] of a kind that the tests know: "tube:2048", "closed tube:512", "quads:4000". `all` is every
kind, small.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Sequence
from pathlib import Path

from ...addon.cli.hard_exit import leave
from ...core.base.errors import InputError
from ...core.charts.unwrap import unwrap
from ...tests.oracles.charts.judge import Judgement, judged
from ...tests.oracles.charts.kinds import KINDS
from ..pages import MODELS
from .chart_meshes import mesh_named

_SMALL = 24  # the size of the kinds that `all` stands for
_HEAD = (
    f"{'mesh':24} {'triangles':>9} {'seconds':>7} {'charts':>6} {'l2':>6} {'p95':>6} {'used':>5} {'pad':>3} "
    f"{'overlap':>7} {'deepest':>7} {'mirror':>6} {'lost':>4} {'torn':>4} {'uneven':>6}"
)


def main(arguments: Sequence[str]) -> int:
    """The command."""
    assert __doc__
    parser = argparse.ArgumentParser("python -m occlusion_bake.bench.figures.charts_try", description=__doc__)
    parser.add_argument("meshes", nargs="+", metavar="MESH")
    parser.add_argument("--size", type=int, default=1024, help="texels a side (1024)")
    parser.add_argument("--padding", type=int, default=4, help="texels between charts (4)")
    parser.add_argument("--models", type=Path, default=MODELS, help="folder of models")
    parser.add_argument("--quick", action="store_true", help="what the product says of itself alone, unjudged")
    chosen = parser.parse_args(arguments)
    print(_HEAD)
    kinds = [f"{kind}:{_SMALL}" for kind in KINDS]
    for name in (each for given in chosen.meshes for each in (kinds if given == "all" else [given])):
        try:
            print(f"{name[-24:]:24} {_tried(name, chosen)}", flush=True)
        except InputError as error:
            print(error)
    return 0


def _tried(name: str, chosen: argparse.Namespace) -> str:
    mesh = mesh_named(name, chosen.models)
    start = time.perf_counter()
    charts = unwrap(name, *mesh, size=chosen.size, padding=chosen.padding)
    seconds = time.perf_counter() - start
    head = f"{len(mesh.triangles):9,} {seconds:7.2f}"
    if chosen.quick:
        told = charts.stretch
        return f"{head} {charts.count:6} {told.l2:6.3f} {told.p95:6.3f} {charts.utilisation:5.0%} {charts.padding:3}"
    return f"{head} {_told(judged(mesh, charts.uv, (chosen.size, chosen.size), chosen.padding))}"


def _told(found: Judgement) -> str:
    return (
        f"{found.charts:6} {found.l2:6.3f} {found.p95:6.3f} {found.used:5.0%} {found.padding:3} {found.overlaps:7} "
        f"{found.deepest:7.3f} {found.mirrored:6} {found.collapsed:4} {found.torn:4} {found.uneven:6.3f}"
    )


if __name__ == "__main__":
    leave(main(sys.argv[1:]))

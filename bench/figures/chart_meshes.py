"""Meshes to chart, by a name: models from files, samples, and the kinds of meshes that the tests know."""

from __future__ import annotations

from pathlib import Path

from ...core.base.errors import InputError
from ...samples.bench_scenes import MODELS
from ...tests.oracles.charts.kinds import KINDS, ChartCase
from ...tests.oracles.charts.polygon_mesh import PolygonMesh

FILES = {**MODELS, "igea": "igea.ply"}


def mesh_named(name: str, models: Path) -> PolygonMesh:
    """A mesh by its name: one of FILES, in the folder of models; a file of a kind that the command reads; or
    KIND[:SIZE[:SEED[:DEFECT]]], KIND from `tests.oracles.charts.kinds`.

    Raises InputError, one line that names what there is.
    """
    kind, *numbers = name.split(":")
    if kind in KINDS:
        size, seed, defect = [*numbers, *("64", "0", "none")[len(numbers) :]]
        return ChartCase(kind, int(size), int(seed), defect).build()
    file = models / FILES[name] if name in FILES else Path(name)
    if not file.suffix:
        raise InputError(f"{name}: no such mesh; name a file or one of {', '.join([*FILES, *KINDS])}")
    return mesh_of_file(file)


def mesh_of_file(file: Path) -> PolygonMesh:
    """The first mesh of a file, before modifiers, and what is triangulated of it as Blender does. Raises InputError."""
    import bpy  # takes a second, which meshes of numbers alone need not wait

    from ...addon.charts.base_mesh import base_triangles
    from ...addon.cli.import_file import load

    load(file)
    base = base_triangles(bpy.context, next(each for each in bpy.data.objects if each.type == "MESH"))
    return PolygonMesh(base.vertices, base.triangles, base.polygons)

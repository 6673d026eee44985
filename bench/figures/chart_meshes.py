"""Meshes to chart, by a name: models from files, samples, and the kinds of meshes that the tests know."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import bpy
import numpy as np

from ...addon.charts.base_mesh import base_triangles
from ...addon.cli.import_file import load
from ...core.base.errors import InputError
from ...samples.bench_scenes import MODELS, build, empty_scene
from ...samples.stage import add
from ...tests.oracles.blender import select
from ...tests.oracles.charts import organic, round_shapes
from ...tests.oracles.charts.kinds import KINDS, ChartCase
from ...tests.oracles.charts.polygon_mesh import PolygonMesh

Open = Callable[[Path], bpy.types.Object]  # of the folder of models


def mesh_named(name: str, models: Path) -> PolygonMesh:
    """A mesh by its name: one of FIGURES or MODELS, in the folder of models; a file of a kind that the command reads;
    or KIND[:SIZE[:SEED[:DEFECT]]], KIND from `tests.oracles.charts.kinds`.

    Raises InputError, one line that names what there is.
    """
    kind, *numbers = name.split(":")
    if kind in KINDS:
        size, seed, defect = [*numbers, *("64", "0", "none")[len(numbers) :]]
        return ChartCase(kind, int(size), int(seed), defect).build()
    if name in FIGURES:
        return mesh_of(FIGURES[name](models))
    if name not in MODELS and not Path(name).suffix:
        raise InputError(f"{name}: no such mesh; name a file or one of {', '.join({**MODELS, **FIGURES, **KINDS})}")
    return mesh_of(_opened(models / MODELS[name] if name in MODELS else Path(name)))


def mesh_of(obj: bpy.types.Object) -> PolygonMesh:
    """Before modifiers, and triangulated as Blender does it."""
    base = base_triangles(bpy.context, obj)
    return PolygonMesh(base.vertices, base.triangles, base.polygons)


def figure_names(models: Path) -> list[str]:
    """Of FIGURES, without models whose files are not there."""
    return [name for name in FIGURES if name not in MODELS or (models / MODELS[name]).is_file()]


def _opened(file: Path) -> bpy.types.Object:
    load(file)
    return next(each for each in bpy.data.objects if each.type == "MESH")


def _model(name: str) -> Open:
    return lambda models: _applied(_opened(models / MODELS[name]))


def _sample(name: str) -> Open:
    """The first target of a scene, its modifiers applied."""

    def opened(models: Path) -> bpy.types.Object:
        target = build(name, models).targets[0]  # opens another file, and so other objects
        return _applied(bpy.data.objects[target])

    return opened


def _suzanne(levels: int) -> Open:
    def opened(_: Path) -> bpy.types.Object:
        empty_scene()
        bpy.ops.mesh.primitive_monkey_add()
        head: Any = bpy.context.object
        head.modifiers.new("Subdivision", "SUBSURF").levels = levels
        return _applied(head)

    return opened


def _made(name: str, make: Callable[[], PolygonMesh]) -> Open:
    """An object of numbers alone."""

    def opened(_: Path) -> bpy.types.Object:
        mesh = make()
        scene, data = empty_scene(), bpy.data.meshes.new(name)
        data.from_pydata(mesh.vertices.tolist(), [], _faces(mesh))
        return add(scene, name, data)

    return opened


def _faces(mesh: PolygonMesh) -> list[list[int]]:
    """The corners of each polygon, a fan about its first."""
    parts = np.split(mesh.triangles, np.flatnonzero(np.diff(mesh.polygons)) + 1)
    return [[*fan[0, :2].tolist(), *fan[:, 2].tolist()] for fan in parts]


def _applied(obj: bpy.types.Object) -> bpy.types.Object:
    """With its modifiers part of its mesh, and no UV map."""
    select(obj)
    bpy.ops.object.convert(target="MESH")
    mesh: Any = obj.data
    while mesh.uv_layers:
        mesh.uv_layers.remove(mesh.uv_layers[0])
    return obj


FIGURES: dict[str, Open] = {
    "bunny": _model("bunny"),
    "igea": _model("igea"),
    "rocker": _model("rocker"),
    "spot": _model("spot"),
    "suzanne": _suzanne(2),
    "tube": _made("tube", lambda: round_shapes.tube(2048, closed=True)),
    "spring": _made("spring", lambda: round_shapes.spring(32, turns=6.0, steps=48)),
    "flange": _sample("part"),
    "foliage": _sample("foliage"),
    "character": _made("character", lambda: organic.character(120)),
}

"""Scenes as no artist would make them on purpose, for fuzzing: recipes that print as one line and build the same again.

hypothesis chooses the recipe; the numbers come from a generator seeded by it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from hypothesis import strategies as st
from numpy.typing import NDArray

from ...core.base.arrays import Doubles
from ...core.rays.map_spec import AO, MapSpec, reflection, sampled
from ...core.scene.scene import Camera, Instance, Mesh, Scene
from ...core.settings import Settings
from .settings import flat_settings

Points = Doubles  # (V, 3)
Faces = NDArray[np.int64]  # (T, 3)
Generator = np.random.Generator


def _soup(rng: Generator, size: int) -> tuple[Points, Faces]:
    """Loose triangles in a cube."""
    return rng.uniform(-1, 1, (3 * size, 3)), np.arange(3 * size, dtype=np.int64).reshape(-1, 3)


def _tangle(rng: Generator, size: int) -> tuple[Points, Faces]:
    """Triangles between any vertices: non-manifold, some corners the same."""
    return rng.uniform(-1, 1, (size + 2, 3)), rng.integers(0, size + 2, (size, 3))


def _grid(rng: Generator, size: int) -> tuple[Points, Faces]:
    """A rough terrain."""
    side = 1 + max(1, round(np.sqrt(size / 2)))
    row, column = np.mgrid[:side, :side]
    points = np.stack([column / (side - 1), row / (side - 1), 0.4 * rng.random(row.shape)], axis=-1)
    at = np.arange(side * side, dtype=np.int64).reshape(side, side)
    a, b, c, d = at[:-1, :-1].ravel(), at[:-1, 1:].ravel(), at[1:, 1:].ravel(), at[1:, :-1].ravel()
    return points.reshape(-1, 3), np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)])


def _box(rng: Generator, size: int) -> tuple[Points, Faces]:
    """Closed, facing outward."""
    points = np.array(list(np.ndindex(2, 2, 2)), dtype=np.float64) * rng.uniform(0.1, 2.0, 3)
    quads = np.array([(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)])
    return points, np.concatenate([quads[:, :3], quads[:, [0, 2, 3]]])


def _fan(rng: Generator, size: int) -> tuple[Points, Faces]:
    """Slivers about one edge."""
    turn = np.sort(rng.uniform(0, 2 * np.pi, size))
    rim = np.stack([np.cos(turn), np.sin(turn), np.zeros(size)], axis=1)
    faces = [(0, 1, 2 + i) for i in range(size)]
    return np.concatenate([[(0, 0, -1.0), (0, 0, 1.0)], rim]), np.array(faces)


def _empty(rng: Generator, size: int) -> tuple[Points, Faces]:
    return np.zeros((size % 2, 3)), np.zeros((0, 3), dtype=np.int64)


SHAPES: dict[str, Callable[[Generator, int], tuple[Points, Faces]]] = {
    "soup": _soup,
    "tangle": _tangle,
    "grid": _grid,
    "box": _box,
    "fan": _fan,
    "empty": _empty,
}


def _some(rng: Generator, count: int) -> NDArray[np.int64]:
    """One in four places, at least one."""
    return rng.choice(count, max(1, count // 4), replace=False)


def _put(points: Points, rng: Generator, value: float) -> Points:
    changed = points.copy()
    if len(points):
        changed[_some(rng, len(points)), rng.integers(0, 3)] = value
    return changed


SPOILS: dict[str, Callable[[Generator, Points], Points]] = {
    "flat": lambda rng, points: points * (1.0, 1.0, 0.0),
    "line": lambda rng, points: points * (1.0, 0.0, 0.0),
    "point": lambda rng, points: points * 0.0,
    "rounded": lambda rng, points: np.round(points * 2) / 2,
    "needle": lambda rng, points: points * (1.0, 1e-6, 1.0),
    "far": lambda rng, points: points + 1e6,
    "large": lambda rng, points: points * 1e4,
    "small": lambda rng, points: points * 1e-4,
    "huge": lambda rng, points: points * 1e30,
    "tiny": lambda rng, points: points * 1e-30,
    "largest": lambda rng, points: points * 3e38,
    "denormal": lambda rng, points: points * 1e-42,
    "mixed": lambda rng, points: points * 10.0 ** rng.uniform(-20, 20, (len(points), 1)),
    "one huge": lambda rng, points: _put(points, rng, 1e30),
    "nan": lambda rng, points: _put(points, rng, np.nan),
    "infinite": lambda rng, points: _put(points, rng, np.inf),
}
FACE_SPOILS: dict[str, Callable[[Faces], Faces]] = {
    "doubled": lambda faces: np.concatenate([faces, faces]),
    "two-sided": lambda faces: np.concatenate([faces, faces[:, ::-1]]),
    "mixed winding": lambda faces: np.where(
        np.arange(len(faces), dtype=np.int64)[:, None] % 2 == 0, faces, faces[:, ::-1]
    ),
    "no area": lambda faces: np.concatenate([faces, faces[:1, [0, 0, 1]], faces[:1, [2, 2, 2]]]),
}


def _cells(rng: Generator, count: int) -> Doubles:
    """Each triangle in a cell of its own."""
    side = max(1, int(np.ceil(np.sqrt(count))))
    place = np.stack([np.arange(count, dtype=np.int64) % side, np.arange(count, dtype=np.int64) // side], axis=1)
    corners = np.array([(0.1, 0.1), (0.9, 0.2), (0.3, 0.9)])
    cells: Doubles = (place[:, None] + corners) / side
    return cells


UVS: dict[str, Callable[[Generator, int], Doubles | None]] = {
    "cells": _cells,
    "none": lambda rng, count: None,
    "random": lambda rng, count: rng.random((count, 3, 2)),
    "mirrored": lambda rng, count: _cells(rng, count)[:, ::-1],
    "whole": lambda rng, count: np.tile([(0.0, 0.0), (2.0, 0.0), (0.0, 2.0)], (count, 1, 1)),
    "outside": lambda rng, count: _cells(rng, count) + 3.0,
    "partly outside": lambda rng, count: 3.0 * _cells(rng, count) - 1.0,
    "huge": lambda rng, count: 1e30 * (_cells(rng, count) - 0.5),
    "largest": lambda rng, count: 3e38 * (rng.random((count, 3, 2)) - 0.5),
    "tiny": lambda rng, count: 1e-30 * rng.random((count, 3, 2)),
    "sliver": lambda rng, count: rng.random((count, 3, 2)) * (1.0, 1e-5) + (0.0, 0.5),
    "mixed": lambda rng, count: _cells(rng, count) * 10.0 ** rng.uniform(-8, 8, (count, 1, 1)),
    "point": lambda rng, count: np.full((count, 3, 2), 0.5),
    "nan": lambda rng, count: np.where(rng.random((count, 3, 2)) < 0.2, np.nan, _cells(rng, count)),
    "infinite": lambda rng, count: np.where(rng.random((count, 3, 2)) < 0.2, np.inf, _cells(rng, count)),
}
NORMALS: dict[str, Callable[[Generator, Doubles], Doubles | None]] = {
    "none": lambda rng, geometric: None,
    "tilted": lambda rng, geometric: _unit(geometric + 0.4 * rng.normal(size=geometric.shape)),
    "random": lambda rng, geometric: _unit(rng.normal(size=geometric.shape)),
    "inward": lambda rng, geometric: -geometric,
    "zero": lambda rng, geometric: 0.0 * geometric,
    "cancelling": lambda rng, geometric: geometric * np.array([1.0, -1.0, 0.0])[:, None],
    "huge": lambda rng, geometric: 1e30 * geometric,
    "tiny": lambda rng, geometric: 1e-30 * geometric,
    "nan": lambda rng, geometric: np.where(rng.random(geometric.shape) < 0.2, np.nan, geometric),
    "infinite": lambda rng, geometric: np.where(rng.random(geometric.shape) < 0.2, np.inf, geometric),
}


def _unit(vectors: Doubles) -> Doubles:
    length = np.linalg.norm(vectors, axis=-1, keepdims=True)
    unit: Doubles = vectors / np.where(length > 0.0, length, 1.0)
    return unit


def _geometric(points: Points, faces: Faces) -> Doubles:
    """(T, 3, 3): each face's normal at its corners, (0, 0, 1) where it has none."""
    with np.errstate(all="ignore"):
        a, b, c = (points[faces[:, corner]] for corner in range(3))
        normal = _unit(np.cross(b - a, c - a))
    usable = np.isfinite(normal).all(axis=1) & (np.abs(normal).max(axis=1, initial=0.0) > 0.5)
    return np.repeat(np.where(usable[:, None], normal, (0.0, 0.0, 1.0))[:, None], 3, axis=1)


@dataclass(frozen=True)
class WildMesh:
    """The recipe of a mesh: keys of the tables above."""

    shape: str
    size: int
    seed: int
    spoils: tuple[str, ...] = ()
    uv: str = "cells"
    normals: str = "none"

    def build(self, name: str) -> Mesh:
        rng = np.random.default_rng(self.seed)
        points, faces = SHAPES[self.shape](rng, self.size)
        for spoil in self.spoils:
            if spoil in FACE_SPOILS:
                faces = FACE_SPOILS[spoil](faces)
        normals = NORMALS[self.normals](rng, _geometric(points, faces))
        with np.errstate(all="ignore"):
            for spoil in self.spoils:
                points = SPOILS[spoil](rng, points) if spoil in SPOILS else points
            uv = UVS[self.uv](rng, len(faces))
            return Mesh(name, points.astype(np.float32), faces.astype(np.int32), _single(uv), _single(normals))


def _single(array: Doubles | None) -> Any:
    return None if array is None else np.ascontiguousarray(array, dtype=np.float32)


def rotation(seed: int) -> Doubles:
    """(3, 3), any."""
    turned, _ = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))
    proper: Doubles = turned * np.sign(np.linalg.det(turned))
    return proper


def _affine(linear: Any, offset: Any = (0.0, 0.0, 0.0)) -> Doubles:
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = linear, offset
    return matrix


def _holding(value: float) -> Doubles:
    matrix = np.eye(4)
    matrix[1, 3] = value
    return matrix


MATRICES: dict[str, Doubles] = {
    "identity": np.eye(4),
    "turned": _affine(rotation(1), (0.3, -0.2, 0.1)),
    "grown": _affine(3.7 * np.eye(3), (1.0, 0.0, -0.5)),
    "mirrored": _affine(np.diag([1.0, -1.0, 1.0])),
    "stretched": _affine(np.diag([1.0, 50.0, 0.02])),
    "sheared": _affine([[1.0, 2.0, 0.0], [0.0, 1.0, -3.0], [0.0, 0.0, 1.0]]),
    "far": _affine(np.eye(3), (1e8, -1e8, 1e8)),
    "flattening": _affine(np.diag([1.0, 1.0, 0.0])),
    "collapsing": _affine(np.zeros((3, 3))),
    "nearly flat": _affine(np.diag([1.0, 1.0, 1e-30])),
    "large": _affine(1e8 * np.eye(3)),
    "small": _affine(1e-5 * np.eye(3)),
    "huge": _affine(1e30 * np.eye(3)),
    "tiny": _affine(1e-30 * np.eye(3)),
    "beyond float32": _affine(1e200 * np.eye(3)),
    "beneath float32": _affine(1e-200 * np.eye(3)),
    "beyond float64": _affine(1e300 * np.eye(3), (1e300, 0.0, 0.0)),
    "not a number": _holding(np.nan),
    "infinite": _holding(np.inf),
}
CAMERAS: dict[str, Camera | None] = {
    "none": None,
    "aside": Camera((2.0, -3.0, 4.0), (-0.4, 0.6, -0.7)),
    "inside": Camera((0.1, 0.05, 0.02), (0.0, 1.0, 0.0)),
    "parallel": Camera((0.0, 0.0, 0.0), (0.5, 0.1, -0.8), orthographic=True),
    "long parallel": Camera((0.0, 0.0, 0.0), (5e20, 1e20, -8e20), orthographic=True),
    "short parallel": Camera((0.0, 0.0, 0.0), (5e-30, 1e-30, -8e-30), orthographic=True),
    "nowhere": Camera((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), orthographic=True),
    "far off": Camera((1e30, 2e30, 1e30), (0.0, 0.0, -1.0)),
    "beyond float32": Camera((1e200, 0.0, 0.0), (0.0, 0.0, -1.0)),
    "not a number": Camera((np.nan, 0.0, 0.0), (0.0, 0.0, -1.0)),
}


@dataclass(frozen=True)
class WildObject:
    mesh: WildMesh
    matrix: str = "identity"

    def build(self, name: str) -> Instance:
        return Instance(name, self.mesh.build(name), MATRICES[self.matrix])


@dataclass(frozen=True)
class WildMap:
    """exponent None is AO."""

    exponent: float | None
    sampler: str = "importance"
    from_camera: bool = False

    def build(self, number: int) -> MapSpec:
        lobe = AO if self.exponent is None else reflection(self.exponent, from_camera=self.from_camera)
        return replace(sampled(lobe, self.sampler), name=f"map {number}")


@dataclass(frozen=True)
class WildBake:
    """The recipe of a bake. The target occludes itself unless `alone`."""

    target: WildObject
    others: tuple[WildObject, ...] = ()
    maps: tuple[WildMap, ...] = (WildMap(None),)
    width: int = 8
    height: int = 8
    rays: int = 16
    distance: float | None = None
    margin: int = 0
    threads: int = 1
    seed: int = 0
    camera: str = "aside"
    alone: bool = False
    divided: bool = False  # by the horizon

    def scene(self) -> Scene:
        target = self.target.build("target")
        others = [other.build(f"other {i}") for i, other in enumerate(self.others)]
        return Scene([target], others if self.alone else [target, *others], CAMERAS[self.camera])

    def settings(self) -> Settings:
        """Raises InputError as Settings does."""
        maps = tuple(each.build(i) for i, each in enumerate(self.maps))
        names = ("width", "height", "rays", "distance", "margin", "threads", "seed")
        return flat_settings(maps, **{name: getattr(self, name) for name in names}, divide_horizon=self.divided)


_SEEDS = st.integers(0, 999_999)
_TAME_SPOILS = ["needle", "large", "small", "far", *FACE_SPOILS]
_TAME_MATRICES = ["identity", "turned", "grown", "mirrored", "stretched", "sheared"]


def _keys(table: Any, first: str) -> st.SearchStrategy[Any]:
    """Half of the draws take the first, tame one, so that a case rarely has everything wrong at once."""
    return st.just(first) | st.sampled_from([*table])


def _objects(shapes: Any, spoils: Any, uvs: Any, normals: Any, matrices: Any) -> st.SearchStrategy[WildObject]:
    mesh = st.builds(WildMesh, shapes, st.integers(1, 24), _SEEDS, spoils, uvs, normals)
    return st.builds(WildObject, mesh, matrices)


def _maps(exponents: Any) -> st.SearchStrategy[WildMap]:
    about_normal = st.builds(
        WildMap, exponents, st.sampled_from(["importance", "uniform_hemisphere", "uniform_sphere"])
    )
    about_r = st.builds(WildMap, exponents, st.sampled_from(["importance", "uniform_sphere"]), st.just(True))
    return about_normal | about_r


_EXPONENTS = st.none() | st.sampled_from([0.0, 1.0, 10.0, 100.0, 1e4, 1e6]) | st.floats(0.0, 1e6)
_DISTANCES = st.none() | st.floats(-30.0, 30.0).map(lambda power: 10.0**power)
_SIDES = st.sampled_from([1, 2, 3, 7, 8, 9, 16, 31, 40])

wild_objects = _objects(
    st.sampled_from([*SHAPES]),
    st.lists(st.sampled_from([*SPOILS, *FACE_SPOILS]), max_size=2).map(tuple),
    _keys(UVS, "cells"),
    _keys(NORMALS, "none"),
    _keys(MATRICES, "identity"),
)
tame_objects = _objects(
    st.sampled_from(["soup", "grid", "box", "fan", "tangle"]),
    st.lists(st.sampled_from(_TAME_SPOILS), max_size=1).map(tuple),
    st.sampled_from(["cells", "mirrored"]),
    st.sampled_from(["none", "tilted"]),
    st.sampled_from(_TAME_MATRICES),
)
wild_bakes = st.builds(
    WildBake,
    target=wild_objects,
    others=st.lists(wild_objects, max_size=2).map(tuple),
    maps=st.lists(_maps(_EXPONENTS), min_size=1, max_size=2).map(tuple),
    width=_SIDES,
    height=_SIDES,
    rays=st.integers(1, 80),
    distance=_DISTANCES,
    margin=st.integers(0, 5),
    threads=st.sampled_from([1, 1, 2]),
    seed=st.integers(-5, 1 << 40),
    camera=_keys(CAMERAS, "aside"),
    alone=st.booleans(),
    divided=st.booleans(),
)
tame_bakes = st.builds(
    WildBake,
    target=tame_objects,
    others=st.lists(tame_objects, min_size=1, max_size=2).map(tuple),
    maps=st.lists(_maps(st.none() | st.sampled_from([0.0, 3.0, 40.0])), min_size=1, max_size=2).map(tuple),
    width=st.sampled_from([8, 13, 16]),
    height=st.sampled_from([8, 13, 16]),
    rays=st.integers(1, 40),
    distance=st.none() | st.floats(0.1, 3.0),
    seed=_SEEDS,
    camera=st.sampled_from(["aside", "inside", "parallel"]),
)

"""Small scenes with known answers, and the frames that each must keep its answer in.

A case stands in its own space, lengths about 1: a patch of side 2^-10 about the origin that faces +z (so small and so
centred that what changes over it cancels), and what blocks its view. Endless things are long enough that the rest is
below 1e-6; round things have as many sides, and the area of their circle, so that the first order cancels. What remains
is each case's slack. A frame moves, scales, turns, dirties or cuts a case up.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from math import acos, asin, atan, cos, inf, pi, radians, sin, sqrt
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ...core.base.arrays import Doubles, Ints
from ...core.rays.map_spec import AO, MapSpec, reflection, sampled
from ...core.scene.scene import Camera, Instance, Mesh
from . import formulas
from .point import Point
from .shapes import patch, skew_rotation

SEGMENTS = 512  # of a circle
LONG, VAST = 60.0, 2.0**22  # half-lengths that stand for endless, beside lengths of about 1


@dataclass(frozen=True, eq=False)
class Solid:
    """Triangles before their coordinates are rounded. vertices: (V, 3) float64. triangles: (T, 3) int32."""

    vertices: Doubles
    triangles: Ints


Change = Callable[[Solid], Solid]


@dataclass(frozen=True)
class Answer:
    """What one estimator must give. sharp: how much faster than AO's its value changes as an edge moves."""

    estimator: MapSpec
    exact: float

    @property
    def sharp(self) -> float:
        """The lobe's highest density along a line, over AO's: √(n/2π) for the narrow, 1 at least."""
        return max(1.0, sqrt(self.estimator.exponent / (2.0 * pi)))


@dataclass(frozen=True, eq=False)
class Case:
    """One scene and its answers.

    toward: R, of unit length, where an answer is about the reflected direction. place: (4, 4), the patch to the case's
    space. slack: what truncation and tessellation may add, and slack_from why. extent: the half-length of the things
    whose edges count; its rounding to float32 moves those edges.
    """

    name: str
    answers: tuple[Answer, ...]
    solids: tuple[Solid, ...] = ()
    toward: tuple[float, float, float] | None = None
    distance: float | None = None
    slack: float = 0.0
    slack_from: str = "nothing"
    extent: float = 2.0
    place: Doubles = field(default_factory=lambda: np.eye(4))

    def changed(self, solid: Solid, change: Change | None) -> Solid:
        """The solid after what a frame does to it. What stands for endless by 2^22 is not cut: a needle that long and a
        few units wide has no plane left in float32."""
        return solid if change is None or (change is splintered and self.extent == 0.0) else change(solid)


@dataclass(frozen=True)
class Frame:
    """How a case is put into the world. Offsets are along no axis, the turn is skew.

    scale, offset, turned: by the objects' matrices. mesh_scale, mesh_offset: written into the float32 coordinates.
    change: what is done to the occluders. needle: the patch becomes two triangles of 2^20 : 1.
    """

    name: str
    scale: float = 1.0
    offset: float = 0.0
    turned: bool = False
    mesh_scale: float = 1.0
    mesh_offset: float = 0.0
    change: Change | None = None
    junk: bool = False
    needle: bool = False

    @property
    def matrix(self) -> Doubles:
        """(4, 4) float64: scale, then turn, then move."""
        matrix = np.eye(4)
        matrix[:3, :3] = (skew_rotation() if self.turned else np.eye(3)) * self.scale
        matrix[:3, 3] = self.offset * np.array([1.0, -1.0, 0.7])
        return matrix

    def slack(self, case: Case, answer: Answer) -> float:
        """How far from the exact answer the case may lie here for reasons of its own; 1e-6 is the sums' rounding.

        Needles: float32 does not hold their planes, and what these cover, some 1e-5 of the view, may be missed.
        """
        rounding = 2.0**-24 * case.extent + 2.0**-23 * self.mesh_offset
        needles = 2e-5 if self.change is splintered else 0.0
        return 1e-6 + (case.slack + rounding + needles) * answer.sharp


def stage(case: Case, frame: Frame, texels: int) -> Point:
    """The case in the frame, ready to trace; the patch is among the occluders."""
    shift = frame.mesh_offset * frame.mesh_scale * np.array([1.0, -1.0, 1.0])
    to_shifted, back = np.eye(4), np.eye(4)
    to_shifted[:3, 3], back[:3, 3] = shift, -shift
    place = case.place.copy()
    place[:3, 3] *= frame.mesh_scale
    receiver = Instance("patch", _patch(frame, shift), frame.matrix @ to_shifted @ place @ back)
    solids = [*(case.changed(solid, frame.change) for solid in case.solids), *([_junk()] if frame.junk else [])]
    meshes = [_mesh(solid, frame, shift, f"occluder {i}") for i, solid in enumerate(solids)]
    occluders = [receiver, *(Instance(mesh.name, mesh, frame.matrix) for mesh in meshes)]
    distance = None if case.distance is None else case.distance * frame.scale * frame.mesh_scale
    return Point(receiver, occluders, distance=distance, camera=_camera(case, frame), texels=texels)


def _patch(frame: Frame, shift: Doubles) -> Mesh:
    mesh = patch()
    squeeze = frame.mesh_scale * np.array([1.0, 2.0**-20 if frame.needle else 1.0, 1.0])
    return replace(mesh, vertices=(mesh.vertices * squeeze + shift).astype(np.float32))


def _mesh(solid: Solid, frame: Frame, shift: Doubles, name: str) -> Mesh:
    return Mesh(name, (solid.vertices * frame.mesh_scale + shift).astype(np.float32), solid.triangles)


def _camera(case: Case, frame: Frame) -> Camera | None:
    """A parallel view that the patch mirrors towards R."""
    if case.toward is None:
        return None
    x, y, z = (skew_rotation() if frame.turned else np.eye(3)) @ (np.array(case.toward) * (1, 1, -1))
    return Camera((0.0, 0.0, 0.0), (float(x), float(y), float(z)), orthographic=True)


# Frames


def dirty(solid: Solid) -> Solid:
    """Every triangle twice, once turned over; points and lines as triangles; corners that are no numbers."""
    v, t = solid.vertices, solid.triangles
    middle = v.mean(axis=0)
    more = np.array([middle, v[0], 0.5 * (v[0] + middle), [np.nan] * 3, [np.inf, 0, 0], [0, -np.inf, np.nan]])
    a, b, c, *broken = range(len(v), len(v) + 6)
    bad = [(a, a, a), (a, b, c), (a, b, a), *((a, b, each) for each in broken), (broken[0], broken[1], broken[2])]
    triangles = np.concatenate([t, t[:, ::-1], np.array(bad, dtype=np.int32)])
    return Solid(np.concatenate([v, more]), triangles)


def _junk() -> Solid:
    """A hundred triangles without area, all about the patch; they must block nothing."""
    ends = np.random.default_rng(3).uniform((-2, -2, 0.1), (2, 2, 2), (100, 2, 3))
    corners = np.concatenate([ends, ends.mean(axis=1, keepdims=True)], axis=1)
    corners[50:, 2] = corners[50:, 1]  # two corners in one place; the others' three lie on a line, but for rounding
    corners[75:, 1:] = corners[75:, :1]
    return Solid(corners.reshape(-1, 3), np.arange(300, dtype=np.int32).reshape(-1, 3))


def splintered(solid: Solid) -> Solid:
    """Each triangle in seven, of which three are needles of about 10^6 : 1 along its edges."""
    v, t = solid.vertices, solid.triangles
    corner = v[t]  # (T, 3, 3)
    middle = 0.5 * (corner + np.roll(corner, -1, axis=1))
    near = middle + 1e-6 * (np.roll(corner, -2, axis=1) - middle)  # by the edge from corner i to i + 1
    start = len(v) + 3 * np.arange(len(t), dtype=np.int32)
    (a, b, c), (ab, bc, ca) = t.T, (start, start + 1, start + 2)
    pieces = [(a, b, ab), (b, c, bc), (c, a, ca), (a, ab, ca), (b, bc, ab), (c, ca, bc), (ab, bc, ca)]
    triangles = np.concatenate([np.stack(piece, axis=1) for piece in pieces])
    return Solid(np.concatenate([v, near.reshape(-1, 3)]), triangles.astype(np.int32))


FRAMES = (
    Frame("as it is"),
    Frame("offset 1e6, turned", offset=1e6, turned=True),
    Frame("scale 1e-4", scale=1e-4),
    Frame("scale 1e-2, offset 1e3, turned", scale=1e-2, offset=1e3, turned=True),
    Frame("scale 1e2, offset 1e5", scale=1e2, offset=1e5),
    Frame("scale 1e4, offset 1e6, turned", scale=1e4, offset=1e6, turned=True),
    Frame("mesh scale 1e-4", mesh_scale=1e-4),
    Frame("mesh scale 1e4, turned", mesh_scale=1e4, turned=True),
    Frame("mesh offset 64", mesh_offset=64.0),
    Frame("junk, turned", change=dirty, junk=True, turned=True),
    Frame("needles", change=splintered, needle=True),
    Frame("needles, turned", change=splintered, needle=True, turned=True),
)


# Things


def quad(corner: ArrayLike, along: ArrayLike, up: ArrayLike) -> Solid:
    """A parallelogram."""
    place = np.array([(0, 0), (1, 0), (1, 1), (0, 1)], dtype=np.float64)
    vertices = np.asarray(corner, dtype=np.float64) + place @ np.array([along, up], dtype=np.float64)
    return Solid(vertices, np.array([(0, 1, 2), (0, 2, 3)], dtype=np.int32))


def upright(x: float, top: float, half: float = LONG, foot: float = 1.0) -> Solid:
    """A long wall at x, from `foot` below the plane to `top`."""
    return quad((x, -half, -foot), (0, 2 * half, 0), (0, 0, foot + top))


def rings(axis: ArrayLike, centre: ArrayLike, heights: ArrayLike, radii: ArrayLike) -> Solid:
    """Circles about an axis (of unit length), one ring after the other, joined; their polygons have the circles' area.

    heights, radii: (K,) along the axis from the centre, and from the axis. A radius of 0 closes an end.
    """
    z, r = np.broadcast_arrays(np.asarray(heights, dtype=np.float64), np.asarray(radii, dtype=np.float64))
    x_axis, y_axis, z_axis = _basis(axis)
    turn = 2 * pi * np.arange(SEGMENTS, dtype=np.int64) / SEGMENTS
    grown = sqrt((2 * pi / SEGMENTS) / sin(2 * pi / SEGMENTS)) * r[:, None, None]
    circle = np.cos(turn)[:, None] * x_axis + np.sin(turn)[:, None] * y_axis
    vertices = np.asarray(centre) + grown * circle + z[:, None, None] * z_axis
    at = np.arange(len(z) * SEGMENTS, dtype=np.int64).reshape(len(z), SEGMENTS)
    a, b = at[:-1], at[1:]
    c, d = np.roll(b, -1, axis=1), np.roll(a, -1, axis=1)
    triangles = np.concatenate([np.stack([a, b, c], -1).reshape(-1, 3), np.stack([a, c, d], -1).reshape(-1, 3)])
    vertices = vertices.reshape(-1, 3)
    return Solid(vertices, _with_area(vertices, triangles.astype(np.int32)))


def disk(radius: float, centre: tuple[float, float, float]) -> Solid:
    """Level."""
    return rings((0, 0, 1), centre, (0, 0), (0, radius))


def ball(radius: float, centre: tuple[float, float, float]) -> Solid:
    """A sphere whose pole looks at the origin: its outline from there is one ring, at the tangent's polar angle."""
    distance = float(np.linalg.norm(centre))
    tangent = acos(radius / distance)
    polar = np.concatenate([np.linspace(0, tangent, 5), np.linspace(tangent, pi, 9)[1:]])
    return rings(-np.array(centre) / distance, centre, radius * np.cos(polar), radius * np.sin(polar))


def bag(opening: float) -> Solid:
    """What the inside of a unit bowl sees: the opening's rim in its place, and all else a little outside the sphere."""
    polar = np.linspace(opening, pi, 65)
    size = np.where(polar == opening, 1.0, 1.02)
    return rings((0, 0, 1), (0, 0, 0), size * np.cos(polar), size * np.sin(polar))


def _basis(axis: ArrayLike) -> tuple[Doubles, Doubles, Doubles]:
    z = np.asarray(axis, dtype=np.float64)
    x = np.cross(np.roll(np.eye(3)[int(np.argmax(np.abs(z)))], 1), z)
    x /= np.linalg.norm(x)
    return x, np.cross(z, x), z


def _with_area(vertices: Doubles, triangles: Ints) -> Ints:
    a, b, c = vertices[triangles].transpose(1, 0, 2)
    kept: Ints = triangles[np.linalg.norm(np.cross(b - a, c - a), axis=1) > 0.0]
    return kept


# Cases


def lean(degrees: float) -> tuple[float, float, float]:
    """R, leaning from +z towards +x."""
    return sin(radians(degrees)), 0.0, cos(radians(degrees))


def _ao(exact: float) -> tuple[Answer, ...]:
    return (Answer(AO, exact),)


def _about_normal(exact: Callable[[float], float], exponents: Sequence[float]) -> tuple[Answer, ...]:
    return tuple(Answer(AO if n == 1 else reflection(n), exact(n)) for n in exponents)


def _about_r(exact: Callable[[float], float], exponents: Sequence[float]) -> tuple[Answer, ...]:
    return tuple(Answer(reflection(n, from_camera=True), exact(n)) for n in exponents)


def _naive(exact: Callable[[float], float], names: Sequence[str], lobes: Sequence[MapSpec]) -> tuple[Answer, ...]:
    return tuple(Answer(sampled(lobe, name), exact(lobe.exponent)) for lobe in lobes for name in names)


ALL = (1.0, 2.5, 7.0, 10.0, 64.0, 100.0, 1000.0)
NARROW = (10.0, 64.0, 100.0, 1000.0)
ROUND: dict[str, Any] = {
    "slack": 1e-6,
    "slack_from": f"polygons of {SEGMENTS} sides with the circle's area: second order",
}
ENDLESS: dict[str, Any] = {
    "slack": 1.1e-6,
    "slack_from": f"walls of half-length {LONG:g}: d h²/(3π L³)",
    "extent": LONG,
}
HUGE: dict[str, Any] = {"slack": 5e-7, "slack_from": "half-length 2^22: d/2L", "extent": 0.0}


def cases() -> list[Case]:
    """Every row of the table, by AO and RO."""
    return [*_flat(), *_round(), *_endless(), *_open(), *_leaning()]


def _flat() -> list[Case]:
    level = quad((0, 0, 0.6), (0.8, 0, 0), (0, 1.1, 0))
    ceiling = quad((-4, -4, 0.6), (8, 0, 0), (0, 8, 0))
    within = _about_normal(lambda n: formulas.ceiling_within(0.6, 1.0, n), ALL)
    beyond = _about_normal(lambda n: 1.0, ALL)
    return [
        Case(
            "perpendicular rectangle",
            _ao(formulas.perpendicular_rectangle(0.7, 1.2, 0.9)),
            (quad((0.7, 0, 0), (0, 1.2, 0), (0, 0, 0.9)),),
        ),
        Case("parallel rectangle", _ao(formulas.parallel_rectangle(0.8, 1.1, 0.6)), (level,)),
        Case("ceiling, rays limited", within, (ceiling,), distance=1.0),
        Case("ceiling beyond the rays", beyond, (ceiling,), distance=0.599),
    ]


def _round() -> list[Case]:
    slanted = (1.5 * sin(0.7), 0.0, 1.5 * cos(0.7))
    balls = [
        ("sphere overhead", ball(0.9, (0, 0, 1.5)), formulas.sphere_above(0.9, 1.5, 0.0)),
        ("sphere aside", ball(0.9, slanted), formulas.sphere_above(0.9, 1.5, 0.7)),
        ("sphere resting", ball(0.5, (0.6, 0, 0.5)), formulas.sphere_resting(0.5, 0.6)),
        ("sphere resting, far", ball(0.5, (2.0, 0, 0.5)), formulas.sphere_resting(0.5, 2.0)),
        ("sphere cut by the horizon", ball(0.5, (1, 0, 0.2)), formulas.sphere_cut(0.5, sqrt(1.04), atan(5.0))),
        (
            "sphere mostly below",
            ball(0.8, (0.7, 0, -0.5)),
            formulas.sphere_cut(0.8, sqrt(0.74), 0.5 * pi + atan(0.5 / 0.7)),
        ),
        ("offset disk", disk(0.7, (0.9, 0, 0.8)), formulas.offset_disk(0.7, 0.9, 0.8)),
    ]
    hole = rings((0, 0, 1), (0, 0, 0), (-0.1, 1.0), (0.6, 0.6))
    in_hole = _about_normal(lambda n: formulas.cylinder_floor(0.6, 1.0, n), ALL)
    under = _about_normal(lambda n: formulas.coaxial_disk(0.25, 1.0, n), ALL)
    bowls = [
        Case(f"bowl, point at {at}°", _ao(formulas.bowl(radians(50))), (bag(radians(50)),), place=_inside(at), **ROUND)
        for at in (180, 120, 75)
    ]
    return [
        *(Case(name, _ao(exact), (solid,), **ROUND) for name, solid, exact in balls),
        Case("coaxial disk", under, (disk(0.25, (0, 0, 1)),), **ROUND),
        Case("floor of a round hole", in_hole, (hole,), **ROUND),
        *bowls,
    ]


def _inside(degrees: float) -> Doubles:
    """The patch on the unit sphere at that polar angle, facing its centre."""
    place = np.eye(4)
    outward = np.array([sin(radians(degrees)), 0.0, cos(radians(degrees))])
    place[:3, :3] = np.stack(_basis(-outward), axis=1)
    place[:3, 3] = outward
    return place


def _endless() -> list[Case]:
    wall, other = upright(1.0, 1.5), upright(-0.5, 1.5)
    corner = (upright(1.0, VAST, VAST, VAST), quad((-VAST, 1, -VAST), (2 * VAST, 0, 0), (0, 0, 2 * VAST)))
    before_wall = partial(formulas.leaning_wall, distance=1, height=1.5, tilt=0)
    in_trench = partial(formulas.leaning_trench, left=0.5, right=1, depth=1.5, tilt=0)
    naive = _naive(in_trench, ("uniform_hemisphere", "uniform_sphere"), (AO, reflection(10)))
    diagonals = [
        Case(
            f"octant corner, R along ({x:.2f}, {y:.2f}, {z:.2f})",
            (Answer(reflection(1, from_camera=True), formulas.octant_lobe(x, y, z)),),
            corner,
            (-x, -y, z),
            **HUGE,
        )
        for x, y, z in (_unit(1, 1, 1), _unit(3, 1, 2))
    ]
    return [
        Case("long wall", _about_normal(before_wall, ALL), (wall,), **ENDLESS),
        Case("wall without end", _ao(formulas.long_wall(1, inf)), corner[:1], **HUGE),
        Case("trench", _about_normal(in_trench, ALL), (wall, other), **ENDLESS),
        Case("trench, naive samplers", naive, (wall, other), **ENDLESS),
        Case("octant corner", _about_normal(lambda n: formulas.OCTANT_CORNER, ALL), corner, **HUGE),
        *diagonals,
    ]


def _unit(x: float, y: float, z: float) -> tuple[float, float, float]:
    length = sqrt(x * x + y * y + z * z)
    return x / length, y / length, z / length


def _open() -> list[Case]:
    samplers = ("uniform_hemisphere", "uniform_sphere")
    plain = _about_normal(lambda n: formulas.OPEN_PLANE, ALL)
    naive = _naive(lambda n: formulas.OPEN_PLANE, samplers, (AO, reflection(10)))
    lobes = [reflection(n, from_camera=True) for n in (1, 10)]
    tilted = []
    for degrees in (0, 30, 60, 85):
        exact = partial(formulas.horizon, tilt=radians(degrees))
        answers = (*_about_r(exact, ALL), *_naive(exact, samplers[1:], lobes))
        tilted.append(Case(f"open plane, R at {degrees}°", answers, toward=lean(degrees)))
    return [Case("open plane", plain), Case("open plane, naive samplers", naive), *tilted]


def _leaning() -> list[Case]:
    walls, trench = (upright(1.0, 1.5),), (upright(1.0, 1.5), upright(-0.5, 1.5))
    found = []
    for degrees in (30, 85, -60):
        exact = partial(formulas.leaning_wall, distance=1, height=1.5, tilt=radians(degrees))
        found.append(Case(f"long wall, R at {degrees}°", _about_r(exact, ALL), walls, lean(degrees), **ENDLESS))
    for degrees in (60, -30, -85):
        exact = partial(formulas.leaning_trench, left=0.5, right=1, depth=1.5, tilt=radians(degrees))
        found.append(Case(f"trench, R at {degrees}°", _about_r(exact, ALL), trench, lean(degrees), **ENDLESS))
    return [*found, *_caps(), *_caps_off_axis()]


def _caps() -> list[Case]:
    found = []
    for degrees, wide, exponents in ((0, 25, ALL), (30, 25, ALL), (60, 25, ALL), (0, 4, NARROW), (85, 4, NARROW)):
        exact = partial(formulas.cap, half_angle=radians(wide), tilt=radians(degrees))
        solid = ball(2.0 * sin(radians(wide)), _three(2.0 * np.array(lean(degrees))))
        name = f"cap of {wide}° about R at {degrees}°"
        found.append(Case(name, _about_r(exact, exponents), (solid,), lean(degrees), **ROUND))
    return found


def _caps_off_axis() -> list[Case]:
    found = []
    for degrees, away, wide in ((0, 40, 25), (30, 20, 25), (50, 30, 10), (85, 3, 2)):
        exact = partial(formulas.cap_off_axis, half_angle=radians(wide), away=radians(away), tilt=radians(degrees))
        aside = np.array([-cos(radians(degrees)), 1.0, sin(radians(degrees))]) / sqrt(2.0)  # square to R
        middle = cos(radians(away)) * np.array(lean(degrees)) + sin(radians(away)) * aside
        assert asin(middle[2]) > radians(wide), "a cap must lie above the horizon"
        solid = ball(2.0 * sin(radians(wide)), _three(2.0 * middle))
        name = f"cap of {wide}° at {away}° from R at {degrees}°"
        found.append(Case(name, _about_r(exact, (1.0, 2.5, *NARROW)), (solid,), lean(degrees), **ROUND))
    return found


def _three(vector: Doubles) -> tuple[float, float, float]:
    x, y, z = (float(part) for part in vector)
    return x, y, z

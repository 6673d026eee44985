"""Grown and scanned things: bumpy balls, stars, bodies with limbs and with handles, a head with a cable."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from ....core.base.arrays import Doubles, Longs
from ....samples.surface_nets import surface_net
from .polygon_mesh import PolygonMesh, joined, net, of_faces

Field = Callable[[Doubles], Doubles]  # (..., 3) places to signed distances, negative inside
Limb = tuple[tuple[float, float, float], tuple[float, float, float], float]  # from, to, radius

# A body of two units' height, standing on z = 0.
BODY: tuple[Limb, ...] = (
    ((0.0, 0.0, 0.95), (0.0, 0.0, 1.4), 0.22),
    ((0.0, 0.0, 1.72), (0.0, -0.04, 1.82), 0.16),
    ((0.0, 0.0, 1.4), (0.0, 0.0, 1.7), 0.08),
    *(((side * 0.15, 0.0, 1.45), (side * 0.5, 0.05, 1.2), 0.08) for side in (-1, 1)),
    *(((side * 0.5, 0.05, 1.2), (side * 0.75, -0.1, 0.95), 0.065) for side in (-1, 1)),
    *(((side * 0.12, 0.0, 0.9), (side * 0.16, -0.03, 0.5), 0.12) for side in (-1, 1)),
    *(((side * 0.16, -0.03, 0.5), (side * 0.18, 0.03, 0.1), 0.085) for side in (-1, 1)),
    *(((side * 0.18, 0.03, 0.08), (side * 0.2, -0.2, 0.06), 0.07) for side in (-1, 1)),
)


def ball(levels: int) -> PolygonMesh:
    """A sphere of 20 · 4^levels triangles, an icosahedron halved again and again."""
    gold = 0.5 + np.sqrt(1.25)
    points = np.array([np.roll((0.0, a, b * gold), axis) for axis in range(3) for a in (-1, 1) for b in (-1, 1)])
    apart = np.linalg.norm(points[:, None] - points, axis=2) < 2.1
    triples = [
        (i, j, k) for i, j, k in np.ndindex(12, 12, 12) if i < j < k and apart[i, j] and apart[j, k] and apart[i, k]
    ]
    faces = np.array([t if np.linalg.det(points[list(t)]) > 0.0 else t[::-1] for t in triples])
    for _ in range(levels):
        points, faces = _halved(points, faces)
    return of_faces(points / np.linalg.norm(points, axis=1, keepdims=True), faces)


def scan(levels: int, seed: int, bumps: float = 0.25, noise: float = 0.01) -> PolygonMesh:
    """A ball with hills, and with noise in every vertex as scanners leave it, as many times an edge's length."""
    rng, mesh = np.random.default_rng(seed), ball(levels)
    unit = mesh.vertices.astype(np.float64)
    waves, phase, weight = rng.normal(scale=2.5, size=(3, 7)), rng.uniform(0, 6, 7), rng.normal(size=7)
    hills = 1.0 + bumps * (np.sin(unit @ waves + phase) @ weight) / np.abs(weight).sum()
    edge = np.sqrt(4.0 * np.pi / len(mesh.triangles))
    points = unit * hills[:, None] + noise * edge * rng.normal(size=unit.shape)
    return mesh._replace(vertices=points.astype(np.float32))


def waves(cells: int = 24, noise: float = 0.0) -> PolygonMesh:
    """A sheet of quads none of which is flat; noise makes it rough."""
    x, y = np.meshgrid(np.linspace(-3, 3, cells + 1), np.linspace(-3, 3, cells + 1))
    z = np.sin(2 * x) * np.cos(2 * y) + noise * np.random.default_rng(5).standard_normal(x.shape)
    return net(np.stack([x, y, z], axis=-1))


def terrain(cells: int, seed: int, height: float = 0.5) -> PolygonMesh:
    """A square of side 4 with hills on hills, each octave half as high and half as wide as the one before."""
    rng = np.random.default_rng(seed)
    x, y = np.meshgrid(np.linspace(-2, 2, cells + 1), np.linspace(-2, 2, cells + 1))
    z = np.zeros_like(x)
    for octave in range(5):
        for _ in range(4):
            turn, phase = rng.uniform(0.0, 2.0 * np.pi, 2)
            wave = 1.5 * 2.0**octave * (np.cos(turn) * x + np.sin(turn) * y)
            z += 0.5 ** (octave + 1) * height * np.sin(wave + phase)
    return net(np.stack([x, y, z], axis=-1))


def star(levels: int, seed: int, arms: int = 6, reach: float = 1.5) -> PolygonMesh:
    """A ball with horns."""
    rng, mesh = np.random.default_rng(seed), ball(levels)
    unit = mesh.vertices.astype(np.float64)
    ways = rng.normal(size=(arms, 3))
    ways /= np.linalg.norm(ways, axis=1, keepdims=True)
    pull = np.exp(20.0 * (unit @ ways.T - 1.0)).sum(axis=1)
    return mesh._replace(vertices=(unit * (1.0 + reach * pull)[:, None]).astype(np.float32))


def character(cells: int) -> PolygonMesh:
    """A body of head, trunk and limbs in one skin, two units high, on a grid of so many cells up."""
    return surface_of(limbs(BODY), (-1.0, -0.5, -0.1), (1.0, 0.4, 2.1), cells)


def handles(cells: int, seed: int, count: int = 2) -> PolygonMesh:
    """A ball of unit radius with handles: a surface of genus `count`, at the most."""
    turned = np.random.default_rng(seed).uniform(0.0, 2.0 * np.pi, count)
    rings = [_handle(angle) for angle in turned]

    def field(place: Doubles) -> Doubles:
        return _blended([np.linalg.norm(place, axis=-1) - 1.0, *(ring(place) for ring in rings)], 0.08)

    return surface_of(field, (-2.1, -2.1, -1.3), (2.1, 2.1, 1.3), cells)


def with_cable(head: PolygonMesh, length: float, radius: float = 0.01, sides: int = 8) -> PolygonMesh:
    """A thin tube along y beside a head, a piece of its own in one mesh with it: two rings a unit of length."""
    rings = max(int(2.0 * length), 2) + 1
    turn = 2.0 * np.pi * np.arange(sides, dtype=np.int64) / sides
    along = 1.0 + np.linspace(0.0, length, rings)[:, None] + 0.0 * turn
    points = [radius * np.cos(turn) + 0.0 * along, along, -0.9 + radius * np.sin(turn) + 0.0 * along]
    return joined([head, net(np.stack(points, axis=-1), close_columns=True)])


def limbs(of: Sequence[Limb], blend: float = 0.05) -> Field:
    """Capsules that grow into one another."""

    def field(place: Doubles) -> Doubles:
        return _blended([_capsule(place, np.array(start), np.array(end), radius) for start, end, radius in of], blend)

    return field


def surface_of(field: Field, low: tuple[float, ...], high: tuple[float, ...], cells: int) -> PolygonMesh:
    """Quads where a field is zero. cells: along z."""
    low_, high_ = np.array(low), np.array(high)
    step = (high_[2] - low_[2]) / cells
    sides = np.maximum(np.ceil((high_ - low_) / step), 2).astype(np.int64) + 1
    place = low_ + step * np.stack(
        np.meshgrid(*(np.arange(side, dtype=np.int64) for side in sides), indexing="ij"), axis=-1
    )
    return of_faces(*surface_net(field(place), low_, step))


def _capsule(place: Doubles, start: Doubles, end: Doubles, radius: float) -> Doubles:
    along = end - start
    share = np.clip((place - start) @ along / (along @ along), 0.0, 1.0)
    distance: Doubles = np.linalg.norm(place - start - share[..., None] * along, axis=-1) - radius
    return distance


def _handle(angle: float) -> Field:
    """A ring that leaves the unit ball and comes back."""
    middle, side = np.array([np.cos(angle), np.sin(angle), 0.0]), np.array([0.0, 0.0, 1.0])

    def field(place: Doubles) -> Doubles:
        out, up = place @ middle - 1.15, place @ side
        across = place @ np.cross(middle, side)
        distance: Doubles = np.hypot(np.hypot(out, up) - 0.6, across) - 0.15
        return distance

    return field


def _blended(distances: Sequence[Doubles], width: float) -> Doubles:
    """The least of them, rounded where they are alike."""
    stacked = np.stack(distances)
    least = stacked.min(axis=0)
    smooth: Doubles = least - width * np.log(np.exp((least - stacked) / width).sum(axis=0))
    return smooth


def _halved(points: Doubles, faces: Longs) -> tuple[Doubles, Longs]:
    """Each triangle cut into four at the middles of its edges, put onto the sphere."""
    ends = np.sort(np.stack([faces, faces[:, [1, 2, 0]]], axis=2).reshape(-1, 2), axis=1)
    edges, middle = np.unique(ends, axis=0, return_inverse=True)
    new = points[edges].mean(axis=1)
    new *= np.linalg.norm(points[0]) / np.linalg.norm(new, axis=1, keepdims=True)
    a, b, c = faces.T
    ab, bc, ca = (len(points) + middle.reshape(-1, 3)).T
    cut = [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
    return np.concatenate([points, new]), np.stack([np.stack(each, axis=1) for each in cut], axis=1).reshape(-1, 3)

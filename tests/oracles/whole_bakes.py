"""Meshes whose every texel has the same known value, through the whole bake: closed things, an open plane, a bowl."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from math import cos, pi, radians, sin, sqrt, tan
from statistics import NormalDist
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...core.bake import bake
from ...core.base.arrays import Doubles
from ...core.rays.map_spec import AO, MapSpec, reflection, sampled
from ...core.scene.scene import Instance, Mesh, Scene
from . import formulas
from .exact_cases import FRAMES, Frame
from .settings import flat_settings

OFFSETS = (0.0, 1e3, 1e5, 1e6)
SCALES = (1e-4, 1e-2, 1.0, 1e2, 1e4)
EVERYWHERE = replace(sampled(AO, "uniform_sphere"), name="ao uniform_sphere")  # tries the flattest directions most
MAPS: tuple[MapSpec, ...] = (AO, reflection(10), EVERYWHERE)
THIN = 1e-6  # of needles, beside a length of about 1
RIM = 2e-5  # of the strips along edges: samples keep 4e-6 off those
SPLIT = (-1.0, -1.0 + RIM, -0.3, -0.3 + THIN, 0.5, 0.5 + THIN, 1.0 - RIM, 1.0)
OPENING = radians(50)


def plane(lines: tuple[float, ...] = (-1.0, 1.0)) -> Mesh:
    """The square of half-width 1 that faces +z, cut along `lines` both ways; each piece has as much of the texture."""
    return _joined([_face(np.eye(3), 0.0, lines, (0.0, 0.0, 1.0, 1.0))], "plane")


def room(lines: tuple[float, ...] = (-1.0, 1.0)) -> Mesh:
    """The inside of the cube of half-width 1, a chart a side, cut along `lines`; neighbours share their corners."""
    faces = []
    for axis in range(3):
        outward, along, up = np.roll(np.eye(3), -axis, axis=0)
        for row, sign in enumerate((1.0, -1.0)):
            basis = np.array([up, along, sign * outward] if sign > 0 else [along, up, sign * outward])
            cell = ((axis + 0.04) / 3, (row + 0.03) / 2, (axis + 0.96) / 3, (row + 0.97) / 2)
            faces.append(_face(basis, 1.0, lines, cell))
    return _joined(faces, "room")


def globe(opening: float = 0.0, segments: int = 64, rings: int = 32) -> Mesh:
    """The inside of a sphere of radius 1, open within `opening` of +z; flat facets, four charts, seams between them.

    The opening's rim has the area of its circle. The triangles are shuffled: where several share a texel the last of
    the largest owns it, and if that were always the same half of a facet, its normals would lean to one side.
    """
    row, column = np.mgrid[: rings + 1, : segments + 1]
    polar, turn = opening + (pi - opening) * row / rings, 2 * pi * (column % segments) / segments
    grown = np.where(row == 0, sqrt((2 * pi / segments) / sin(2 * pi / segments)), 1.0)
    across = np.where((row == rings) | ((row == 0) & (opening == 0.0)), 0.0, np.sin(polar)) * grown
    vertices = np.stack([across * np.cos(turn), across * np.sin(turn), np.cos(polar)], axis=-1).reshape(-1, 3)
    at = np.arange(len(vertices), dtype=np.int64).reshape(rings + 1, segments + 1)
    a, b, c, d = at[:-1, :-1].ravel(), at[1:, :-1].ravel(), at[1:, 1:].ravel(), at[:-1, 1:].ravel()
    quarter = np.tile(np.repeat(np.arange(4, dtype=np.int64), segments // 4), rings)
    shuffled = np.random.default_rng(7).permutation(2 * len(a))
    triangles = np.concatenate([np.stack(corners, axis=1) for corners in ((a, c, b), (a, d, c))])[shuffled]
    chart = np.tile(quarter, 2)[shuffled, None]
    across_chart = 4 * (triangles % (segments + 1)) / segments - chart  # 0 to 1
    down = triangles // (segments + 1) / rings
    uv = np.stack([(chart % 2 + 0.02 + 0.96 * across_chart) / 2, (chart // 2 + 0.02 + 0.96 * (1 - down)) / 2], axis=-1)
    return _without_area(Mesh("globe", vertices.astype(np.float32), triangles.astype(np.int32), uv.astype(np.float32)))


def wedge(angle: float) -> Mesh:
    """The inside of a prism whose floor and roof meet at an angle, in radians; no chart's edge is on a texel's."""
    high = 2.0 * tan(angle)
    vertices = np.array([(x, y, z) for y in (-1, 1) for x, z in ((-1, 0), (1, 0), (1, high))], dtype=np.float32)
    corners = [(0, 2, 1), (3, 4, 5), (0, 4, 3), (0, 1, 4), (1, 5, 4), (1, 2, 5), (2, 3, 5), (2, 0, 3)]
    triangles = np.array(corners, dtype=np.int32)
    cell = np.array([(i % 4 / 4 + 0.01, i // 4 / 2 + 0.01) for i in range(8)])
    uv = cell[:, None] + np.array([(0, 0), (0, 0.48), (0.23, 0)])
    return Mesh("wedge", vertices, triangles, uv.astype(np.float32))


def _face(basis: Doubles, out: float, lines: tuple[float, ...], cell: tuple[float, ...]) -> tuple[Any, Any, Any]:
    """Vertices, triangles and UVs of a grid in the plane at `out` along the third row of `basis`.

    It faces along the first row × the second: along the third, or back where the rows are left-handed.
    """
    line = np.array(lines)
    n = len(line)
    x, y = np.meshgrid(line, line)
    vertices = x.reshape(-1, 1) * basis[0] + y.reshape(-1, 1) * basis[1] + out * basis[2]
    at = np.arange(n * n, dtype=np.int64).reshape(n, n)
    a, b, c, d = at[:-1, :-1].ravel(), at[:-1, 1:].ravel(), at[1:, 1:].ravel(), at[1:, :-1].ravel()
    triangles = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
    place = np.stack([triangles % n, triangles // n], axis=-1) / (n - 1)
    return vertices, triangles, np.array(cell[:2]) + place * (np.array(cell[2:]) - cell[:2])


def _joined(parts: list[tuple[Any, Any, Any]], name: str) -> Mesh:
    starts = np.cumsum([0, *(len(vertices) for vertices, _, _ in parts[:-1])])
    triangles = np.concatenate([part[1] + start for part, start in zip(parts, starts, strict=True)])
    vertices, uv = (np.concatenate([part[i] for part in parts]).astype(np.float32) for i in (0, 2))
    return Mesh(name, vertices, triangles.astype(np.int32), uv)


def _without_area(mesh: Mesh) -> Mesh:
    a, b, c = mesh.vertices[mesh.triangles].astype(np.float64).transpose(1, 0, 2)
    kept: NDArray[np.bool_] = np.linalg.norm(np.cross(b - a, c - a), axis=1) > 0.0
    assert mesh.uv is not None
    return replace(mesh, triangles=mesh.triangles[kept], uv=mesh.uv[kept])


def moved(mesh: Mesh, frame: Frame) -> Scene:
    """The mesh alone in the frame, target and occluder; its mesh scale and offset are in the coordinates."""
    vertices = (mesh.vertices.astype(np.float64) * frame.mesh_scale + frame.mesh_offset).astype(np.float32)
    instance = Instance(mesh.name, replace(mesh, vertices=vertices), frame.matrix)
    return Scene([instance], [instance])


def values(mesh: Mesh, frame: Frame, size: int, rays: int, seed: int, maps: tuple[MapSpec, ...]) -> list[Doubles]:
    """The covered texels' values, float64, an array a map."""
    (baked,) = bake(moved(mesh, frame), flat_settings(maps, width=size, height=size, rays=rays, margin=0, seed=seed))
    return [each.values[each.covered].astype(np.float64) for each in baked.maps.values()]


def astray(mesh: Mesh, frame: Frame, exact: float, *, size: int = 32, rays: int = 64, seed: int = 5) -> tuple[int, int]:
    """Texels of all maps whose value is not `exact` to the last bit, and the rays that were traced.

    With exact 1 the maps are those whose rays all weigh the same: the others are 1 in the mean alone.
    """
    maps = MAPS if exact == 0.0 else MAPS[:2]
    found = values(mesh, frame, size, rays, seed, maps)
    return sum(int(np.count_nonzero(each != exact)) for each in found), sum(len(each) * rays for each in found)


def leak_frames() -> list[Frame]:
    """Every offset with every scale, turned every second; then those within the mesh's own coordinates."""
    pairs = [(offset, scale) for offset in OFFSETS for scale in SCALES]
    frames = [
        Frame(f"offset {offset:g}, scale {scale:g}", scale, offset, turned)
        for i, (offset, scale) in enumerate(pairs)
        for turned in ((False, True) if scale == 1.0 else (i % 2 == 0,))
    ]
    return [
        *frames,
        *(Frame(f"mesh scale {scale:g}", mesh_scale=scale, turned=True) for scale in (1e-4, 1e4)),
        *(Frame(f"mesh offset 64, turned {turned}", mesh_offset=64.0, turned=turned) for turned in (False, True)),
    ]


def bowl_texels(frame: Frame, size: int, rays: int, seeds: range, segments: int = 512) -> dict[str, float]:
    """Every texel of a bowl against the one value of all: the ideal seam test.

    Returns the exact value; the mean over the texels and its standard error over the seeds; of one texel the standard
    error (root mean square over them) and the farthest off, also in standard errors, of which normal noise lets none of
    `texels` exceed `t_bound` (p = 1e-5 in all). slack: a facet's middle lies within the sphere by half of it; the rest
    is for the lean of the facets' halves.
    """
    mesh = globe(OPENING, segments, segments // 2)
    found = np.array([values(mesh, frame, size, rays, seed, (AO,))[0] for seed in seeds])  # (S, texels)
    exact, texels = formulas.bowl(OPENING), found.shape[1]
    texel_error = float(np.sqrt(np.mean(found.var(axis=0, ddof=1)) / len(found)))
    farthest = float(np.abs(found.mean(axis=0) - exact).max())
    return {
        "exact": exact,
        "mean": float(found.mean()),
        "error": float(found.mean(axis=1).std(ddof=1) / sqrt(len(found))),
        "texels": texels,
        "texel_error": texel_error,
        "farthest": farthest,
        "farthest_t": farthest / texel_error,
        "t_bound": NormalDist().inv_cdf(1.0 - 0.5e-5 / texels),
        "slack": 2.0 * (1.0 - cos(pi / segments)),
    }


def constant_bakes() -> Iterator[dict[str, Any]]:
    """Closed things and planes over all frames: how many texels differ from the one right value; a row a mesh."""
    for name, mesh, exact in (
        ("closed box", room(), 0.0),
        ("closed sphere", globe(), 0.0),
        ("closed wedge of 20°", wedge(radians(20)), 0.0),
        ("closed box, cut into needles", room(SPLIT), 0.0),
        ("open plane", plane(), 1.0),
        ("open plane, cut into needles", plane(SPLIT), 1.0),
    ):
        frames = leak_frames()
        found = [astray(mesh, frame, exact, rays=128) for frame in frames]
        wrong = [f"{frame.name}: {bad}" for frame, (bad, _) in zip(frames, found, strict=True) if bad]
        off, rays = (sum(column) for column in zip(*found, strict=True))
        yield {"mesh": name, "exact": exact, "frames": len(frames), "rays": rays, "texels": off, "wrong": wrong}


def bowls(seeds: int = 16) -> Iterator[dict[str, Any]]:
    """`bowl_texels` as it is, and far off."""
    for i, frame in enumerate((FRAMES[0], Frame("offset 1e5, scale 1e-2, turned", 1e-2, 1e5, True))):
        yield {"frame": frame.name, **bowl_texels(frame, 32, 256, range(seeds * i, seeds * (i + 1)))}

"""Small meshes whose occlusion is known, and the test that a mean of many seeds agrees with an exact answer.

Both come as fixtures: in pytest's importlib mode test modules cannot import one another.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import ArrayLike, NDArray
from occlusion_bake.core.bake import Baked, bake
from occlusion_bake.core.scene.scene import Camera, Instance, Mesh, Scene
from occlusion_bake.tests.oracles.settings import flat_settings

SEEDS = 16  # rays of one seed complete one another, so that only whole seeds are independent
T_BOUND = 6.5  # Student's t, 15 degrees of freedom: exceeded by chance with p = 1e-5


class Shapes:
    """Meshes from numbers, their UVs a chart or a grid of charts in the unit square."""

    @staticmethod
    def quad(
        corner: ArrayLike, along: ArrayLike, up: ArrayLike, cell: Sequence[float] = (0, 0, 1, 1), name: str = "quad"
    ) -> Mesh:
        """A parallelogram that faces along × up; cell: its place in the texture, (u0, v0, u1, v1)."""
        place = np.array([(0, 0), (1, 0), (1, 1), (0, 1)], dtype=np.float64)
        vertices = np.asarray(corner) + place @ np.array([along, up], dtype=np.float64)
        uv = np.array(cell[:2]) + place * (np.array(cell[2:]) - cell[:2])
        triangles = np.array([(0, 1, 2), (0, 2, 3)], dtype=np.int32)
        return Mesh(name, vertices.astype(np.float32), triangles, uv[triangles].astype(np.float32))

    @staticmethod
    def plane(half: float, height: float = 0.0, name: str = "plane", up: float = 1.0) -> Mesh:
        """A square of half-width `half` about the z axis that faces up, or down with up = -1."""
        return Shapes.quad((-half, -half * up, height), (2 * half, 0, 0), (0, 2 * half * up, 0), name=name)

    @staticmethod
    def patch(x: float = 0.0, y: float = 0.0) -> Mesh:
        """A piece of floor so small that occlusion is linear over it."""
        half = 2.0**-11
        return Shapes.quad((x - half, y - half, 0), (2 * half, 0, 0), (0, 2 * half, 0), name="patch")

    @staticmethod
    def tall_wall(x: float = -0.01) -> Mesh:
        """A wall without end that faces +x, on a floor and a little below: beside it all of x < 0 is hidden."""
        far = 4096.0
        return Shapes.quad((x, -far, -1), (0, 2 * far, 0), (0, 0, far), name="wall")

    @staticmethod
    def with_tangents(mesh: Mesh, tangent: ArrayLike = (1, 0, 0), sign: float = 1.0) -> Mesh:
        """The mesh with this tangent, and sign of the bitangent, at every corner."""
        tangents = np.empty((*mesh.triangles.shape, 4), dtype=np.float32)
        tangents[..., :3], tangents[..., 3] = tangent, sign
        return replace(mesh, tangents=tangents)

    @staticmethod
    def joined(meshes: Sequence[Mesh], name: str = "joined") -> Mesh:
        """One mesh of several, all of which have UVs; normals are dropped."""
        starts = np.cumsum([0, *(len(mesh.vertices) for mesh in meshes[:-1])])
        return Mesh(
            name,
            np.concatenate([mesh.vertices for mesh in meshes]),
            np.concatenate([mesh.triangles + start for mesh, start in zip(meshes, starts, strict=True)]).astype(
                np.int32
            ),
            np.concatenate([mesh.uv for mesh in meshes if mesh.uv is not None]),
        )

    @staticmethod
    def room(sides: Sequence[str] = ("-x", "+x", "-y", "+y", "-z", "+z"), name: str = "room") -> Mesh:
        """The inside of the cube of half-width 1, a chart a side; with fewer sides it is open."""
        quads = []
        for i, side in enumerate(sides):
            axis, sign = "xyz".index(side[1]), (-1.0 if side[0] == "-" else 1.0)
            outward, along, up = np.roll(np.eye(3), -axis, axis=0)  # a right-handed frame
            if sign > 0:  # the inside looks back
                along, up = up, along
            outward = sign * outward
            column, row = i % 3, i // 3
            cell = ((column + 0.04) / 3, (row + 0.03) / 2, (column + 0.96) / 3, (row + 0.97) / 2)
            quads.append(Shapes.quad(outward - along - up, 2 * along, 2 * up, cell))
        return Shapes.joined(quads, name)

    @staticmethod
    def sphere(
        centre: ArrayLike = (0, 0, 0),
        radius: float = 1.0,
        segments: int = 64,
        name: str = "sphere",
        smooth: bool = True,
    ) -> Mesh:
        """Longitude along u, latitude along v; closed, facing outward."""
        rings = segments // 2
        row, column = np.mgrid[: rings + 1, : segments + 1]
        polar, turn = np.pi * row / rings, 2 * np.pi * column / segments
        unit = np.stack([np.sin(polar) * np.cos(turn), np.sin(polar) * np.sin(turn), np.cos(polar)], axis=-1)
        unit[:, -1] = unit[:, 0]  # to the last bit, or rays would pass through the seam
        unit[0], unit[-1] = (0, 0, 1), (0, 0, -1)
        at = np.arange((rings + 1) * (segments + 1)).reshape(rings + 1, -1)
        a, b, c, d = at[:-1, :-1].ravel(), at[1:, :-1].ravel(), at[1:, 1:].ravel(), at[:-1, 1:].ravel()
        triangles = np.concatenate([np.stack([a, b, c], 1)[:-segments], np.stack([a, c, d], 1)[segments:]])
        uv = np.stack([column / segments, 1 - row / rings], axis=-1).reshape(-1, 2)
        normals = unit.reshape(-1, 3)
        return Mesh(
            name,
            (np.asarray(centre) + radius * normals).astype(np.float32),
            triangles.astype(np.int32),
            uv[triangles].astype(np.float32),
            normals[triangles].astype(np.float32) if smooth else None,
        )

    @staticmethod
    def matrix(offset: ArrayLike = (0, 0, 0), scale: ArrayLike = 1.0, turned: bool = False) -> NDArray[np.float64]:
        """Scale, then turn about a skew axis, then move."""
        matrix = np.eye(4)
        matrix[:3, :3] = (_skew_rotation() if turned else np.eye(3)) * np.asarray(scale, dtype=np.float64)
        matrix[:3, 3] = offset
        return matrix

    @staticmethod
    def instance(mesh: Mesh, matrix: NDArray[np.float64] | None = None, name: str | None = None) -> Instance:
        """The mesh under a matrix, by default where it is; named like the mesh."""
        return Instance(name or mesh.name, mesh, np.eye(4) if matrix is None else matrix)

    @staticmethod
    def scene(
        target: Mesh, *others: Mesh, matrix: NDArray[np.float64] | None = None, camera: Camera | None = None
    ) -> Scene:
        """One target among others, itself an occluder, all under the same matrix."""
        instances = [Shapes.instance(mesh, matrix) for mesh in (target, *others)]
        return Scene(instances[:1], instances, camera)


def _skew_rotation() -> NDArray[np.float64]:
    x, y, z = np.array([0.36, -0.48, 0.8])
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    turn: NDArray[np.float64] = np.eye(3) + np.sin(1.1) * cross + (1 - np.cos(1.1)) * cross @ cross
    return turn


@pytest.fixture(scope="session")
def shapes() -> type[Shapes]:
    return Shapes


@pytest.fixture(scope="session")
def bake_one() -> Callable[..., Baked]:
    """Bake a scene of one target without margins; keywords are those of Settings, size stands for both sides."""

    def bake_it(scene: Scene, *, size: int = 16, **settings: Any) -> Baked:
        sides = {"width": size, "height": size, "margin": 0}
        (baked,) = bake(scene, flat_settings(**{**sides, **settings}))
        return baked

    return bake_it


@pytest.fixture(scope="session")
def means_of(bake_one: Callable[..., Baked]) -> Callable[..., dict[str, list[float]]]:
    """The mean of each map, by every seed."""

    def means(scene: Scene, **settings: Any) -> dict[str, list[float]]:
        bakes = [bake_one(scene, seed=seed, **settings) for seed in range(SEEDS)]
        return {name: [baked.maps[name].mean for baked in bakes] for name in bakes[0].maps}

    return means


@pytest.fixture(scope="session")
def assert_mean() -> Callable[..., None]:
    """Student's t-test of one number a seed against an exact answer.

    slack: what tessellation or truncation may add. The mean must also be so certain that the test means something.
    """

    def assert_mean_is(samples: Sequence[float], exact: float, *, slack: float = 0.0) -> None:
        assert len(samples) >= SEEDS
        mean, spread = np.mean(samples), np.std(samples, ddof=1) / np.sqrt(len(samples))
        assert spread < 1e-3, f"too few rays to tell: {mean:.5f} ± {spread:.5f}"
        bound = T_BOUND * spread + slack + 1e-6  # the last for rounding, where every seed agrees
        assert abs(mean - exact) <= bound, f"{mean:.6f} ± {spread:.6f}, exactly {exact:.6f}"

    return assert_mean_is

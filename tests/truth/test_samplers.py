"""Which way the rays of a bake go, by every sampler, against its density: seen from outside, through the pipeline.

The receiver stands in the middle of a sphere that is cut into cells about the lobe's axis. With one ray a texel a bake
tells whether that ray met an open cell. As many bakes as a cell's number has bits, each with the cells open whose
number has that bit, tell the cell of every ray: the same seed sends the same rays.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from math import cos, radians, sin

import numpy as np
import pytest
from occlusion_bake.core.rays.map_spec import AO, MapSpec, reflection, sampled
from occlusion_bake.core.scene.scene import Camera, Instance, Mesh
from occlusion_bake.tests.oracles.point import Point
from occlusion_bake.tests.oracles.reference_lobes import lobe_beyond, sphere_beyond
from occlusion_bake.tests.oracles.shapes import patch

RINGS, SECTORS, SEGMENTS = 5, 6, 24  # segments of a sector: a ring's rim is a polygon, off its circle by 1e-4 of a cell
TEXELS = 256
SIDE = 1e-6  # of the receiver, in a sphere of radius 1: every texel sees the same
GROUPS = 16  # of rows of tiles: texels of a tile complete one another's rays, tiles are scrambled apart
T_BOUND = 6.5  # Student's t with 15 degrees of freedom: exceeded with p = 1e-5

Beyond = Callable[[np.ndarray], np.ndarray]


@dataclass(frozen=True)
class Case:
    """beyond: the share of rays farther from the axis than an angle. rims: the rings' borders. lean: of R, degrees."""

    name: str
    estimator: MapSpec
    beyond: Beyond
    rims: np.ndarray
    lean: float = 0.0


def even(exponent: float, most: float = 0.98) -> np.ndarray:
    """Borders between which a lobe has even shares, up to `most` of it: the horizon takes what is beyond."""
    share = np.linspace(0.0, most, RINGS + 1)
    rims: np.ndarray = np.arccos((1.0 - share) ** (1.0 / (exponent + 1.0)))
    return rims


def by_lobe(exponent: float) -> Beyond:
    return lambda polar: lobe_beyond(polar, exponent)


CASES = [
    *(Case(f"lobe {e:g}", AO if e == 1 else reflection(e), by_lobe(e), even(e)) for e in (0, 1, 10, 100, 1e4)),
    Case("uniform hemisphere", sampled(reflection(0), "uniform_hemisphere"), by_lobe(0), even(0)),
    Case("uniform sphere", sampled(reflection(0), "uniform_sphere"), sphere_beyond, even(0)),
    *(
        Case(f"lobe {e:g} about R", reflection(e, from_camera=True), by_lobe(e), even(e, most), lean)
        for e, most, lean in ((0, 0.5, 25.0), (10, 0.98, 40.0), (100, 0.98, 60.0), (1e4, 0.98, 80.0))
    ),
    Case(
        "uniform sphere about R",
        sampled(reflection(0, from_camera=True), "uniform_sphere"),
        sphere_beyond,
        even(0, 0.5),
        25.0,
    ),
]


def cut_sphere(case: Case, is_open: np.ndarray) -> Mesh:
    """The sphere about the axis without its open cells: (RINGS, SECTORS) bool."""
    rims = np.append(case.rims, np.linspace(case.rims[-1], np.pi, 9)[1:])
    polar, turn = np.meshgrid(
        rims, 2.0 * np.pi * np.arange(SECTORS * SEGMENTS, dtype=np.int64) / (SECTORS * SEGMENTS), indexing="ij"
    )
    lean = radians(case.lean)
    x, y, z = np.sin(polar) * np.cos(turn), np.sin(polar) * np.sin(turn), np.cos(polar)
    points = np.stack([x * cos(lean) + z * sin(lean), y, z * cos(lean) - x * sin(lean)], axis=-1)
    number = np.arange(polar.size, dtype=np.int64).reshape(polar.shape)
    a, b = number[:-1], number[1:]
    quads = np.stack([a, b, np.roll(b, -1, 1), np.roll(a, -1, 1)], axis=-1)
    shut = np.ones(quads.shape[:2], dtype=bool)
    shut[:RINGS] = ~np.repeat(is_open, SEGMENTS, axis=1)
    corners = quads[shut]
    triangles = np.concatenate([corners[:, [0, 1, 2]], corners[:, [0, 2, 3]]])
    return Mesh("sphere", points.reshape(-1, 3).astype(np.float32), triangles.astype(np.int32))


def cells_of_rays(case: Case) -> np.ndarray:
    """(TEXELS, TEXELS) the number of the cell that each ray took, from 1; 0 for a ray that met the sphere in all."""
    number = 1 + np.arange(RINGS * SECTORS, dtype=np.int64).reshape(RINGS, SECTORS)
    lean = radians(case.lean)
    camera = Camera((0.0, 0.0, 0.0), (sin(lean), 0.0, -cos(lean)), orthographic=True)
    receiver = Instance("patch", patch(SIDE), np.eye(4))
    cells = np.zeros((TEXELS, TEXELS), dtype=np.int64)
    for bit in range(int(number.max()).bit_length()):
        sphere = Instance("sphere", cut_sphere(case, (number >> bit) & 1 == 1), np.eye(4))
        point = Point(receiver, [sphere], camera=camera, texels=TEXELS)
        cells |= (point.values([case.estimator], 1)[0] > 0.0).astype(np.int64) << bit
    return cells


def off_by(case: Case) -> np.ndarray:
    """(cells,) Student's t of the rays in each cell, and outside all: the mean of the groups against the density's.

    One ray is granted to rounding, where all groups agree.
    """
    share = np.repeat(-np.diff(case.beyond(case.rims)) / SECTORS, SECTORS)
    share = np.append(1.0 - share.sum(), share)
    groups = cells_of_rays(case).reshape(GROUPS, -1)
    counted = np.array([np.bincount(group, minlength=len(share)) for group in groups])
    assert counted.shape == (GROUPS, len(share)), "a ray took two cells at once"
    error = counted.std(axis=0, ddof=1) / np.sqrt(GROUPS)
    off: np.ndarray = (counted.mean(axis=0) - groups.shape[1] * share) / (error + 1.0 / T_BOUND)
    return off


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_rays_go_by_their_density(case: Case) -> None:
    assert np.abs(off_by(case)).max() < T_BOUND


def test_another_density_would_be_noticed() -> None:
    """The check of the check: a lobe of exponent 10 is not one of 10.5."""
    case = next(case for case in CASES if case.name == "lobe 10")
    assert np.abs(off_by(replace(case, beyond=by_lobe(10.5)))).max() > T_BOUND

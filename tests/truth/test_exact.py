"""A few of the exact answers, each kind of case and of frame among them; `make accuracy` has them all."""

from __future__ import annotations

from dataclasses import replace
from math import radians

import numpy as np
import pytest
from occlusion_bake.core.scene.scene import Mesh
from occlusion_bake.tests.oracles import formulas, whole_bakes
from occlusion_bake.tests.oracles.exact_cases import FRAMES, Frame, cases
from occlusion_bake.tests.oracles.exact_readings import CONVERGED, T_BOUND, chosen_answers, read

pytestmark = pytest.mark.usefixtures("unmeasured")
PATCH = {"texels": 56, "rays": 64}  # as near as fewer texels of more rays, whose tables are larger
EVERY = cases()
CASES = {case.name: case for case in EVERY}
FRAME = {frame.name: frame for frame in FRAMES}
TURNED = Frame("turned", turned=True)
FAR = Frame("far, large, turned", scale=1e4, offset=1e6, turned=True)

# One or two frames a case; over all of them every frame comes up.
CHOSEN = [
    ("perpendicular rectangle", "as it is"),
    ("perpendicular rectangle", "needles, turned"),
    ("parallel rectangle", "needles"),
    ("ceiling, rays limited", "scale 1e-2, offset 1e3, turned"),
    ("sphere aside", "mesh scale 1e-4"),
    ("sphere cut by the horizon", "offset 1e6, turned"),
    ("offset disk", "mesh offset 64"),
    ("floor of a round hole", "scale 1e4, offset 1e6, turned"),
    ("bowl, point at 120°", "scale 1e-4"),
    ("trench", "mesh scale 1e4, turned"),
    ("trench, naive samplers", "as it is"),
    ("octant corner, R along (0.58, 0.58, 0.58)", "scale 1e2, offset 1e5"),
    ("octant corner", "mesh scale 1e4, turned"),
    ("open plane, R at 85°", "junk, turned"),
    ("long wall, R at -60°", "junk, turned"),
    ("trench, R at 60°", "scale 1e4, offset 1e6, turned"),
    ("cap of 25° at 40° from R at 0°", "scale 1e-2, offset 1e3, turned"),
]


def test_every_frame_comes_up() -> None:
    assert {frame for _, frame in CHOSEN} == set(FRAME)


@pytest.mark.parametrize(("name", "frame"), CHOSEN)
def test_the_answer_is_exact(name: str, frame: str) -> None:
    answers = chosen_answers(CASES[name], 1 + CHOSEN.index((name, frame)))
    for reading in read(CASES[name], FRAME[frame], answers, **PATCH):
        assert reading.error < 2.5e-4, "too few rays to tell"
        assert reading.holds, f"{reading.mean:.6f} ± {reading.error:.6f}, exactly {reading.answer.exact:.6f}"


def test_the_noise_of_many_rays_leaves_no_bias() -> None:
    (reading,) = read(CASES["sphere overhead"], FRAMES[0], CASES["sphere overhead"].answers, texels=32, rays=256)
    assert T_BOUND * reading.error < CONVERGED
    assert abs(reading.bias) < CONVERGED


def test_a_wrong_answer_is_noticed() -> None:
    case = CASES["perpendicular rectangle"]
    (answer,) = case.answers
    (reading,) = read(case, FRAMES[0], [replace(answer, exact=answer.exact + 1e-3)], **PATCH)
    assert not reading.holds


def test_the_cases_cover_the_table() -> None:
    assert len(CASES) == len(EVERY)  # no two of a name
    assert all(0.0 <= answer.exact <= 1.0 for case in EVERY for answer in case.answers)
    exponents = {answer.estimator.exponent for case in EVERY if case.toward for answer in case.answers}
    assert exponents >= {1.0, 2.5, 7.0, 10.0, 64.0, 100.0, 1000.0}
    assert all(case.slack <= 2e-5 for case in EVERY)


@pytest.mark.parametrize(
    "frame", [FRAMES[0], TURNED, FAR, Frame("in the mesh", mesh_offset=64.0, turned=True)], ids=str
)
@pytest.mark.parametrize(
    "mesh",
    [
        whole_bakes.room(),
        whole_bakes.room(whole_bakes.SPLIT),
        whole_bakes.globe(),
        whole_bakes.wedge(radians(20)),
        whole_bakes.wedge(radians(60)),
    ],
    ids=["box", "box of needles", "sphere", "wedge of 20", "wedge of 60"],
)
def test_nothing_leaves_a_closed_mesh(mesh: Mesh, frame: Frame) -> None:
    assert whole_bakes.astray(mesh, frame, 0.0, size=64, rays=128)[0] == 0


@pytest.mark.parametrize("frame", [FRAMES[0], TURNED, FAR], ids=lambda frame: frame.name)
@pytest.mark.parametrize("lines", [(-1.0, 1.0), whole_bakes.SPLIT], ids=["whole", "needles"])
def test_a_plane_sees_all_its_sky(lines: tuple[float, ...], frame: Frame) -> None:
    assert whole_bakes.astray(whole_bakes.plane(lines), frame, 1.0)[0] == 0


def test_a_hole_is_noticed() -> None:
    room = whole_bakes.room()
    assert room.uv is not None
    open_room = replace(room, triangles=room.triangles[1:], uv=room.uv[1:])
    off, _ = whole_bakes.astray(open_room, FRAMES[0], 0.0)
    assert off > 1000


@pytest.mark.parametrize(
    "frame", [FRAMES[0], Frame("far, small, turned", scale=1e-2, offset=1e5, turned=True)], ids=str
)
def test_a_bowl_has_no_seams(frame: Frame) -> None:
    found = whole_bakes.bowl_texels(frame, 16, 128, range(16), segments=128)
    assert found["exact"] == formulas.bowl(whole_bakes.OPENING)
    assert abs(found["mean"] - found["exact"]) <= T_BOUND * found["error"] + found["slack"]
    assert found["farthest_t"] <= found["t_bound"]
    assert np.isfinite(found["texel_error"]) and found["texel_error"] > 0

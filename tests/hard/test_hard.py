"""Every hard case of tests/oracles/hard comes out as is right; and the judgement itself sees what is wrong."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from occlusion_bake.core.scene.scene import Scene
from occlusion_bake.tests.oracles.hard.case import Case, judge, speckles
from occlusion_bake.tests.oracles.hard.catalogue import CASES

pytestmark = pytest.mark.usefixtures("unmeasured")
BY_NAME = {case.name: case for case in CASES}


@pytest.mark.parametrize("case", CASES, ids=[case.name.replace(" ", "-") for case in CASES])
def test_case(case: Case) -> None:
    assert judge(case).complaints == []


def without(name: str) -> Scene:
    """A case's scene without its occluders but for the target."""
    scene = BY_NAME[name].build()
    return Scene(scene.targets, scene.targets)


@pytest.mark.parametrize("name", ["slivers", "box standing on a slab", "duplicate triangles", "huge next to tiny"])
def test_a_scene_that_is_not_the_cases_is_told(name: str) -> None:
    assert judge(replace(BY_NAME[name], build=lambda: without(name))).complaints


def test_a_box_with_a_hole_leaks() -> None:
    case = BY_NAME["edges of a closed room"]
    scene = case.build()
    open_room = replace(case, build=lambda: Scene(scene.targets, scene.targets))
    assert any("leak" in line for line in judge(open_room).complaints)


def test_a_seam_is_seen() -> None:
    """Charts a fifth darker than their neighbours."""
    case = BY_NAME["UV seams in a bowl"]
    assert case.extra is not None
    judged = judge(case)
    half = judged.ours.shape[1] // 2
    for baked in judged.baked:
        baked.maps["ao"].values[:, :half] *= 0.8
    assert case.extra(judged)


def test_speckles() -> None:
    values = np.full((8, 8), 0.9)
    covered = np.ones((8, 8), dtype=bool)
    assert not speckles(values, covered, 256).any()
    values[3, 4] = 0.2
    assert np.argwhere(speckles(values, covered, 256)).tolist() == [[3, 4]]
    values[3, 5] = 0.2  # two beside each other are a shape
    assert not speckles(values, covered, 256).any()

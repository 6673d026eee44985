"""Several objects in one image: each texel is its object's own, and the error is that over all of them."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_array_equal
from occlusion_bake.core.bake import Baked, bake
from occlusion_bake.core.finish.atlas import Atlas
from occlusion_bake.core.finish.baked import SurfaceReport
from occlusion_bake.core.finish.map_finisher import MapFinisher
from occlusion_bake.core.maps.directional_code import DirectionalMap
from occlusion_bake.core.maps.occlusion import OcclusionMap
from occlusion_bake.core.rays.map_spec import reflection
from occlusion_bake.core.scene.scene import Camera, Scene
from occlusion_bake.core.solve.directional import DirectionalSettings
from occlusion_bake.core.solve.probes import Error
from occlusion_bake.core.spherical.directional_format import DirectionalFormat
from occlusion_bake.tests.oracles import shapes
from occlusion_bake.tests.oracles.settings import flat_settings

SETTINGS = flat_settings(width=64, height=64, rays=16, margin=3)


def in_one(name: str, parts: list[Baked], margin: int) -> Baked:
    atlas = Atlas(name)
    for part in parts:
        atlas.add(part)
    return atlas.finish(margin)


def halves(gap: float = 0.1) -> list[Any]:
    """Two squares, one over the other, in the left and right part of the image."""
    cells = ((0.05, 0.05, 0.5 - gap, 0.95), (0.5 + gap, 0.05, 0.95, 0.95))
    return [
        shapes.instance(shapes.quad((-1, -1, z), (2, 0, 0), (0, 2, 0), cell, name=f"at {z}"))
        for z, cell in zip((0.0, 1.0), cells, strict=True)
    ]


def test_each_texel_is_its_objects() -> None:
    lower, upper = halves()
    scene = Scene([lower, upper], [lower, upper])
    parts = list(bake(scene, SETTINGS))
    one = in_one("both", parts, 3)
    ao, (left, right) = one.maps["ao"], (part.maps["ao"] for part in parts)
    assert_array_equal(ao.covered, left.covered | right.covered)
    for part in (left, right):
        assert_array_equal(ao.values[part.covered], part.values[part.covered])
    assert right.mean == 1.0 > left.mean > 0.0
    assert (one.texels, one.rays) == (parts[0].texels + parts[1].texels, left.rays + right.rays)
    assert one.surface.overlapped == 0
    assert ao.mean == pytest.approx((parts[0].texels * left.mean + parts[1].texels * right.mean) / one.texels, rel=1e-6)
    assert ao.error == pytest.approx(left.error * np.sqrt(parts[0].texels / one.texels), rel=1e-6)  # the other has none
    assert ao.p99 == left.p99
    assert one.warnings == [] and one.name == "both"


def test_the_margin_is_of_the_whole() -> None:
    """Between two charts it grows from both, and of neither alone."""
    parts = list(bake(Scene(halves(), halves()), SETTINGS))
    ao = in_one("both", parts, 3).maps["ao"]
    column = np.flatnonzero(parts[1].maps["ao"].covered[32])[0]
    assert_array_equal(ao.values[32, column - 3 : column], 1.0)
    assert ao.values[32, column - 4] == pytest.approx(ao.mean, rel=1e-5)


def test_bytes_of_masks_have_no_margin() -> None:
    lower, upper = (replace(each, mesh=shapes.with_tangents(each.mesh)) for each in halves())
    settings = replace(SETTINGS, maps=(DirectionalMap(DirectionalSettings(DirectionalFormat("mask", 8))),))
    parts = list(bake(Scene([lower, upper], [lower, upper]), settings))
    mask = in_one("both", parts, 3).maps["mask_8"]
    assert np.all(mask.values[~mask.covered] == 0.0)
    for part in parts:
        made = part.maps["mask_8"]
        assert_array_equal(mask.values[made.covered], made.values[made.covered])


def test_objects_that_overlap_are_told() -> None:
    lower, upper = halves()
    upper = replace(upper, mesh=replace(upper.mesh, uv=lower.mesh.uv))
    one = in_one("both", list(bake(Scene([lower, upper], [lower, upper]), SETTINGS)), 3)
    assert one.surface.overlapped == one.texels
    assert one.warnings[-1].startswith(f"both: objects overlap one another in the UV map on {one.texels} of")
    assert one.maps["ao"].mean == 1.0  # the last shows


def test_texels_that_face_away_from_the_camera_are_not_taken_for_shared() -> None:
    lower, upper = halves()
    from_below = Camera((0.0, 0.0, -5.0), (0.0, 0.0, 1.0))
    settings = replace(SETTINGS, maps=(OcclusionMap(reflection(10.0, from_camera=True)),))
    one = in_one("both", list(bake(Scene([lower, upper], [lower, upper], from_below), settings)), 3)
    assert one.surface.overlapped == 0 and one.warnings == []


def test_a_map_of_nothing_is_open_alone_and_in_an_atlas() -> None:
    """As one of reflections is that the camera sees nothing of: its mean is that of its image."""
    nothing = np.zeros((4, 4), dtype=bool)
    any_frames: Any = None
    finisher = MapFinisher(any_frames, any_frames, np.zeros((4, 4), np.float32), 2, None, None)
    alone = finisher.finished(OcclusionMap(), np.zeros((4, 4), np.float32), nothing, Error(0.0, 0.0, 0.0), 0)
    assert alone.mean == alone.values.mean() == 1.0
    assert in_one("All", [Baked("One", (4, 4), SurfaceReport(), 0, {"ao": alone})], 2).maps["ao"].mean == 1.0

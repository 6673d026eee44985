"""The registry of maps: names, and what of the maps' rays is traced but once."""

from __future__ import annotations

from typing import Any

import pytest
from occlusion_bake.core.maps.registry import MAPS, maps_of
from occlusion_bake.core.rays.accumulators import Accumulator
from occlusion_bake.core.settings import Settings

CHOICES: dict[str, Any] = {
    "sampler": "importance",
    "exponents": [10.0, 100.0],
    "direction": "normal",
    "divide_horizon": False,
    "bent_space": "world",
    "bent_y": "up",
    "bent_alpha": False,
    "use_light_lobe": True,
    "code": "sh_3",
    "code_rays": 256,
}
EVERY = [entry.name for entry in MAPS]


def test_no_two_maps_have_one_name() -> None:
    names = [each.name for each in maps_of(EVERY, CHOICES)]
    assert len(set(EVERY)) == len(EVERY) and len(set(names)) == len(names)


def test_every_map_says_what_it_is() -> None:
    for each in maps_of(EVERY, CHOICES):
        assert each.description()["map"], each.name


def test_bent_normals_and_ao_are_of_the_same_rays() -> None:
    (spec,) = Settings(maps_of(["ao", "bent"], CHOICES)).specs
    assert spec.accumulator is Accumulator.BENT and spec.name == "ao"


def test_light_and_its_share_are_of_the_same_rays() -> None:
    both = Settings(maps_of(["light", "light-share"], CHOICES)).specs
    assert both == Settings(maps_of(["light"], CHOICES)).specs and len(both) == 3


def test_other_samplers_do_not_serve_bent_normals() -> None:
    specs = Settings(maps_of(["ao", "bent"], {**CHOICES, "sampler": "uniform_sphere"})).specs
    assert [each.accumulator for each in specs] == [Accumulator.BENT, Accumulator.VISIBILITY]


@pytest.mark.parametrize("name", EVERY)
def test_a_map_is_of_shared_rays_or_made_otherwise(name: str) -> None:
    for each in maps_of([name], CHOICES):
        base = type(each).__mro__[-3]  # Map, below ABC and object
        assert (each.spec is not None) == (type(each).finish is not base.finish), each.name
        assert (each.spec is None) == (type(each).make is not base.make), each.name

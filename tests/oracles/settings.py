"""Settings by flat names."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import fields, replace
from typing import Any

from occlusion_bake.core.maps.bent_normals import BentNormalMap
from occlusion_bake.core.maps.directional_code import DirectionalMap
from occlusion_bake.core.maps.light import LightShareMap
from occlusion_bake.core.maps.map import Map
from occlusion_bake.core.maps.occlusion import OcclusionMap
from occlusion_bake.core.rays.map_spec import AO, Axis, MapSpec
from occlusion_bake.core.rays.ray_options import RayOptions
from occlusion_bake.core.settings import ImageSettings, Settings
from occlusion_bake.core.solve.directional import DirectionalSettings
from occlusion_bake.core.solve.goal import Goal

_PARTS: dict[str, Any] = {"image": ImageSettings, "goal": Goal, "rays": RayOptions}


def flat_settings(
    maps: Iterable[Map | MapSpec] = (AO,),
    *,
    bent: BentNormalMap | None = None,
    code: DirectionalSettings | None = None,
    divide_horizon: bool = False,
    **flat: Any,
) -> Settings:
    """Each value goes to the part of Settings that has a field of its name.

    maps: also by what they ask of their rays: light is then its share. divide_horizon: of those about R.
    """
    made = [_map_of(each, divide_horizon) for each in maps]
    made += ([bent] if bent is not None else []) + ([DirectionalMap(code)] if code is not None else [])
    parts = {
        name: part(**{each.name: flat.pop(each.name) for each in fields(part) if each.name in flat})
        for name, part in _PARTS.items()
    }
    return Settings(tuple(made), **parts, **flat)


def _map_of(given: Map | MapSpec, divide_horizon: bool) -> Map:
    if isinstance(given, Map):
        return given
    if given.is_light:
        return LightShareMap(given)
    return OcclusionMap(replace(given, divided=divide_horizon and given.axis is Axis.REFLECTED))

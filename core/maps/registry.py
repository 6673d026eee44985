"""All maps that can be baked, and how each comes to be from what was chosen.

To add one: a file beside this one, and an entry here. The command's `--maps` and the panel's switches follow.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from ..rays.map_spec import AO, light, reflection, sampled
from ..solve.directional import DirectionalSettings
from ..spherical.directional_format import named_format
from .bent_normals import BentNormalMap, Space
from .directional_code import DirectionalMap
from .light import LightMap, LightShareMap
from .map import Map
from .occlusion import OcclusionMap

Choices = Mapping[str, Any]  # values of options by name, as the command has them


@dataclass(frozen=True)
class MapEntry:
    """A kind of map. name: what `--maps` calls it. make: the maps of it,
    of all options. switch: the panel's property that asks for it, empty where that is not one alone; label,
    description: of that. listed: whether it is one of `--maps`, and its switch one of the first panel's."""

    name: str
    make: Callable[[Choices], Sequence[Map]]
    switch: str = ""
    label: str = ""
    description: str = ""
    listed: bool = True


def _ambient(choices: Choices) -> list[Map]:
    return [OcclusionMap(sampled(AO, choices["sampler"]))]


def _reflection(choices: Choices) -> list[Map]:
    camera, divided = choices["direction"] == "camera", choices["divide_horizon"]
    lobes = (reflection(each, from_camera=camera, divided=divided) for each in choices["exponents"])
    return [OcclusionMap(sampled(lobe, choices["sampler"])) for lobe in lobes]


def _bent(choices: Choices) -> list[Map]:
    return [BentNormalMap(Space(choices["bent_space"]), choices["bent_y"] == "down", choices["bent_alpha"])]


def _lights(choices: Choices) -> list[Any]:
    """The lobes that light is weighted by."""
    lobes = [light()]
    if choices["use_light_lobe"]:
        camera = choices["direction"] == "camera"
        lobes += [light(each, from_camera=camera) for each in choices["exponents"]]
    return lobes


def _light(choices: Choices) -> list[Map]:
    return [LightMap(lobe) for lobe in _lights(choices)]


def _light_share(choices: Choices) -> list[Map]:
    return [LightShareMap(lobe) for lobe in _lights(choices)]


def _code(choices: Choices) -> list[Map]:
    return [DirectionalMap(DirectionalSettings(named_format(choices["code"]), choices["code_rays"]))]


CODE = "code"  # asked for by an option of its own

MAPS = (
    MapEntry("ao", _ambient, "use_ao", "Ambient Occlusion", "How open points are to diffuse light"),
    MapEntry(
        "ro",
        _reflection,
        "use_ro",
        "Reflection Occlusion",
        "Bake how open each point is to light it would reflect",
    ),
    MapEntry(
        "bent",
        _bent,
        "use_bent",
        "Bent Normals",
        "Bake the mean direction in which each point is open, as a normal map",
    ),
    MapEntry("light", _light),
    MapEntry("light-share", _light_share),
    MapEntry(
        CODE,
        _code,
        "use_code",
        "Directional Code",
        "Bake what reflection occlusion is rebuilt from in any view and for any exponent",
        listed=False,
    ),
)


def maps_of(names: Sequence[str], choices: Choices) -> tuple[Map, ...]:
    """The maps of these kinds, by all options. Raises InputError for a value out of range."""
    made = [each for entry in MAPS if entry.name in names for each in entry.make(choices)]
    # A share stands before the light that it is a share of.
    return tuple(sorted(made, key=lambda each: isinstance(each, LightMap)))

"""One table of options: the command, the panel, what is told and what is handed on agree with one another."""

from __future__ import annotations

import json
from dataclasses import replace
from operator import attrgetter
from types import SimpleNamespace
from typing import Any

import pytest
from occlusion_bake.core.base.errors import InputError
from occlusion_bake.core.maps.registry import MAPS
from occlusion_bake.core.options.option import ANGLE, Choice, Option, Pointer, Real
from occlusion_bake.core.options.table import OPTIONS
from occlusion_bake.core.options.values import (
    settings_of_command,
    settings_of_panel,
    told_by_images,
    told_by_reports,
    values_of,
    with_values,
)
from occlusion_bake.core.rays.ray_options import Falloff, RayOptions
from occlusion_bake.core.settings import ImageSettings, Settings
from occlusion_bake.core.solve.goal import Goal

# What the command has where nothing is given; of those that its parser works out, and that Settings needs.
COMMAND: dict[str, Any] = {
    "maps": ["ao"],
    "size": (1024, 1024),
    "quality": None,
    "error": None,
    "rays": None,
    "use_filter": None,
    "distance": None,
    "falloff": "none",
    "nearest": 0.0,
    "spread": 180.0,
    "use_front_only": False,
    "use_normal_maps": False,
    "bent_space": "tangent",
    "bent_y": "up",
    "bent_alpha": False,
    "code": None,
    "code_rays": 256,
    "exponents": [10.0],
    "direction": "normal",
    "divide_horizon": "keep",
    "sampler": "importance",
    "margin": 16,
    "threads": 0,
    "seed": 0,
}
OTHERS = Settings(
    image=ImageSettings(48, 32, 3),
    goal=Goal(32, 0.01, False),
    rays=RayOptions(2.5, 0.125, Falloff.SMOOTH, 120.0, True),
    normal_maps=True,
    seed=5,
    threads=2,
)


def panel(**changed: Any) -> Any:
    """The panel as it is at first, but for some settings, as Blender has their values."""
    placed = [option for option in OPTIONS if option.place is not None and not isinstance(option.kind, Pointer)]
    return SimpleNamespace(**{option.name: at_first(option) for option in placed} | changed)


def at_first(option: Option) -> Any:
    kind = option.kind
    if isinstance(kind, Choice):
        return (kind.default or kind.items[0].value).upper()
    assert not isinstance(kind, Pointer)
    return kind.default * 3.14159274 / 180.0 if isinstance(kind, Real) and kind.unit == ANGLE else kind.default


def test_no_name_stands_twice() -> None:
    assert len({option.name for option in OPTIONS}) == len(OPTIONS)
    flags = [option.flag.name for option in OPTIONS if option.flag is not None]
    assert len(set(flags)) == len(flags)
    places = [(option.place.panel, option.place.at) for option in OPTIONS if option.place and option.place.panel]
    assert len(set(places)) == len(places)


def test_every_value_has_its_place_in_settings() -> None:
    for option in OPTIONS:
        if option.into:
            attrgetter(option.into)(Settings())


def test_what_is_told_stands_in_settings() -> None:
    assert all(option.into for option in OPTIONS if option.told)


def test_the_panel_and_the_command_begin_alike() -> None:
    of_command, of_panel = settings_of_command(COMMAND), settings_of_panel(panel())
    assert of_command.goal.filtered is None and of_panel.goal.filtered is True  # both with the filter
    assert replace(of_command, goal=of_panel.goal) == of_panel
    assert of_command.goal.filters == of_panel.goal.filters and of_command.goal.error == of_panel.goal.error == 1 / 255


@pytest.mark.parametrize("settings", [Settings(), OTHERS], ids=["at first", "others"])
def test_what_is_handed_on_makes_the_same_settings(settings: Settings) -> None:
    handed_on = json.loads(json.dumps(values_of(settings)))
    assert settings_of_command({**COMMAND, **handed_on}) == settings
    assert (
        with_values(Settings(), {**handed_on, "width": settings.image.width, "height": settings.image.height})
        == settings
    )


def test_the_panel_reaches_every_part_of_settings() -> None:
    chosen = panel(
        width=48,
        height=32,
        margin=3,
        quality="RAYS",
        rays=32,
        use_distance=True,
        distance=2.5,
        nearest=0.125,
        falloff="SMOOTH",
        spread=2.0943951,
        use_front_only=True,
        use_normal_maps=True,
        seed=5,
        threads=2,
    )
    made = settings_of_panel(chosen)
    assert made.rays.spread == pytest.approx(120.0, abs=1e-5)
    rays = replace(made.rays, spread=120.0)
    assert replace(made, rays=rays) == replace(OTHERS, goal=Goal(32, None, False))


def test_a_falloff_without_a_distance_does_not_count_in_the_panel() -> None:
    assert settings_of_panel(panel(falloff="LINEAR")).rays.falloff is Falloff.NONE


@pytest.mark.parametrize(
    "kinds", [["ao"], ["ro", "bent"], ["light", "light-share"], ["ao", "ro", "light", "light-share"]]
)
def test_maps_by_name_are_those_by_switches(kinds: list[str]) -> None:
    switches = {entry.switch: entry.name in kinds for entry in MAPS if entry.switch}
    lights = {"use_light": "light" in kinds, "light_picture": "BOTH", "use_light_lobe": "ro" in kinds}
    of_panel = settings_of_panel(panel(**switches, **lights))
    assert of_panel.maps == settings_of_command({**COMMAND, "maps": kinds}).maps


def test_a_code_is_asked_for_by_an_option_of_its_own() -> None:
    of_panel = settings_of_panel(panel(use_ao=False, use_code=True, code="MASK16", code_rays="1024"))
    of_command = settings_of_command({**COMMAND, "maps": [], "code": "mask_16", "code_rays": 1024})
    assert of_panel.maps == of_command.maps and [each.name for each in of_panel.maps] == ["mask_16"]


def test_exponents_that_are_no_numbers_are_one_line() -> None:
    with pytest.raises(InputError, match=r"Exponents 'ten': give one or more numbers"):
        settings_of_panel(panel(use_ro=True, exponents="ten"))


def test_images_and_reports_tell_the_options() -> None:
    told = told_by_images(OTHERS)
    assert told == {
        "error_wanted": 0.01,
        "filtered": "no",
        "distance": 2.5,
        "minimum_distance": 0.125,
        "falloff": "smooth",
        "spread": 120.0,
        "faces": "front",
        "normal_maps": "yes",
        "seed": 5,
    }
    assert told_by_images(Settings())["distance"] == "none" and told_by_reports(Settings())["distance"] is None
    assert {name: told_by_reports(OTHERS)[name] for name in told if name not in ("filtered",)} == {
        name: value for name, value in told.items() if name != "filtered"
    }
    assert told_by_reports(OTHERS)["filtered"] is False and told_by_reports(OTHERS)["rays_per_texel"] is None

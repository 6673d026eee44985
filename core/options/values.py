"""Values of options, as the command has them: into Settings and back, and as images and reports tell them."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from ..finish.baked import Metadata
from ..maps.registry import CODE, MAPS, maps_of
from ..settings import DEFAULT_QUALITY, QUALITIES, Settings
from .option import Chosen
from .table import OPTIONS

Values = Mapping[str, Any]  # by the options' names


class _Panel(Mapping[str, Any]):
    """The panel's settings, or kept ones, as the command has them; each is read when it is asked for."""

    def __init__(self, chosen: Chosen) -> None:
        self._chosen = chosen
        self._options = {option.name: option for option in OPTIONS}

    def __getitem__(self, name: str) -> Any:
        return self._options[name].read(self._chosen)

    def __iter__(self) -> Any:
        return iter(self._options)

    def __len__(self) -> int:
        return len(self._options)


def settings_of_command(values: Values) -> Settings:
    """Of the command's options. Raises InputError."""
    kinds = [*values["maps"], *([CODE] if values["code"] is not None else [])]
    width, height = values["size"]
    others = {
        "width": width,
        "height": height,
        "error": _wanted_error(values),
        "rays": Settings().goal.rays if values["rays"] is None else values["rays"],
        "exponents": list(dict.fromkeys(values["exponents"])),
        "divide_horizon": values["divide_horizon"] == "divide",
        "use_light_lobe": "ro" in values["maps"],
    }
    return _settings(kinds, {**values, **others})


def settings_of_panel(chosen: Chosen) -> Settings:
    """Of the panel's settings, or kept ones. Raises InputError."""
    kinds = [entry.name for entry in MAPS if entry.switch and getattr(chosen, entry.switch)]
    if chosen.use_light:
        kinds += {"RATIO": ["light-share"], "LIGHT": ["light"], "BOTH": ["light", "light-share"]}[chosen.light_picture]
    return _settings(kinds, _Panel(chosen))


def values_of(settings: Settings) -> dict[str, Any]:
    """The command's options of settings, but for their maps: numbers and words, to be handed on as JSON."""
    return {
        "size": settings.image.size,
        **{option.name: option.from_settings(settings) for option in OPTIONS if option.flag and option.into},
    }


def with_values(settings: Settings, values: Values) -> Settings:
    """The settings with these values of options, where they stand in Settings. Raises InputError."""
    parts: dict[str, dict[str, Any]] = {}
    for option in OPTIONS:
        if option.into and option.name in values:
            part, _, field = option.into.rpartition(".")
            parts.setdefault(part, {})[field] = option.to_settings(values[option.name])
    whole = parts.pop("", {})
    return replace(settings, **whole, **{part: replace(getattr(settings, part), **of) for part, of in parts.items()})


def told_by_images(settings: Settings) -> Metadata:
    """What was asked for, for an image's description."""
    goal = settings.goal
    return {
        "error_wanted": "none" if goal.error is None else goal.error,
        "filtered": "yes" if goal.filters else "no",
        **_told(settings),
        "seed": settings.seed,
    }


def told_by_reports(settings: Settings) -> dict[str, Any]:
    """The same for a report. rays_per_texel and error_wanted: what was asked for; the other one is None."""
    goal = settings.goal
    return {
        "threads": settings.threads or os.cpu_count() or 1,
        "rays_per_texel": goal.rays if goal.error is None else None,
        "error_wanted": goal.error,
        "filtered": goal.filters,
        **_told(settings),
        "distance": settings.rays.distance,
        "ro_horizon": "divide" if any(spec.divided for spec in settings.specs) else "keep",
        "seed": settings.seed,
    }


def _told(settings: Settings) -> Metadata:
    rows = [(option.told, option.from_settings(settings)) for option in OPTIONS if option.told]
    rows.sort(key=lambda row: row[0].at)
    return {told.name: value if told.words is None else told.words(value) for told, value in rows}


def _settings(kinds: Sequence[str], values: Values) -> Settings:
    return with_values(Settings(maps_of(kinds, values)), values)


def _wanted_error(values: Values) -> float | None:
    """The error to bake to. None for rays: where they are given, and for the naive samplers, which are compared so."""
    if values["error"] is not None:
        return float(values["error"])
    if values["quality"] is not None:
        return QUALITIES[values["quality"]]
    return QUALITIES[DEFAULT_QUALITY] if values["rays"] is None and values["sampler"] == "importance" else None

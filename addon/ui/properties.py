"""The properties that an artist sets, kept in the scene: made of the table of options (core/options)."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Any

import bpy

from ...core.options.option import ANGLE, Choice, Kind, Option, Place, Pointer, Switch, Text, Whole, is_value
from ...core.options.table import OPTIONS
from ..typed import props, window_manager_in


def _property(option: Option, place: Place) -> Any:
    """A property of Blender's for an option."""
    made, more = _of_kind(option.kind)
    return made(name=place.label, description=place.description, **more)


def _of_kind(kind: Kind) -> tuple[Any, dict[str, Any]]:
    """The function that makes one, and what it takes beside the words."""
    if isinstance(kind, Switch):
        return props.BoolProperty, {"default": kind.default}
    if isinstance(kind, Text):
        return props.StringProperty, {"default": kind.default}
    if isinstance(kind, Choice):
        items = [(item.value.upper(), item.label, item.description) for item in kind.items]
        return props.EnumProperty, {"items": items, "default": (kind.default or kind.items[0].value).upper()}
    if isinstance(kind, Pointer):
        meshes = {"poll": lambda self, obj: obj.type == "MESH"} if kind.to == "Object" else {}
        return props.PointerProperty, {"type": getattr(bpy.types, kind.to), **meshes}
    scale = math.radians(1.0) if kind.unit == ANGLE else 1
    numbers = {"default": kind.default, "min": kind.low, "max": kind.high, "soft_max": kind.soft_high}
    given = {name: number * scale for name, number in numbers.items() if number is not None}
    return (props.IntProperty if isinstance(kind, Whole) else props.FloatProperty), {**given, "subtype": kind.unit}


def _placed() -> Iterator[tuple[Option, Place]]:
    """The options that the panel has."""
    return ((option, option.place) for option in OPTIONS if option.place is not None)


class OcclusionBakeSettings(bpy.types.PropertyGroup):
    """Settings of the bake."""

    __annotations__ = {option.name: _property(option, place) for option, place in _placed()}


def _show_or_hide(_: Any, context: bpy.types.Context) -> None:
    redraw(context, "VIEW_3D", every_region=True)


class OcclusionBakeResult(bpy.types.PropertyGroup):
    """What the last bake or comparison came to, for the panel."""

    __annotations__ = {
        "lines": props.StringProperty(options={"SKIP_SAVE"}),  # parted by line breaks
        "show": props.BoolProperty(
            name="Show in Viewport",
            description=(
                "Show the baked textures on their objects in the 3D view, in Object Mode; no material is touched"
            ),
            default=True,
            update=_show_or_hide,
        ),
        "overlapping": props.BoolProperty(options={"SKIP_SAVE"}),  # whether UVs overlap of what was baked
        "asked": props.StringProperty(options={"SKIP_SAVE"}),  # session_uids of whom the next press lets Blender unwrap
    }


def settings_in(context: bpy.types.Context) -> Any:
    """The scene's: OcclusionBakeSettings."""
    scene: Any = context.scene
    return scene.occlusion_bake


def result_in(context: bpy.types.Context) -> Any:
    """The last one: OcclusionBakeResult."""
    window_manager: Any = context.window_manager
    return window_manager.occlusion_bake


def show_lines(context: bpy.types.Context, lines: list[str]) -> None:
    """Put lines into the panel, in the place of earlier ones."""
    result = result_in(context)
    result.lines = "\n".join(lines)
    if not lines:
        result.overlapping = False


def add_lines(context: bpy.types.Context, lines: list[str]) -> None:
    """Add lines to the panel's."""
    shown = result_in(context).lines
    show_lines(context, [*filter(None, shown.split("\n")), *lines])


def redraw(context: bpy.types.Context, *area_types: str, every_region: bool = False) -> None:
    """Let areas show what is new; of 3D views the sidebars alone, for their scene can take long to draw."""
    for window in window_manager_in(context).windows:
        for area in window.screen.areas:
            for region in area.regions if area.type in area_types else ():
                if every_region or area.type != "VIEW_3D" or region.type == "UI":
                    region.tag_redraw()


def plain_settings(chosen: Any) -> dict[str, Any]:
    """All but the pointers, as plain values: to be kept, and to be baked by again."""
    return {name: getattr(chosen, name) for name in plain_names()}


def are_settings(values: Mapping[str, Any]) -> bool:
    """Whether these are all the plain settings, each of its kind, as they stand in files that others may have made."""
    return all(is_value(option.kind, values.get(option.name)) for option in _plain())


def plain_names() -> list[str]:
    """Of the settings that are no pointers."""
    return [option.name for option in _plain()]


def _plain() -> Iterator[Option]:
    return (option for option, _ in _placed() if not isinstance(option.kind, Pointer))


def draw_options(layout: bpy.types.UILayout, chosen: Any, panel: str) -> None:
    """The options that stand in a panel, each in its place; what does not count is greyed out."""
    rows = sorted(((option, place) for option, place in _placed() if place.panel == panel), key=lambda row: row[1].at)
    for option, place in rows:
        if place.shown is not None and not place.shown(chosen):
            continue
        row = layout
        if place.active is not None:
            row = layout.row()
            row.active = place.active(chosen)
        words: dict[str, Any] = {} if place.text is None else {"text": place.text}
        row.prop(chosen, option.name, expand=place.expand, **words)


CLASSES = (OcclusionBakeSettings, OcclusionBakeResult)
_HUNG_ON: dict[Any, Any] = {bpy.types.Scene: OcclusionBakeSettings, bpy.types.WindowManager: OcclusionBakeResult}


def add_properties() -> None:
    """Hang the settings on scenes, the result on the window manager: it lives as long as Blender runs."""
    for owner, group in _HUNG_ON.items():
        owner.occlusion_bake = props.PointerProperty(type=group)


def remove_properties() -> None:
    """And take them away."""
    for owner in _HUNG_ON:
        del owner.occlusion_bake

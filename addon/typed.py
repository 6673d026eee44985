"""Blender's types where its stubs (fake-bpy-module) know less than we do: for the type checker alone, all of it.

What the stubs take to be missing at times is there wherever it is asked for here; nothing is checked.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Literal, TypeVar, cast

import bpy

_Member = TypeVar("_Member")

props: Any = bpy.props  # whose functions give what registers a property, and nothing in the stubs

# The stubs know what all nodes, sockets and trees have, and not what one of a type has.
Node = Any
Socket = Any
Tree = Any

Ended = set[Literal["RUNNING_MODAL", "CANCELLED", "FINISHED", "PASS_THROUGH", "INTERFACE"]]  # how an operator did

# What this decorator gives they do not know.
persistent: Callable[[Callable[..., None]], Callable[..., None]] = bpy.app.handlers.persistent

# For what is mixed into operators and panels, and is none itself.
if TYPE_CHECKING:
    OperatorMixin = bpy.types.Operator
    PanelMixin = bpy.types.Panel
else:
    OperatorMixin = PanelMixin = object


def scene_in(context: bpy.types.Context) -> bpy.types.Scene:
    return cast("bpy.types.Scene", context.scene)


def view_layer_in(context: bpy.types.Context) -> bpy.types.ViewLayer:
    return cast("bpy.types.ViewLayer", context.view_layer)


def window_manager_in(context: bpy.types.Context) -> bpy.types.WindowManager:
    return cast("bpy.types.WindowManager", context.window_manager)


def layout_of(drawn: bpy.types.Panel | bpy.types.Menu) -> bpy.types.UILayout:
    return cast("bpy.types.UILayout", drawn.layout)


def mesh_of(obj: bpy.types.Object) -> bpy.types.Mesh:
    """Of an object whose type is MESH."""
    return cast("bpy.types.Mesh", obj.data)


def library_of(block: bpy.types.ID) -> bpy.types.Library | None:
    """Where it is linked from; None for what is the file's own."""
    return block.library


def uid_of(block: bpy.types.ID) -> int:
    """The session_uid of what is in the file, for what is evaluated, and has none itself, too."""
    return cast("bpy.types.ID", block.original).session_uid


def found_in(collection: bpy.types.bpy_prop_collection[_Member], name: str) -> _Member | None:
    """The member of this name, if there is one."""
    return cast("_Member | None", collection.get(name))


def pixels_in(image: bpy.types.Image) -> Any:
    """All of them, to be copied out or in; the stubs take them for one number."""
    return image.pixels


def space_of(image: bpy.types.Image) -> Any:
    """The colour space of its pixels; the stubs know no name of any."""
    return image.colorspace_settings

"""Everything that touches Blender: what is read from it, what is shown in it, what is written to it."""

from __future__ import annotations

from typing import Any

_commands: list[Any] = []


def register() -> None:
    """Add properties, operators, panels and the command."""
    import bpy

    from . import command, operators, panel, settings

    for each in (*settings.CLASSES, *operators.CLASSES, *panel.CLASSES):
        bpy.utils.register_class(each)
    settings.add_properties()
    _commands.append(bpy.utils.register_cli_command(command.NAME, command.blender_command))


def unregister() -> None:
    """Stop what is running and take everything away again."""
    import bpy

    from . import modal, operators, panel, settings

    modal.stop_all()
    while _commands:
        bpy.utils.unregister_cli_command(_commands.pop())
    settings.remove_properties()
    for each in reversed((*settings.CLASSES, *operators.CLASSES, *panel.CLASSES)):
        bpy.utils.unregister_class(each)

"""Everything that touches Blender: what is read from it, what is shown in it, what is written to it."""

from __future__ import annotations

from typing import Any

_commands: list[Any] = []


def register() -> None:
    """Add properties, operators, panels and the command."""
    import bpy

    from . import command, menu, settings

    for each in _classes():
        bpy.utils.register_class(each)
    settings.add_properties()
    menu.add_to_menus()
    _commands.append(bpy.utils.register_cli_command(command.NAME, command.blender_command))


def unregister() -> None:
    """Stop what is running and take everything away again."""
    import bpy

    from . import menu, modal, overlay, settings

    modal.stop_all()
    overlay.clear()
    while _commands:
        bpy.utils.unregister_cli_command(_commands.pop())
    menu.remove_from_menus()
    settings.remove_properties()
    for each in reversed(_classes()):
        bpy.utils.unregister_class(each)


def _classes() -> list[Any]:
    from . import engine, menu, operators, panel, presets, settings

    return [each for module in (settings, operators, engine, presets, panel, menu) for each in module.CLASSES]

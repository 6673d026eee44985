"""Everything that touches Blender: what is read from it, what is shown in it, what is written to it."""

from __future__ import annotations

from typing import Any

_commands: list[Any] = []


def register() -> None:
    """Add properties, operators, panels and the command."""
    import bpy

    from .cli import command, terminal
    from .ui import menu, properties, request_renewal

    for each in _classes():
        bpy.utils.register_class(each)
    properties.add_properties()
    menu.add_to_menus()
    request_renewal.start()
    register_command: Any = bpy.utils.register_cli_command  # which answers nothing in the stubs
    _commands.append(register_command(terminal.NAME, command.blender_command))


def unregister() -> None:
    """Stop what is running and take everything away again."""
    import bpy

    from .ui import menu, modal_operator, properties, request_renewal, viewport_overlay

    modal_operator.stop_all()
    viewport_overlay.clear()
    while _commands:
        bpy.utils.unregister_cli_command(_commands.pop())
    request_renewal.stop()
    menu.remove_from_menus()
    properties.remove_properties()
    for each in reversed(_classes()):
        bpy.utils.unregister_class(each)


def _classes() -> list[Any]:
    from .ui import engine_operator, menu, operators, panel, presets, properties

    return [
        each for module in (properties, operators, engine_operator, presets, panel, menu) for each in module.CLASSES
    ]

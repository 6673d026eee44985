"""What the artist reads, in the language of Blender's interface where there is a translation."""

from __future__ import annotations

from typing import Any

from bpy.app.translations import pgettext_rpt


def say(template: str, *values: object) -> str:
    """The template, translated as Blender's messages are, with the values in it: as `str.format` has it."""
    translated: Any = pgettext_rpt  # which answers nothing in the stubs
    return str(translated(template)).format(*values)

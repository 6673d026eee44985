"""What the artist reads, in the language of Blender's interface where there is a translation."""

from __future__ import annotations

from bpy.app.translations import pgettext_rpt


def say(template: str, *values: object) -> str:
    """The template, translated as Blender's messages are, with the values in it: as `str.format` has it."""
    return str(pgettext_rpt(template)).format(*values)

"""write_settings.py [FILE]: docs/settings.md, made of the one table of options (core/options/table.py)."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path

from occlusion_bake.core.options.option import Choice, Flag, Option, Pointer, Real, Switch, Text, Whole
from occlusion_bake.core.options.table import OPTIONS

PAGE = Path(__file__).resolve().parent.parent / "docs" / "settings.md"
# The panels in their order, by what the table calls them; those of the first are drawn by its own code.
PANELS = {
    "": "Occlusion Bake",
    "reflection": "Reflection",
    "bent": "Bent Normals",
    "code": "Directional Code",
    "light": "World Light",
    "occluders": "Occluders",
    "highs": "High to Low",
    "output": "Output",
    "material": "Material",
    "options": "Options",
    "options_end": "Options",
    "cycles": "Compare with Cycles",
}
HEAD = """# Settings and options

Made of the one table that the panel and the command are made of: `python tools/write_settings.py`. What they mean, with
pictures, exact cases and what they cost: [options](options.md). How they are used: [the guide](guide.md) for artists,
[the command](command.md) for pipelines.
"""


def page() -> str:
    """The whole page."""
    return "\n".join([HEAD, *_panel(), "", *_command(), ""])


def _panel() -> Iterator[str]:
    yield from ("## In the panel", "", "| panel | setting | what it does | at first |", "|---|---|---|---|")
    for key, name in PANELS.items():
        rows = [option for option in OPTIONS if option.place is not None and option.place.panel == key]
        for option in sorted(rows, key=lambda row: row.place.at if row.place is not None else 0):
            assert option.place is not None
            label = option.place.text or option.place.label
            yield f"| {name} | {label} | {option.place.description}{_items(option)} | {_default(option)} |"


def _items(option: Option) -> str:
    """What the items of a choice mean."""
    if not isinstance(option.kind, Choice):
        return ""
    return ". " + "; ".join(
        f"*{item.label}*: {item.description}" if item.description != item.label else f"*{item.label}*"
        for item in option.kind.items
    )


def _default(option: Option) -> str:
    kind = option.kind
    if isinstance(kind, Switch):
        return "on" if kind.default else "off"
    if isinstance(kind, Choice):
        return next(item.label for item in kind.items if kind.default in (None, item.value))
    if isinstance(kind, Pointer):
        return ""
    return f"{kind.default:g}" if isinstance(kind, Whole | Real) else f"`{kind.default}`"


def _command() -> Iterator[str]:
    yield from ("## In the command", "", "| option | what it does |", "|---|---|")
    for option in OPTIONS:
        if option.flag is not None:
            yield f"| `{_usage(option, option.flag)}` | {option.flag.help} |"


def _usage(option: Option, flag: Flag) -> str:
    """The flag with its value, as `--help` has it."""
    arguments = flag.arguments
    if "metavar" in arguments:
        value = str(arguments["metavar"])
    elif (
        choices := arguments.get("choices", option.kind.values if isinstance(option.kind, Choice) else None)
    ) is not None:
        value = "|".join(map(str, choices))
    elif isinstance(option.kind, Switch | Text):
        return flag.name
    else:
        value = option.name.upper()
    several = "…" if arguments.get("nargs") == "+" else ""
    return f"{flag.name} {value}{several}".replace("|", "\\|")


if __name__ == "__main__":
    target = Path(sys.argv[1]) if len(sys.argv) > 1 else PAGE
    target.write_text(page(), encoding="utf-8")

"""The command's options, made of the table (core/options): what they are called, and what is refused."""

from __future__ import annotations

import argparse
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NoReturn

from ...core.base.errors import InputError
from ...core.base.foreign_text import check_utf8
from ...core.finish.image_file import check_format
from ...core.options.option import Choice, Flag, Kind, Option, Real, Switch, Whole
from ...core.options.table import OPTIONS
from ...core.options.values import settings_of_command
from ...core.settings import Settings, check_files


class StrictParser(argparse.ArgumentParser):
    """Refuses with an exception of ours, so that a wrong option ends in one line as any other wrong input."""

    def error(self, message: str) -> NoReturn:
        raise InputError(f"{message}; --help lists the options")


def parser(prog: str, *, with_file: bool, planning: bool = False) -> argparse.ArgumentParser:
    """The command's parser. with_file: the scene is named in the command itself. planning: for `plan`."""
    made = StrictParser(prog=prog, description="Bake ambient and reflection occlusion.", allow_abbrev=False)
    if with_file:
        made.add_argument("file", type=Path, metavar="FILE", help="a .blend, .obj, .glb, .gltf or .ply file")
    groups: dict[str, Any] = {"": made}
    for option in OPTIONS:
        if (flag := option.flag) is not None:
            if flag.group not in groups:
                groups[flag.group] = made.add_mutually_exclusive_group()
            groups[flag.group].add_argument(flag.name, dest=option.name, help=flag.help, **_arguments(option, flag))
    if planning:
        made.add_argument(
            "--manifest",
            metavar="FILE.json",
            help="where to write what is to be baked (manifest.json beside the images); the scene goes beside it",
        )
    # From one Blender to another: values of options by name, that stand over the others, who takes part (roles.py), and
    # the folder that a comparison alone goes to (compare/steps.py).
    made.add_argument("--values", type=Path, help=argparse.SUPPRESS)
    made.set_defaults(roles=None, comparison=None)
    return made


def parsed(made: argparse.ArgumentParser, argv: Sequence[str]) -> argparse.Namespace:
    """The options' values. Raises InputError."""
    options = made.parse_args(argv)
    for value in vars(options).values():
        for word in value if isinstance(value, list) else [value]:
            if isinstance(word, str):  # names within Blender; of paths those are checked that are written to
                check_utf8(word)
    if options.values is not None:
        for name, value in json.loads(options.values.read_text(encoding="utf-8")).items():
            setattr(options, name, value)
    return options


def _arguments(option: Option, flag: Flag) -> dict[str, Any]:
    """What `add_argument` takes: as the option's kind has it, and as the flag says otherwise."""
    arguments = {**_of_kind(option.kind), **flag.arguments}
    if "action" in flag.arguments:  # which takes no type
        arguments.pop("type", None)
    return {name: value for name, value in arguments.items() if not (name == "choices" and value is None)}


def _of_kind(kind: Kind) -> dict[str, Any]:
    if isinstance(kind, Switch):
        return {"action": "store_true"}
    if isinstance(kind, Whole):
        return {"type": int, "default": kind.default}
    if isinstance(kind, Real):
        return {"type": float, "default": kind.default}
    return {"choices": kind.values, "default": kind.default} if isinstance(kind, Choice) else {}


def settings_of(options: Any) -> Settings:
    """The bake's settings, out of the parsed options. Raises InputError for all that is wrong without a scene."""
    if options.cycles_samples is not None and options.cycles_samples < 1:
        raise InputError(f"--compare-cycles {options.cycles_samples}: give 1 sample or more")
    _check_sources(options)
    check_format(options.format, options.depth)
    settings = settings_of_command(vars(options))
    if options.color_attributes is not None and not settings.are_grey:
        raise InputError("--color-attributes take AO and RO alone; leave out the other maps, or bake images")
    if options.into is None and options.color_attributes is None:
        check_files(settings.maps, options.format, options.depth)
    return settings


def _check_sources(options: Any) -> None:
    if options.highs and len(options.objects or ()) != 1:
        raise InputError("--highs: give the one object that is baked from them in --objects")
    if options.cage and not options.highs:
        raise InputError("--cage: is of an object that is baked from others; give those in --highs")
    if options.extrusion is not None and not options.extrusion > 0.0:
        raise InputError(f"--extrusion {options.extrusion:g}: give a length above 0")
    if options.atlas and options.color_attributes:
        raise InputError("--atlas: color attributes are no images; leave out one of the two")
    if options.into and options.color_attributes:
        raise InputError("--into: color attributes are no images; leave out one of the two")
    if options.color_attributes is not None and Path(options.color_attributes).suffix != ".blend":
        raise InputError(f"--color-attributes {options.color_attributes}: is a scene; end its name in .blend")

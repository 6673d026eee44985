"""The command's options: what they are called, what they mean, and what is refused."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NoReturn

from ...core.bake import Settings
from ...core.base.errors import InputError
from ...core.finish.bent_normals import Bent, Space
from ...core.finish.image_file import check_format
from ...core.finish.map_finisher import LIGHT, RATIO
from ...core.finish.map_images import are_grey, check_maps
from ...core.quality import DEFAULT, PRESETS
from ...core.rays.map_spec import AO, Estimator, Falloff, light, reflection, sampled
from ...core.solve.directional import FEWEST_RAYS, Coding
from ...core.spherical.directional_format import Code

COMPARED_SAMPLES = 64
_LIGHTS = {"light": LIGHT, "light-share": RATIO}
_MAPS = ("ao", "ro", "bent", *_LIGHTS)


class _Parser(argparse.ArgumentParser):
    """Refuses with an exception of ours, so that a wrong option ends in one line as any other wrong input."""

    def error(self, message: str) -> NoReturn:
        raise InputError(f"{message}; --help lists the options")


def parser(prog: str, *, with_file: bool) -> argparse.ArgumentParser:
    """The command's parser; `with_file` where the scene is named in the command itself."""
    made = _Parser(prog=prog, description="Bake ambient and reflection occlusion.", allow_abbrev=False)
    if with_file:
        made.add_argument("file", type=Path, metavar="FILE", help="a .blend, .obj, .glb, .gltf or .ply file")
    add = made.add_argument
    add("--objects", nargs="+", metavar="NAME", help="what to bake (all meshes that render)")
    add("--maps", nargs="+", choices=_MAPS, default=["ao"], help="what to bake; light-…: of the scene's World (ao)")
    add("--size", type=_size, default=(1024, 1024), metavar="N|WxH", help="texels of the image (1024)")
    _add_effort(made)
    add("--distance", type=float, metavar="D", help="how far an occluder may be (no limit)")
    who = "what blocks light: the scene, self (each object its own alone), or objects and collections (scene)"
    add("--occluders", nargs="+", default=["scene"], metavar="scene|self|NAME", help=who)
    add("--ground", action="store_true", help="and a level ground below what is baked")
    _add_sources(made)
    _add_options(made)
    add("--ro-exponent", type=float, nargs="+", default=[10.0], metavar="E", help="Phong exponents of RO (10)")
    add("--ro-direction", choices=("normal", "camera"), default="normal", help="what R is taken from (normal)")
    horizon = "the formula as it stands, or divided by its value in the open (keep)"
    add("--ro-horizon", choices=("keep", "divide"), default="keep", help=horizon)
    samplers = ("importance", "uniform_hemisphere", "uniform_sphere")
    add("--sampler", choices=samplers, default="importance", help="naive ones are for comparison (importance)")
    uv = "the UV map; charts, smart: make one, by xatlas or Smart UV Project (the active, charts where there is none)"
    add("--uv", metavar="NAME|charts|smart", help=uv)
    atlas = "one image of this name for all objects (one each)"
    add("--atlas", nargs="?", const="Atlas", metavar="NAME", help=atlas)
    udim = "an image for each tile of a UDIM layout; --no-udim: of the first alone"
    add("--udim", action=argparse.BooleanOptionalAction, default=True, help=udim)
    add("--coverage", type=Path, metavar="FILE", help="write the texels' coverage, too")
    add(
        "--output",
        type=Path,
        default=Path("occlusion_bake"),
        metavar="FOLDER",
        help="for the images; // is the scene's (occlusion_bake)",
    )
    into = "write the one map into a channel of an image that is there, as orm.png:R, in place of files in a folder"
    add("--into", type=_channel, metavar="FILE:R|G|B|A", help=into)
    colours = "bake color attributes, no textures, and write a copy of the scene with them"
    add("--color-attributes", type=Path, metavar="FILE.blend", help=colours)
    add("--format", choices=("png", "exr", "tiff"), default="png", help="of the images (png)")
    add("--depth", type=int, choices=(8, 16, 32), default=16, help="bits a channel (16)")
    add("--dither", action="store_true", help="round integers by chance, so that slow gradients show no bands")
    add("--margin", type=int, default=16, metavar="PX", help="texels to carry chart borders outward (16)")
    add("--threads", type=int, default=0, metavar="N", help="processor threads (all)")
    add("--seed", type=int, default=0, metavar="S", help="same seed, same bits (0)")
    compare = {"nargs": "?", "type": int, "const": COMPARED_SAMPLES, "metavar": "SAMPLES"}
    add("--compare-cycles", **compare, help=f"bake AO with Cycles, too, and compare ({COMPARED_SAMPLES})")  # type: ignore[arg-type]
    add("--report", type=Path, metavar="FILE.json", help="write what was done, how fast and how well")
    return made


def _add_options(made: argparse.ArgumentParser) -> None:
    """What blocks how much, and how directions are written."""
    add = made.add_argument
    falloff = "how occluders block less towards the distance (none)"
    add("--falloff", choices=[each.name.lower() for each in Falloff], default="none", help=falloff)
    add("--min-distance", type=float, default=0.0, metavar="D", help="nearer occluders do not count (0)")
    add("--spread", type=float, default=180.0, metavar="DEGREES", help="the cone that rays stay in (180)")
    add("--front-faces", action="store_true", help="faces block no light that comes from behind them")
    turned = "turn the normals as the normal maps of the objects' materials do"
    add("--normal-maps", action="store_true", help=turned)
    space = "what bent normals are told by (tangent)"
    add("--bent-space", choices=[each.value for each in Space], default="tangent", help=space)
    add("--bent-y", choices=("up", "down"), default="up", help="which way their green points (up)")
    add("--bent-alpha", action="store_true", help="AO in their alpha")
    code = "a directional code: sh_1 to sh_6, mask_8, mask_16, cells_8 or cells_16"
    add("--code", metavar="NAME", help=code)
    add("--code-rays", type=int, default=FEWEST_RAYS, metavar="N", help=f"rays a texel of the code ({FEWEST_RAYS})")


def _add_sources(made: argparse.ArgumentParser) -> None:
    """What objects are baked from, where it is not their own surface."""
    one = made.add_mutually_exclusive_group()
    one.add_argument("--highs", nargs="+", metavar="NAME", help="meshes to bake the one object of --objects from")
    one.add_argument("--pairs", action="store_true", help="bake each …_low from its …_high meshes, in its …_cage")
    made.add_argument("--cage", metavar="NAME", help="the object of --objects blown up, to look for --highs from")
    extrusion = "how far above and below the surface high meshes are looked for (a fiftieth of its diagonal)"
    made.add_argument("--extrusion", type=float, metavar="D", help=extrusion)


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
    if options.color_attributes and options.color_attributes.suffix != ".blend":
        raise InputError(f"--color-attributes {options.color_attributes}: is a scene; end its name in .blend")
    if options.compare_cycles is not None and (options.into or options.color_attributes):
        raise InputError("--compare-cycles compares images of their own; leave out --into and --color-attributes")
    if options.compare_cycles is not None and options.atlas:
        raise InputError("--compare-cycles: objects are compared one by one; leave out --atlas")


def _add_effort(made: argparse.ArgumentParser) -> None:
    """How far to go: to an error, given or by name, or a number of rays."""
    errors = ", ".join(f"{name} 1/{1 / error:.0f}" for name, error in PRESETS.items())
    one = made.add_mutually_exclusive_group()
    one.add_argument("--quality", choices=PRESETS, help=f"the error by name: {errors} ({DEFAULT})")
    one.add_argument("--error", type=_error, metavar="E", help="bake to this RMSE, e.g. 0.004 or 1/255")
    one.add_argument(
        "--rays", type=int, metavar="N", help="rays a texel and map, nothing filtered (64 for naive samplers)"
    )
    smooth = "smooth noise over the surface (where an error is asked for)"
    made.add_argument("--filter", action=argparse.BooleanOptionalAction, help=smooth)


def settings_of(options: Any) -> Settings:
    """The bake's settings, out of the parsed options. Raises InputError for all that is wrong without a scene."""
    if options.compare_cycles is not None and options.compare_cycles < 1:
        raise InputError(f"--compare-cycles {options.compare_cycles}: give 1 sample or more")
    if options.compare_cycles is not None and "ao" not in options.maps:
        raise InputError("--compare-cycles compares AO; add ao to --maps")
    _check_sources(options)
    check_format(options.format, options.depth)
    settings = _made_settings(options)
    if options.color_attributes is not None and not are_grey(settings):
        raise InputError("--color-attributes take AO and RO alone; leave out the other maps, or bake images")
    if options.into is None and options.color_attributes is None:
        check_maps(settings, options.format, options.depth)
    return settings


def _made_settings(options: Any) -> Settings:
    width, height = options.size
    return Settings(
        estimators=tuple(_estimators(options.maps, options.ro_exponent, options.ro_direction, options.sampler)),
        width=width,
        height=height,
        rays=Settings.rays if options.rays is None else options.rays,
        error=_wanted_error(options),
        filtered=options.filter,
        distance=options.distance,
        margin=options.margin,
        threads=options.threads,
        seed=options.seed,
        divide_horizon=options.ro_horizon == "divide",
        nearest=options.min_distance,
        falloff=Falloff[options.falloff.upper()],
        spread=options.spread,
        front_only=options.front_faces,
        normal_maps=options.normal_maps,
        bent=_bent(options),
        coding=None if options.code is None else Coding(_code(options.code), options.code_rays),
        lights=frozenset(kind for name, kind in _LIGHTS.items() if name in options.maps) or Settings.lights,
    )


def _bent(options: Any) -> Bent | None:
    if "bent" not in options.maps:
        return None
    return Bent(Space(options.bent_space), options.bent_y == "down", options.bent_alpha)


def _code(text: str) -> Code:
    kind, _, size = text.partition("_")
    if kind not in ("sh", "mask", "cells") or not size.isdigit():
        raise InputError(f"--code {text}: no such code; give one as sh_3 or mask_16")
    return Code(kind, int(size))  # type: ignore[arg-type]


def _wanted_error(options: Any) -> float | None:
    """The error to bake to. None for rays: where they are given, and for the naive samplers, which are compared so."""
    if options.error is not None:
        return float(options.error)
    if options.quality is not None:
        return PRESETS[options.quality]
    return PRESETS[DEFAULT] if options.rays is None and options.sampler == "importance" else None


def _estimators(maps: Sequence[str], exponents: Sequence[float], direction: str, sampler: str) -> list[Estimator]:
    wanted, camera = [AO] if "ao" in maps else [], direction == "camera"
    if "ro" in maps:
        wanted += [reflection(each, from_camera=camera) for each in dict.fromkeys(exponents)]
    lights = [light()] if _LIGHTS.keys() & set(maps) else []
    if lights and "ro" in maps:
        lights += [light(each, from_camera=camera) for each in dict.fromkeys(exponents)]
    return [sampled(each, sampler) for each in wanted] + lights


def _error(text: str) -> float:
    """ "0.004" or "1/255"."""
    above, slash, below = text.partition("/")
    try:
        return float(above) / (float(below) if slash else 1.0)
    except (ValueError, ZeroDivisionError):
        raise argparse.ArgumentTypeError(f"{text!r} is no error; give one as 0.004 or 1/255") from None


def _channel(text: str) -> tuple[Path, str]:
    """ "orm.png:R"."""
    name, _, channel = text.rpartition(":")
    if not name or channel.upper() not in ("R", "G", "B", "A"):
        raise argparse.ArgumentTypeError(f"{text!r} is no channel of a file; give one as orm.png:R")
    return Path(name), channel.upper()


def _size(text: str) -> tuple[int, int]:
    """ "1024" or "2048x1024"."""
    try:
        parts = [int(part) for part in text.lower().split("x")]
    except ValueError:
        parts = []
    if len(parts) not in (1, 2):
        raise argparse.ArgumentTypeError(f"{text!r} is no size; give texels as 1024 or 2048x1024")
    return parts[0], parts[-1]

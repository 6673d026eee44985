"""What a baked map is as pictures: grey, colours, or a directional code as sets of four channels."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from ..bake import Settings
from ..base.errors import InputError
from ..scene.scene import Floats
from ..spherical.directional_format import Code, channel_names, in_fours, ranges, to_images
from .image_file import Metadata, write_image
from .map_finisher import BENT_NAME, LIGHT, BakedMap

_MOST_CHANNELS = 4  # of a picture


def code_of(name: str, settings: Settings) -> Code | None:
    """The code that a map of this name is, None for another map."""
    code = settings.coding.code if settings.coding is not None else None
    return code if code is not None and code.name == name else None


def pictures(name: str, made: BakedMap) -> Iterator[tuple[str, Floats]]:
    """A map as float pictures by name, (H, W), (H, W, 3) or (H, W, 4): of a code several, each number as it is."""
    values = made.values
    if values.ndim == 2 or values.shape[2] <= _MOST_CHANNELS:
        yield name, values
        return
    for number, part in enumerate(in_fours(values, 1.0)):
        yield f"{name}_{number}", part


def check_maps(settings: Settings, format_name: str, depth: int) -> None:
    """Refuse, before a bake, files that could not hold its maps. Raises InputError."""
    if settings.coding is not None and format_name != "exr" and depth == 32:
        raise InputError(
            f"{settings.coding.code.name}: pictures of integers have 8 or 16 bits a channel; choose one of them, or EXR"
        )
    lit = any(each.is_light for each in settings.estimators)
    if lit and LIGHT in settings.lights and format_name != "exr" and depth != 32:
        raise InputError(f"light: it may be above 1, which {format_name.upper()} of {depth} bits cuts off; choose EXR")


def is_one_grey(settings: Settings) -> bool:
    """Whether a bake makes a single map, AO or RO."""
    return are_grey(settings) and len(settings.estimators) == 1


def are_grey(settings: Settings) -> bool:
    """Whether all maps of a bake are AO or RO."""
    return not any(each.is_light for each in settings.estimators) and not (settings.bent or settings.coding)


def map_names(settings: Settings) -> list[str]:
    """The names of the maps of a bake, in order."""
    names = [name for each in settings.estimators for name in settings.names_of(each)]
    names += [BENT_NAME] if settings.bent is not None else []
    return names + ([settings.coding.code.name] if settings.coding is not None else [])


def write_code(path: Path, made: BakedMap, code: Code, *, tile: str, depth: int, metadata: Metadata) -> list[Path]:
    """Write a code as one EXR of named channels, or as a set of RGBA pictures, _0 and on; returns the files.

    tile: what the name of a tile's file ends in, before which the pictures' numbers stand.

    Raises InputError, the old files untouched.
    """
    if path.suffix == ".exr":
        write_image(path, made.values, depth=depth, metadata=metadata, channels=channel_names(code))
        return [path]
    stem, most, files = path.stem.removesuffix(tile), (1 << depth) - 1, []
    low, high = (each.tolist() for each in ranges(code))
    for number, picture in enumerate(to_images(made.values, code, depth)):
        files.append(path.with_name(f"{stem}_{number}{tile}{path.suffix}"))
        four = slice(_MOST_CHANNELS * number, _MOST_CHANNELS * (number + 1))
        told = {**metadata, "low": str(low[four]), "high": str(high[four])}
        write_image(files[-1], picture.astype(np.float32) / np.float32(most), depth=depth, metadata=told)
    return files

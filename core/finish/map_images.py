"""What a baked map is as pictures: grey, colours, or a directional code as sets of four channels."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from ..base.arrays import Floats
from ..spherical.directional_format import DirectionalFormat, channel_names, image_count, in_fours, ranges, to_images
from .baked import BakedMap, MapKind, Metadata
from .image_file import names_channels, write_image

_MOST_CHANNELS = 4  # of a picture


def title(name: str) -> str:
    """A map's name for people: "ao" → "AO", "ro_10" → "RO 10", "bent" → "Bent"."""
    kind, _, rest = name.partition("_")
    kind = kind.upper() if len(kind) == 2 else kind.capitalize()
    return f"{kind} {rest.replace('_', ' ')}".strip()


def picture_names(kind: MapKind) -> list[str]:
    """What `pictures` calls those of a map."""
    code = kind.directional
    if code is None or code.count <= _MOST_CHANNELS:
        return [kind.name]
    return [f"{kind.name}_{number}" for number in range(-(-code.count // _MOST_CHANNELS))]


def pictures(made: BakedMap) -> Iterator[tuple[str, Floats]]:
    """A map as float pictures by name, (H, W), (H, W, 3) or (H, W, 4): of a code several, each number as it is."""
    values, names = made.values, picture_names(made.kind)
    yield from zip(names, [values] if len(names) == 1 else in_fours(values, 1.0), strict=True)


def code_files(path: Path, code: DirectionalFormat, *, tile: str, depth: int) -> list[Path]:
    """The files that `write_code` writes, by the same arguments."""
    if names_channels(path):
        return [path]
    stem = path.stem.removesuffix(tile)
    return [path.with_name(f"{stem}_{number}{tile}{path.suffix}") for number in range(image_count(code, depth))]


def write_code(
    path: Path, made: BakedMap, code: DirectionalFormat, *, tile: str, depth: int, metadata: Metadata
) -> list[Path]:
    """Write a code as one file of named channels, as EXR, or as a set of RGBA pictures, _0 and on; returns the files.

    tile: what the name of a tile's file ends in, before which the pictures' numbers stand.

    Raises InputError, the old files untouched.
    """
    files = code_files(path, code, tile=tile, depth=depth)
    if names_channels(path):
        write_image(path, made.values, depth=depth, metadata=metadata, channels=channel_names(code))
        return files
    most = (1 << depth) - 1
    low, high = (each.tolist() for each in ranges(code))
    for number, (file, picture) in enumerate(zip(files, to_images(made.values, code, depth), strict=True)):
        four = slice(_MOST_CHANNELS * number, _MOST_CHANNELS * (number + 1))
        told = {**metadata, "low": str(low[four]), "high": str(high[four])}
        write_image(file, picture.astype(np.float32) / np.float32(most), depth=depth, metadata=told)
    return files

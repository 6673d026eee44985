"""Images in and out through OpenImageIO: raw linear values, whole files.

No value is ever colour-managed: 0.25 in the array is 0.25 to whoever reads the file as data. OpenImageIO is loaded at
the first use, so that everything else runs without it.
"""

from __future__ import annotations

import importlib.util
import json
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..base.arrays import Floats
from ..base.atomic_file import check_writable, leads_to, refusal, replacing
from ..base.errors import InputError
from ..base.foreign_text import check_utf8, json_object, one_line
from ..base.library_faults import REINSTALL, cannot_be_loaded
from .baked import Metadata


@dataclass(frozen=True)
class ImageFormat:
    """How one kind of file is written: suffixes (the first is ours), array type by depth, OpenImageIO's settings.

    label, description: for the artist. has_alpha: whether coverage is kept. has_names: whether it holds any number of
    channels by name. end: the bytes that a whole file ends with; empty where its last row tells.
    """

    label: str
    description: str
    suffixes: tuple[str, ...]
    encodings: Mapping[int, type[np.generic]]
    settings: Mapping[str, str | int]
    has_alpha: bool = False
    has_names: bool = False
    end: bytes = b""


FORMATS = {
    # Baked occlusion is noise over a smooth ground: subtracting the row above (filter 32) and the fastest deflate take
    # half the time of the defaults and give a file of the same size.
    "png": ImageFormat(
        "PNG",
        "8 or 16 bits a channel",
        (".png",),
        {8: np.uint8, 16: np.uint16},
        {"png:compressionLevel": 1, "png:filter": 32},
        end=b"\0\0\0\0IEND\xaeB`\x82",
    ),
    "exr": ImageFormat(
        "OpenEXR",
        "16 or 32 bits a channel, with coverage as alpha",
        (".exr",),
        {16: np.float16, 32: np.float32},
        {"compression": "zip"},
        has_alpha=True,
        has_names=True,
    ),
    "tiff": ImageFormat(
        "TIFF",
        "8, 16 or 32 bits a channel",
        (".tif", ".tiff"),
        {8: np.uint8, 16: np.uint16, 32: np.float32},
        {"compression": "zip"},
    ),
}
SUFFIXES = tuple(suffix for each in FORMATS.values() for suffix in each.suffixes)
_NO_END = "its end is missing"
_TYPE_NAMES = {"uint8": "uint8", "uint16": "uint16", "float16": "half", "float32": "float"}


def openimageio() -> ModuleType:
    """The OpenImageIO module. Raises InputError where it is absent or cannot be loaded."""
    try:
        import OpenImageIO
    except Exception as error:  # a broken library fails in ways of its own: ImportError, OSError, AttributeError
        reinstall = f"{REINSTALL}, or pip install OpenImageIO"
        raise cannot_be_loaded("OpenImageIO", _home(), error, reinstall) from error
    return OpenImageIO


def _home() -> Path | None:
    """Where OpenImageIO is installed."""
    with suppress(ValueError):  # of a module that has been put out of use
        spec = importlib.util.find_spec("OpenImageIO")
        return Path(spec.origin) if spec is not None and spec.origin is not None else None
    return None


def check_format(name: str, depth: int) -> None:
    """Refuse, before a bake, a format that could not be written after it.

    name: one of FORMATS. depth: bits per channel, one of its encodings. Raises InputError for any other pair, and where
    OpenImageIO cannot be loaded.
    """
    _encoding(_format(name), f"format {name}", depth)
    openimageio()


def holds_floats(name: str, depth: int) -> bool:
    """Whether a format keeps values above 1 at a depth. Raises InputError as `check_format`."""
    return not issubclass(_encoding(_format(name), f"format {name}", depth), np.integer)


def holds_names(name: str) -> bool:
    """Whether a format holds any number of channels by name. Raises InputError for an unknown one."""
    return _format(name).has_names


def names_channels(path: Path) -> bool:
    """The same of a file, by its suffix."""
    return _format_of(path).has_names


def suffix(name: str) -> str:
    """The file suffix of a format of `check_format`, with its dot. Raises InputError for an unknown format."""
    return _format(name).suffixes[0]


def write_image(
    path: Path | str,
    values: Floats,
    *,
    depth: int,
    coverage: NDArray[Any] | None = None,
    metadata: Metadata | None = None,
    dither: bool = False,
    channels: Sequence[str] = (),
) -> None:
    """Write linear values to a file of one of SUFFIXES, which appears whole or not at all.

    values: (h, w), (h, w, 3) or (h, w, 4) float32, row 0 at the top, the fourth an alpha that the others are not
    multiplied by; integers are rounded to nearest from [0, 1]. channels: names for the values' channels, of which EXR
    takes any number.
    depth: see `check_format`. coverage: (h, w) bool or float; EXR keeps it as channel A and the values, not multiplied
    by it, in R, G and B, since engines refuse grey with alpha; others leave it out.
    metadata: what was baked and how; kept as JSON in the image description, from which `read_image` brings it back.
    dither: integers are rounded up or down by chance, in proportion, so that slow gradients show no bands.
    Raises InputError for a suffix, depth, shape or value that cannot be written, and for any failure to write; the file
    that was there before is then untouched.
    """
    path = Path(path)
    kind = _format_of(path)
    encoding = _encoding(kind, str(path), depth)
    named = len(channels) > 0
    if named and not kind.has_names:
        raise InputError(f"{path}: only EXR holds {len(channels)} named channels; end the name in .exr")
    covered = coverage if kind.has_alpha and not named and values.shape[2:] != (4,) else None
    pixels = _encoded(_layers(path, values, covered, channels), encoding, dither)
    _write_whole(path, _spec(pixels, kind, metadata, channels), pixels)


def check_channel(path: Path, channel: str, size: tuple[int, int]) -> None:
    """Refuse, before a bake, an image that `write_channel` could not write into after it. size: (width, height).
    Raises InputError."""
    spec, _ = _stored(path, pixels=False)
    _channel_of(path, spec, channel)
    if (spec.width, spec.height) != size:
        raise InputError(
            f"{path}: it is {spec.width}x{spec.height} and the bake {size[0]}x{size[1]}; give the size of the image"
        )
    check_writable(leads_to(path).parent)


def write_channel(path: Path, values: Floats, channel: str, *, dither: bool = False) -> None:
    """Put (h, w) linear values into one channel, R, G, B or A, of an image that is there.

    The other channels keep their bits, and the image its depth and what it says of itself; `dither` as in
    `write_image`. Raises InputError as `check_channel`, and for any failure to write, the file untouched.
    """
    check_channel(path, channel, (values.shape[1], values.shape[0]))
    spec, pixels = _stored(path)
    encoded = _encoded(_layers(path, values, None), pixels.dtype.type, dither)
    pixels[..., _channel_of(path, spec, channel)] = encoded[..., 0]
    _write_whole(path, spec, pixels)


def _stored(path: Path, *, pixels: bool = True) -> tuple[Any, NDArray[Any]]:
    """An image's spec, and its pixels, (h, w, c), as they lie in the file."""
    _format_of(path)
    image = _opened(path)
    if (found := image.format_name()) != openimageio().ImageOutput.create(str(path)).format_name():
        raise InputError(f"{path}: it is {found.upper()} by what it holds; name it so, or save it anew")
    spec = openimageio().ImageSpec(image.spec())
    spec.attribute("oiio:UnassociatedAlpha", 1)
    spec.tile_width = spec.tile_height = spec.tile_depth = 0  # tiles are rows from then on, which `_is_whole` reads
    values = _pixels(path, image, spec.format) if pixels else np.empty(0)
    several = image.seek_subimage(1, 0)
    image.close()
    if several:
        raise InputError(f"{path}: it holds several images, of which one alone would be left; save it as one")
    return spec, values


def _channel_of(path: Path, spec: Any, channel: str) -> int:
    """Which of the image's channels that is."""
    names = [name.upper() for name in spec.channelnames]
    if channel not in names:
        others = [name for name in names if name in ("R", "G", "B", "A")]
        cure = f"choose one of {', '.join(others)}" if others else "save it as RGB"
        raise InputError(f"{path}: it has no channel {channel}; {cure}")
    return names.index(channel)


def _write_whole(path: Path, spec: Any, pixels: NDArray[Any]) -> None:
    """The file appears, with these pixels, whole or not at all. Raises InputError."""
    try:
        with replacing(path) as temporary:
            temporary.touch(exist_ok=False)  # the system names the cause of a refusal, which OpenImageIO would blur
            _save(temporary, spec, pixels, path)
    except OSError as error:
        raise refusal(path, error) from error


def read_image(path: Path | str) -> tuple[Floats, dict[str, str | int | float]]:
    """Read an image as it is stored: ((h, w, c) float32, the metadata that `write_image` was given).

    Integers become [0, 1]; alpha is a channel like the others, and nothing is multiplied by it. The metadata of a file
    from elsewhere is {}. Raises InputError for a file that is missing or cannot be read.
    """
    image = _opened(path)
    values = _pixels(path, image, "float")
    metadata = json_object(image.spec().getattribute("ImageDescription"))
    image.close()
    return np.ascontiguousarray(values, dtype=np.float32), metadata


def read_metadata(path: Path | str) -> dict[str, str | int | float]:
    """The metadata of `read_image` alone. Raises InputError for a file that is missing, or whose end is."""
    image = _opened(path)
    spec = image.spec()
    shape, metadata = (spec.height, spec.width, spec.nchannels), json_object(spec.getattribute("ImageDescription"))
    image.close()
    if not _is_whole(Path(path), shape):
        raise _unreadable(path, _NO_END)
    return metadata


def _opened(path: Path | str) -> Any:
    """OpenImageIO's input, which multiplies nothing by alpha. Raises InputError."""
    check_utf8(path)
    library = openimageio()
    as_stored = library.ImageSpec()
    as_stored.attribute("oiio:UnassociatedAlpha", 1)
    image = library.ImageInput.open(str(path), as_stored)
    if image is None:
        raise _unreadable(path, library.geterror())
    return image


def _pixels(path: Path | str, image: Any, kind: Any) -> NDArray[Any]:
    values: NDArray[Any] | None = image.read_image(kind)
    if values is None:
        raise _unreadable(path, image.geterror())
    return values


def _unreadable(path: Path | str, cause: str) -> InputError:
    return InputError(f"{path}: cannot be read as an image ({one_line(cause)}); check the name, or write the file anew")


def _format(name: str) -> ImageFormat:
    if name not in FORMATS:
        raise InputError(f"format {name}: unknown; choose {_one_of(list(FORMATS))}")
    return FORMATS[name]


def _format_of(path: Path) -> ImageFormat:
    for kind in FORMATS.values():
        if path.suffix.lower() in kind.suffixes:
            return kind
    raise InputError(f"{path}: images are written as {_one_of(SUFFIXES)}; end the name in one of these")


def _one_of(names: Sequence[str]) -> str:
    """ "a, b or c"."""
    return f"{', '.join(names[:-1])} or {names[-1]}"


def _encoding(kind: ImageFormat, subject: str, depth: int) -> type[np.generic]:
    if depth not in kind.encodings:
        allowed = " or ".join(str(known) for known in kind.encodings)
        raise InputError(f"{subject}: cannot hold {depth} bits per channel; choose depth {allowed}")
    return kind.encodings[depth]


def _layers(path: Path, values: Floats, coverage: NDArray[Any] | None, channels: Sequence[str] = ()) -> Floats:
    """(h, w, 1), (h, w, 3), as many as there are named channels or, with coverage, (h, w, 4) float32."""
    values = np.asarray(values, dtype=np.float32)
    fitting = [(len(channels),)] if channels else [(), (3,), (4,)]
    if values.ndim not in (2, 3) or values.size == 0 or values.shape[2:] not in fitting:
        raise InputError(f"{path}: an image of shape {values.shape} cannot be written; give (h, w) or (h, w, 3)")
    broken = values.size - int(np.count_nonzero(np.isfinite(values)))
    if broken:
        raise InputError(f"{path}: {broken} values are not finite numbers; nothing was written, bake again")
    if values.ndim == 2:
        values = values[..., None]
    if coverage is None:
        return values
    if coverage.shape != values.shape[:2]:
        raise InputError(f"{path}: coverage of shape {coverage.shape} does not fit; give {values.shape[:2]}")
    layers = np.empty((*values.shape[:2], 4), dtype=np.float32)
    layers[..., :3], layers[..., 3] = values, coverage
    return layers


def _encoded(values: Floats, encoding: type[np.generic], dither: bool) -> NDArray[Any]:
    if not issubclass(encoding, np.integer):
        return np.ascontiguousarray(values, dtype=encoding)
    scaled = np.clip(values, 0.0, 1.0)
    most = np.iinfo(encoding).max
    scaled *= np.float32(most)
    if dither:
        scaled = dithered(scaled, most)
    return np.rint(scaled, out=scaled).astype(encoding)


def dithered(steps: Floats, most: int) -> Floats:
    """Values in steps of an integer, 0 to `most`, moved by up to half a step: rounded, their mean is the value's. Whole
    steps stay what they are. The same image gets the same noise each time."""
    noise = np.random.default_rng(0).random(steps.shape, dtype=np.float32)
    noise -= np.float32(0.5)
    noise *= np.float32(1.0 - 1e-6)  # a whole step must not reach the middle to the next
    noise += steps
    return np.clip(noise, 0.0, np.float32(most), out=noise)


def _spec(pixels: NDArray[Any], kind: ImageFormat, metadata: Metadata | None, names: Sequence[str] = ()) -> Any:
    height, width, channels = pixels.shape
    spec = openimageio().ImageSpec(width, height, channels, _TYPE_NAMES[pixels.dtype.name])
    if names:
        spec.channelnames = tuple(names)
    if channels == 4 and not names:
        spec.attribute("oiio:UnassociatedAlpha", 1)
    # "data" keeps every chunk that invites a conversion (gAMA, sRGB) out of a PNG; "linear" would add a gAMA.
    spec.attribute("oiio:ColorSpace", "data")
    spec.attribute("DateTime", "")  # else EXR and TIFF get that of now, and the same bake would be other bytes
    for key, value in kind.settings.items():
        spec.attribute(key, value)
    if metadata:
        spec.attribute("ImageDescription", json.dumps(dict(metadata), default=lambda number: number.item()))
    return spec


def _save(file: Path, spec: Any, pixels: NDArray[Any], path: Path) -> None:
    """Write `pixels` to `file` and prove it whole; InputErrors speak of `path`."""
    output = openimageio().ImageOutput.create(str(file))
    done = output is not None and output.open(str(file), spec) and output.write_image(pixels)
    cause = output.geterror() if output is not None else openimageio().geterror()
    # A full disk is told by the result alone (EXR, TIFF), by the message alone (PNG), and by neither where only the
    # last bytes are missing. After close() the message says nothing: TIFF leaves one each time.
    closed = output is not None and output.close()
    if done and not cause and closed and _is_whole(file, pixels.shape):
        return
    cause = one_line(cause.replace(str(file), path.name)) or _NO_END
    raise InputError(f"{path}: could not be written whole ({cause}); check that the disk has room")


def _is_whole(file: Path, shape: tuple[int, ...]) -> bool:
    """Whether the end of the file is there: its format's end mark, or the last row where that is quick to reach."""
    if end := _format_of(file).end:
        with file.open("rb") as stream:
            stream.seek(max(0, file.stat().st_size - len(end)))
            return stream.read() == end
    height, _, channels = shape
    image = openimageio().ImageInput.open(str(file))
    if image is None:
        openimageio().geterror()  # left unread, it would be printed at exit
        return False
    last_row = image.read_scanlines(height - 1, height, 0, 0, channels)
    image.close()
    return last_row is not None

"""One channel of an image that is there: the others keep their bits, and nothing is lost where it cannot be done."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_array_equal
from occlusion_bake.core.base.errors import InputError
from occlusion_bake.core.finish.image_file import check_channel, openimageio, read_image, write_channel

RAMP = np.linspace(0, 1, 12 * 8, dtype=np.float32).reshape(8, 12)


def image(path: Path, channels: int, kind: str, *, tile: int = 0, **attributes: Any) -> np.ndarray:
    """Write an image of noise, in tiles if their size is given; returns its values as they are read."""
    library = openimageio()
    spec = library.ImageSpec(12, 8, channels, kind)
    spec.tile_width, spec.tile_height, spec.tile_depth = tile, tile, min(tile, 1)
    for name, value in attributes.items():
        spec.attribute(name, value)
    output = library.ImageOutput.create(str(path))
    assert output.open(str(path), spec)
    assert output.write_image(np.random.default_rng(5).random((8, 12, channels), dtype=np.float32))
    output.close()
    return read_image(path)[0]


@pytest.mark.parametrize("name", ["a.exr", "a.tif"])
def test_images_in_tiles_take_it_too(tmp_path: Path, name: str) -> None:
    before = image(tmp_path / name, 3, "float", tile=16)
    assert openimageio().ImageInput.open(str(tmp_path / name)).spec().tile_width == 16
    write_channel(tmp_path / name, RAMP, "G")
    after = read_image(tmp_path / name)[0]
    assert_array_equal(after[..., 1], RAMP)
    assert_array_equal(after[..., [0, 2]], before[..., [0, 2]])


@pytest.mark.parametrize(
    ("name", "kind", "step"),
    [
        ("a.png", "uint8", 255),
        ("a.png", "uint16", 65535),
        ("a.tif", "uint16", 65535),
        ("a.exr", "half", 0),
        ("a.exr", "float", 0),
    ],
)
@pytest.mark.parametrize("channels", [3, 4])
@pytest.mark.parametrize("channel", "RGB")
def test_the_others_keep_their_bits(
    tmp_path: Path, name: str, kind: str, step: int, channels: int, channel: str
) -> None:
    path = tmp_path / name
    before = image(path, channels, kind, Copyright="the artist's")
    write_channel(path, RAMP, channel)
    after = read_image(path)[0]
    place = "RGB".index(channel)
    others = [i for i in range(channels) if i != place]
    assert_array_equal(after[..., others], before[..., others])
    wanted = (
        np.rint(RAMP * step) / np.float32(step) if step else RAMP.astype(np.float16 if kind == "half" else np.float32)
    )
    np.testing.assert_allclose(after[..., place], wanted, atol=1e-7)
    spec = openimageio().ImageInput.open(str(path)).spec()
    assert str(spec.format) == kind
    assert spec.getattribute("Copyright") == "the artist's"
    assert [each.name for each in tmp_path.iterdir()] == [name]


def test_alpha_is_a_channel(tmp_path: Path) -> None:
    """And the colours under it are not multiplied by what it becomes."""
    before = image(tmp_path / "a.png", 4, "uint8")
    write_channel(tmp_path / "a.png", RAMP, "A")
    after = read_image(tmp_path / "a.png")[0]
    assert_array_equal(after[..., :3], before[..., :3])
    np.testing.assert_allclose(after[..., 3], RAMP, atol=0.5 / 255 + 1e-6)


def test_dither_keeps_the_mean(tmp_path: Path) -> None:
    image(tmp_path / "a.png", 3, "uint8")
    grey = np.full((8, 12), 100.25 / 255, dtype=np.float32)
    write_channel(tmp_path / "a.png", grey, "R", dither=True)
    steps = read_image(tmp_path / "a.png")[0][..., 0] * 255
    assert set(np.rint(steps.ravel()).astype(np.int64)) == {100, 101}


@pytest.mark.parametrize(
    ("channel", "size", "line"),
    [("A", (12, 8), "no channel A; choose one of R, G, B"), ("R", (8, 12), "it is 12x8 and the bake 8x12")],
)
def test_what_does_not_fit_is_refused(tmp_path: Path, channel: str, size: tuple[int, int], line: str) -> None:
    path = tmp_path / "a.png"
    image(path, 3, "uint8")
    before = path.read_bytes()
    with pytest.raises(InputError, match=line):
        check_channel(path, channel, size)
    with pytest.raises(InputError, match=line):
        write_channel(path, np.zeros(size[::-1], np.float32), channel)
    assert path.read_bytes() == before


@pytest.mark.parametrize(
    ("name", "channels", "line"),
    [("a.png", 1, "it has no channel R; save it as RGB"), ("a.exr", 3, "it is PNG by what it holds; name it so")],
)
def test_a_cure_fits_what_the_file_is(tmp_path: Path, name: str, channels: int, line: str) -> None:
    image(tmp_path / "made.png", channels, "uint8")
    path = (tmp_path / "made.png").rename(tmp_path / name)
    with pytest.raises(InputError, match=line):
        check_channel(path, "R", (12, 8))


def test_several_images_in_a_file_are_refused(tmp_path: Path) -> None:
    library, path = openimageio(), tmp_path / "parts.exr"
    spec = library.ImageSpec(12, 8, 3, "half")
    output = library.ImageOutput.create(str(path))
    assert output.open(str(path), (spec, spec))
    for part in range(2):
        assert part == 0 or output.open(str(path), spec, "AppendSubimage")
        output.write_image(np.zeros((8, 12, 3), np.float32))
    output.close()
    before = path.read_bytes()
    with pytest.raises(InputError, match="it holds several images"):
        write_channel(path, RAMP, "R")
    assert path.read_bytes() == before


def test_what_is_no_image_is_refused(tmp_path: Path) -> None:
    for name, line in (("missing.png", "cannot be read"), ("a.jpg", "end the name in one of these")):
        with pytest.raises(InputError, match=line):
            check_channel(tmp_path / name, "R", (8, 8))
    (tmp_path / "broken.png").write_bytes(b"no image")
    with pytest.raises(InputError, match=r"broken\.png: cannot be read"):
        write_channel(tmp_path / "broken.png", RAMP, "R")
    assert (tmp_path / "broken.png").read_bytes() == b"no image"

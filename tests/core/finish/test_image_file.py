"""Written images: exact values at every format and depth, whole files, errors that say what to do."""

from __future__ import annotations

import importlib.util
import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from occlusion_bake.core.base.errors import InputError

pytest.importorskip("OpenImageIO", reason="OpenImageIO is not installed")

from occlusion_bake.core.base.atomic_file import check_writable
from occlusion_bake.core.finish import image_file
from occlusion_bake.core.finish.image_file import FORMATS, check_format, read_image, suffix, write_image

# Half the step of the encoding near 1.
_HALF_STEPS = {np.uint8: 0.5 / 255, np.uint16: 0.5 / 65535, np.float16: 2.0**-12, np.float32: 0.0}
# Whatever format there is keeps what is promised of all.
TOLERANCE = {
    (name, depth): _HALF_STEPS[encoding] for name, each in FORMATS.items() for depth, encoding in each.encodings.items()
}
EVERY = pytest.mark.parametrize(("name", "depth"), list(TOLERANCE))
METADATA = {"object": 'Würfel "1"', "rays": 256, "distance": 0.1, "whole": 2.0, "note": "two\nlines"}


def ramp(height: int = 37, width: int = 53) -> np.ndarray:
    """Every corner different, both ends of the range present."""
    return np.linspace(0.0, 1.0, height * width, dtype=np.float32).reshape(height, width)


def near(found: np.ndarray, wanted: np.ndarray, name: str, depth: int) -> bool:
    return bool(np.abs(found.astype(np.float64) - wanted).max() <= TOLERANCE[name, depth] + 1e-7 * (depth < 32))


def one_line(refusal: pytest.ExceptionInfo[InputError]) -> str:
    text = str(refusal.value)
    assert text
    assert "\n" not in text
    return text


@EVERY
def test_grey_comes_back(tmp_path: Path, name: str, depth: int) -> None:
    path = tmp_path / f"ao{suffix(name)}"
    write_image(path, ramp(), depth=depth, metadata=METADATA)
    values, metadata = read_image(path)
    assert values.dtype == np.float32
    assert values.shape == (37, 53, 1)
    assert near(values[..., 0], ramp(), name, depth)
    assert metadata == METADATA
    assert [type(value) for value in metadata.values()] == [type(value) for value in METADATA.values()]
    assert list(tmp_path.iterdir()) == [path]


@EVERY
def test_colour_comes_back(tmp_path: Path, name: str, depth: int) -> None:
    path = tmp_path / f"bent{suffix(name)}"
    wanted = np.stack([ramp(), ramp()[::-1], ramp()[:, ::-1]], axis=-1)
    write_image(path, wanted, depth=depth)
    values, metadata = read_image(path)
    assert values.shape == wanted.shape
    assert near(values, wanted, name, depth)
    assert metadata == {}


@pytest.mark.parametrize("depth", [16, 32])
def test_exr_keeps_values_where_coverage_is_zero(tmp_path: Path, depth: int) -> None:
    covered = np.indices((37, 53), dtype=np.int64).sum(axis=0) % 3 == 0
    write_image(tmp_path / "ao.exr", ramp(), depth=depth, coverage=covered)
    values, _ = read_image(tmp_path / "ao.exr")
    assert values.shape == (37, 53, 4)
    assert np.array_equal(values[..., 3], covered)
    assert all(near(values[..., channel], ramp(), "exr", depth) for channel in range(3))


@pytest.mark.parametrize("name", [name for name, each in FORMATS.items() if not each.has_alpha])
def test_coverage_is_left_out_where_it_has_no_place(tmp_path: Path, name: str) -> None:
    path = tmp_path / f"ao{suffix(name)}"
    write_image(path, ramp(), depth=min(FORMATS[name].encodings), coverage=np.zeros((37, 53), dtype=bool))
    assert read_image(path)[0].shape == (37, 53, 1)


@pytest.mark.parametrize("depth", [8, 16])
def test_integers_are_rounded_to_nearest_and_clipped(tmp_path: Path, depth: int) -> None:
    top = 2**depth - 1
    wanted = np.array([0, 0, 1, 1, 2, top - 1, top, top], dtype=np.float64)
    given = np.array([-3.0, 0.4, 0.6, 1.4, 1.6, top - 0.6, top - 0.4, 2.0 * top]) / top
    write_image(tmp_path / "a.png", given[None].astype(np.float32), depth=depth)
    assert np.array_equal(np.rint(read_image(tmp_path / "a.png")[0][0, :, 0] * top), wanted)


def test_float_images_keep_values_beyond_one(tmp_path: Path) -> None:
    given = np.array([[-1.5, 0.0, 1.0, 1000.25]], dtype=np.float32)
    for file in ("a.exr", "a.tif"):
        write_image(tmp_path / file, given, depth=32)
        assert np.array_equal(read_image(tmp_path / file)[0][..., 0], given)


@pytest.mark.parametrize("depth", [8, 16])
def test_png_is_grey_and_invites_no_conversion(tmp_path: Path, depth: int) -> None:
    path = tmp_path / "a.PNG"
    write_image(path, ramp(), depth=depth)
    data, chunks, at = path.read_bytes(), [], 8
    while at < len(data):
        length = int.from_bytes(data[at : at + 4], "big")
        chunks.append(data[at + 4 : at + 8])
        at += length + 12
    assert not {b"gAMA", b"sRGB", b"iCCP", b"cICP", b"cHRM"} & set(chunks)
    assert (data[24], data[25]) == (depth, 0)


READ_IN_BLENDER = """
import json, sys
import bpy
import numpy as np
from occlusion_bake.core.finish.image_file import write_image
grey = np.full((4, 6), 0.25, dtype=np.float32)
grey[0, 0], grey[0, 5], grey[3, 0] = 0.0, 1.0, 0.7
covered = np.ones((4, 6), dtype=bool)
covered[:, :3] = False
found = {}
for file, depth in json.loads(sys.argv[2]):
    path = f"{sys.argv[1]}/{depth}-{file}"
    write_image(path, grey, depth=depth, coverage=covered)
    image = bpy.data.images.load(path)
    image.colorspace_settings.name = "Non-Color"
    pixels = np.empty(len(image.pixels), dtype=np.float32)
    image.pixels.foreach_get(pixels)
    found[f"{file} {depth}"] = pixels.reshape(image.size[1], image.size[0], image.channels)[::-1].tolist()
print("FOUND" + json.dumps([grey.tolist(), covered.tolist(), found]))
"""


@pytest.mark.skipif(importlib.util.find_spec("bpy") is None, reason="the bpy wheel is not installed")
def test_blender_reads_the_raw_values(tmp_path: Path) -> None:
    cases = [[f"a{suffix(name)}", depth] for name, depth in TOLERANCE]
    command = [sys.executable, "-c", READ_IN_BLENDER, str(tmp_path), json.dumps(cases)]
    run = subprocess.run(command, capture_output=True, text=True, check=False)
    line = next((line for line in run.stdout.splitlines() if line.startswith("FOUND")), None)
    assert line, run.stdout + run.stderr
    grey, covered, found = json.loads(line.removeprefix("FOUND"))
    for (name, depth), pixels in zip(TOLERANCE, map(np.array, found.values()), strict=True):
        assert all(near(pixels[..., channel], np.array(grey), name, depth) for channel in range(3)), (name, depth)
        assert np.array_equal(pixels[..., 3], covered if FORMATS[name].has_alpha else np.ones((4, 6))), (name, depth)


@pytest.mark.parametrize(
    ("name", "depth", "cure"), [("png", 32, "8 or 16"), ("exr", 8, "16 or 32"), ("tiff", 24, "8 or 16 or 32")]
)
def test_a_depth_is_refused_before_and_at_writing(tmp_path: Path, name: str, depth: int, cure: str) -> None:
    with pytest.raises(InputError) as refusal:
        check_format(name, depth)
    assert cure in one_line(refusal)
    with pytest.raises(InputError) as refusal:
        write_image(tmp_path / f"ao{suffix(name)}", ramp(), depth=depth)
    assert cure in one_line(refusal)
    assert list(tmp_path.iterdir()) == []


@EVERY
def test_allowed_formats_pass(name: str, depth: int) -> None:
    check_format(name, depth)


def test_an_unknown_format_or_suffix_is_refused(tmp_path: Path) -> None:
    *others, last = FORMATS
    offered = f"{', '.join(others)} or {last}"
    with pytest.raises(InputError, match=offered):
        check_format("bmp", 8)
    with pytest.raises(InputError, match=offered):
        suffix("jpeg")
    with pytest.raises(InputError, match=r"\.png, \.exr"):
        write_image(tmp_path / "ao.jpg", ramp(), depth=8)


@pytest.mark.parametrize("shape", [(4,), (0, 4), (4, 4, 2), (4, 4, 5), (2, 4, 4, 3)])
def test_shapes_that_are_no_image_are_refused(tmp_path: Path, shape: tuple[int, ...]) -> None:
    with pytest.raises(InputError) as refusal:
        write_image(tmp_path / "a.png", np.zeros(shape, dtype=np.float32), depth=8)
    assert "(h, w, 3)" in one_line(refusal)


def test_coverage_of_another_size_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="coverage"):
        write_image(tmp_path / "a.exr", ramp(), depth=16, coverage=np.ones((2, 2), dtype=bool))


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_values_that_are_not_finite_are_refused(tmp_path: Path, bad: float) -> None:
    values = ramp()
    values[3, 4] = bad
    with pytest.raises(InputError, match="1 values are not finite"):
        write_image(tmp_path / "a.exr", values, depth=32)
    assert list(tmp_path.iterdir()) == []


def test_a_description_nested_too_deep_is_none(tmp_path: Path) -> None:
    path = tmp_path / "deep.tif"
    spec = image_file.openimageio().ImageSpec(1, 1, 1, "uint8")
    spec.attribute("ImageDescription", "[" * 100_000)
    output = image_file.openimageio().ImageOutput.create(str(path))
    assert output.open(str(path), spec) and output.write_image(np.zeros((1, 1, 1), np.uint8)) and output.close()
    assert read_image(path)[1] == {}


def test_metadata_takes_numpy_numbers(tmp_path: Path) -> None:
    write_image(tmp_path / "a.png", ramp(), depth=8, metadata={"error": np.float32(0.5), "rays": np.int64(7)})
    assert read_image(tmp_path / "a.png")[1] == {"error": 0.5, "rays": 7}


def test_a_missing_openimageio_is_named_with_its_cure(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "OpenImageIO", None)
    with pytest.raises(InputError) as refusal:
        check_format("png", 8)
    assert "pip install OpenImageIO" in one_line(refusal)


def test_what_is_no_image_cannot_be_read(tmp_path: Path) -> None:
    (tmp_path / "text.png").write_text("no image")
    for file in ("text.png", "missing.exr"):
        with pytest.raises(InputError) as refusal:
            read_image(tmp_path / file)
        assert file in one_line(refusal)


@EVERY
def test_a_file_that_lost_its_end_leaves_the_old_one(
    tmp_path: Path, name: str, depth: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / f"ao{suffix(name)}"
    write_image(path, ramp(), depth=depth)
    before, is_whole = path.read_bytes(), image_file._is_whole

    def cut_short(file: Path, shape: tuple[int, ...]) -> bool:
        file.write_bytes(file.read_bytes()[:-700])
        return is_whole(file, shape)

    monkeypatch.setattr(image_file, "_is_whole", cut_short)
    noisy = np.random.default_rng(0).random((64, 64), dtype=np.float32)
    with pytest.raises(InputError) as refusal:
        write_image(path, noisy, depth=depth)
    assert "disk has room" in one_line(refusal)
    assert path.read_bytes() == before
    assert list(tmp_path.iterdir()) == [path]


def test_a_folder_in_the_way_stays(tmp_path: Path) -> None:
    (tmp_path / "ao.png").mkdir()
    with pytest.raises(InputError) as refusal:
        write_image(tmp_path / "ao.png", ramp(), depth=8)
    assert "folder" in one_line(refusal)
    assert [path.is_dir() for path in tmp_path.iterdir()] == [True]


def test_a_folder_that_is_missing_or_a_file_is_named(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    for folder in ("missing", "file"):
        with pytest.raises(InputError) as refusal:
            write_image(tmp_path / folder / "ao.png", ramp(), depth=8)
        assert str(tmp_path / folder / "ao.png") in one_line(refusal)
    assert [path.name for path in tmp_path.iterdir()] == ["file"]


def test_check_writable_makes_the_folder_and_leaves_it_empty(tmp_path: Path) -> None:
    check_writable(tmp_path / "a" / "b")
    check_writable(tmp_path / "a" / "b")
    assert list((tmp_path / "a" / "b").iterdir()) == []


def test_check_writable_names_a_file_in_the_way(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    for folder in (tmp_path / "file", tmp_path / "file" / "below"):
        with pytest.raises(InputError) as refusal:
            check_writable(folder)
        assert str(folder) in one_line(refusal)


PAGE, PAGES = 4096, 64


@pytest.fixture
def small_disk(tmp_path_factory: pytest.TempPathFactory):
    """A disk of 64 pages."""
    folder = tmp_path_factory.mktemp("disk")
    mount = ["mount", "-t", "tmpfs", "-o", f"size={PAGE * PAGES}", "tmpfs", str(folder)]
    try:
        subprocess.run(mount, check=True, capture_output=True)
    except (OSError, subprocess.CalledProcessError):
        pytest.skip("needs the right to mount a small disk")
    yield folder
    subprocess.run(["umount", "--lazy", str(folder)], check=True)  # a failed test may still hold a file


@EVERY
def test_a_full_disk_never_leaves_part_of_a_file(small_disk: Path, name: str, depth: int) -> None:
    path, filler = small_disk / f"ao{suffix(name)}", small_disk / "filler"
    noisy = np.random.default_rng(0).random((64, 96), dtype=np.float32)
    write_image(path, ramp(), depth=depth)
    before = path.read_bytes()
    used = len(before) // PAGE + 1
    outcomes = set()
    for free in range(12):
        filler.write_bytes(bytes(PAGE * (PAGES - used - free)))
        try:
            write_image(path, noisy, depth=depth)
        except InputError as refusal:
            outcomes.add("refused")
            assert "\n" not in str(refusal)
            assert str(path) in str(refusal)
            assert path.read_bytes() == before
        else:
            outcomes.add("written")
            assert near(read_image(path)[0][..., 0], noisy, name, depth)
            path.write_bytes(before)
        assert set(small_disk.iterdir()) == {path, filler}
        filler.unlink()
    assert outcomes == {"refused", "written"}


def test_a_disk_that_is_full_or_read_only_is_told_before_the_bake(small_disk: Path) -> None:
    filler = small_disk / "filler"
    filler.write_bytes(bytes(PAGE * PAGES))
    with pytest.raises(InputError, match="free some space"):
        check_writable(small_disk)
    assert list(small_disk.iterdir()) == [filler]
    subprocess.run(["mount", "-o", "remount,ro", str(small_disk)], check=True)
    for attempt in (lambda: check_writable(small_disk), lambda: write_image(small_disk / "a.png", ramp(), depth=8)):
        with pytest.raises(InputError, match="can be written to"):
            attempt()

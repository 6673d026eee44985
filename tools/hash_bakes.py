"""hash_bakes.py [--models FOLDER] [--save FILE] [--against FILE]: what bakes give, a line a result, its values hashed.

For changes that must change no value: run it before and after, with the same Python on the same machine, and compare.
Everything goes through the command, whose options stay compatible: all sample scenes, meshes in FOLDER where it is
given, all maps, directional codes, an atlas, UDIM, high to low, color attributes, and what blocks how much. A hash is
of an image's values and of what it says of itself; the report, without its times, has one too.

--save FILE: for the lines. --against FILE: an earlier run's; those that differ are told, and end it with status 1.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import bpy
import numpy as np
import OpenImageIO

context: Any = bpy.context  # whose scene and object the stubs take to be missing

ROOT = Path(__file__).resolve().parent.parent
SAMPLES = ("suzanne", "nook", "thousands", "thinwall", "foliage")
MODELS = ("spot.obj", "stanford-bunny.obj", "rocker-arm.obj")
_RAYS = ("--rays", "16", "--seed", "7", "--size", "96x64", "--format", "exr", "--depth", "32")
_ALL_MAPS = ("--maps", "ao", "ro", "bent", "light", "light-share", "--ro-exponent", "10", "100", "--code", "sh_3")
_VIEW = ("--maps", "ro", "light", "--ro-direction", "camera", "--ro-horizon")
_REACH = ("--distance", "0.8", "--falloff", "smooth", "--min-distance", "0.01", "--spread", "120", "--front-faces")
_TIMES = ("seconds", "embree", "threads")


@dataclass(frozen=True)
class Case:
    """One run of the command. scene: a file; options: beside where it writes to."""

    name: str
    scene: Path
    options: tuple[str, ...]
    colors: bool = False


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--models", type=Path, help=f"a folder with {', '.join(MODELS)}")
    parser.add_argument("--scenes", type=Path, help="a folder for the scenes, which are made where they are missing")
    parser.add_argument("--save", type=Path, help="for the lines, without what Blender prints beside them")
    parser.add_argument("--against", type=Path, help="an earlier run's saved lines")
    chosen = parser.parse_args()
    # Blender's threads add up the normals of modifiers' faces in the order that they come to them: one alone keeps it.
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})
    lines = []
    with tempfile.TemporaryDirectory(prefix="occlusion-bake-") as folder:
        scenes = Path(folder, "scenes") if chosen.scenes is None else chosen.scenes
        scenes.mkdir(parents=True, exist_ok=True)
        for case in cases(scenes, chosen.models):
            for line in results(case, Path(folder, "out", case.name)):
                print(line, flush=True)
                lines.append(line)
    if chosen.save is not None:
        chosen.save.write_text("".join(f"{line}\n" for line in lines), encoding="utf-8")
    return 0 if chosen.against is None else compared(lines, chosen.against.read_text(encoding="utf-8").splitlines())


def compared(lines: list[str], before: list[str]) -> int:
    """The lines that are in one of the two runs alone, told; the status to end with."""
    gone, new = sorted(set(before) - set(lines)), sorted(set(lines) - set(before))
    for mark, differing in (("-", gone), ("+", new)):
        for line in differing:
            print(mark, line)
    print(f"{len(lines)} results, {'all as before' if not gone + new else f'{len(new)} of them others'}")
    return 1 if gone + new else 0


def cases(folder: Path, models: Path | None) -> Iterator[Case]:
    """All runs, cheap ones first. folder: for the scenes."""
    udim, highs = _written(folder / "udim.blend", _udim), _written(folder / "highs.blend", _highs)
    for name in SAMPLES:
        _written(folder / f"{name}.blend", partial(_sample, folder, name))
    yield Case("udim", udim, (*_RAYS, "--maps", "ao", "bent", "--code", "mask_8"))
    yield Case("udim_first", udim, (*_RAYS, "--udim", "stacked", "--quality", "draft")[2:])
    yield Case("highs", highs, (*_RAYS, "--objects", "Rock_low", "--pairs", "--maps", "ao", "ro", "bent"))
    yield Case("cage", highs, (*_RAYS, "--objects", "Rock_low", "--highs", "Rock_high", "--cage", "Rock_cage"))
    yield Case("smart", highs, (*_RAYS, "--uv", "smart", "--ground", "--occluders", "self"))
    nook = folder / "nook.blend"
    yield Case("colors", nook, ("--rays", "16", "--maps", "ao", "ro"), colors=True)
    yield Case("atlas", nook, (*_RAYS, "--atlas", "All", "--maps", "ao", "bent", "--uv", "charts", "--code", "sh_1"))
    yield Case("reach", nook, (*_RAYS, *_REACH, "--bent-space", "world", "--bent-y", "down", "--bent-alpha"))
    yield Case("normal_maps", nook, (*_RAYS, "--normal-maps", "--maps", "ao", "bent", "--bent-space", "object"))
    yield Case("integers", nook, ("--rays", "16", "--size", "64", "--depth", "8", "--dither", "--code", "mask_16"))
    yield Case("cells", nook, (*_RAYS, "--code", "cells_8", "--code-rays", "512"))
    for horizon in ("keep", "divide"):
        yield Case(f"view_{horizon}", folder / "suzanne.blend", (*_RAYS, *_VIEW, horizon))
    for sampler in ("uniform_hemisphere", "uniform_sphere"):
        yield Case(sampler, folder / "suzanne.blend", (*_RAYS, "--sampler", sampler))
    for name in SAMPLES:
        yield Case(name, folder / f"{name}.blend", (*_RAYS, *_ALL_MAPS))
        yield Case(
            f"{name}_draft", folder / f"{name}.blend", ("--quality", "draft", "--size", "128", "--maps", "ao", "ro")
        )
    for name in MODELS if models is not None else ():
        assert models is not None
        yield Case(f"{Path(name).stem}", models / name, (*_RAYS, "--maps", "ao", "ro", "bent"))
        yield Case(f"{Path(name).stem}_good", models / name, ("--size", "128", "--seed", "3", "--format", "tiff"))


def results(case: Case, folder: Path) -> Iterator[str]:
    """Run a case; a line for each image, color attribute and report."""
    report, scene = folder / "report.json", folder / "colors.blend"
    folder.mkdir(parents=True)
    where = ["--color-attributes", str(scene)] if case.colors else ["--output", str(folder)]
    command = [sys.executable, "-m", "occlusion_bake", str(case.scene), *case.options, *where, "--report", str(report)]
    ran = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)
    yield f"{case.name} status {ran.returncode}"
    said = [line for line in ran.stderr.splitlines() if line.startswith("occlusion_bake: ")]
    yield f"{case.name} said {_hash(repr(_placeless(said, folder)).encode())}"
    for path in sorted(folder.iterdir()):
        if path.suffix in (".exr", ".png", ".tif"):
            yield f"{case.name} {path.name} {_image_hash(path)}"
    if case.colors:
        yield from (f"{case.name} {line}" for line in _color_hashes(scene))
    if report.exists():
        told = json.loads(report.read_text(encoding="utf-8"))
        yield f"{case.name} report {_hash(json.dumps(_placeless(_timeless(told), folder)).encode())}"


def _image_hash(path: Path) -> str:
    image = OpenImageIO.ImageInput.open(str(path))
    values = np.ascontiguousarray(image.read_image(image.spec().format))
    description = image.spec().getattribute("ImageDescription")
    image.close()
    return _hash(values.tobytes(), str(values.shape).encode(), str(description).encode())


def _color_hashes(scene: Path) -> Iterator[str]:
    bpy.ops.wm.open_mainfile(filepath=str(scene), load_ui=False)
    for mesh in bpy.data.meshes:
        attributes: Any = mesh.color_attributes
        for attribute in attributes:
            colors = np.empty(4 * len(attribute.data), dtype=np.float32)
            attribute.data.foreach_get("color", colors)
            yield f"{mesh.name} {attribute.name} {_hash(colors.tobytes())}"


def _timeless(told: Any) -> Any:
    """A report without what changes from run to run."""
    if isinstance(told, dict):
        return {key: _timeless(value) for key, value in told.items() if key not in _TIMES}
    return [_timeless(each) for each in told] if isinstance(told, list) else told


def _placeless(told: Any, folder: Path) -> Any:
    """The same without the folder's name."""
    return json.loads(json.dumps(told).replace(str(folder.parent), ""))


def _hash(*parts: bytes) -> str:
    return hashlib.blake2b(b"\0".join(parts), digest_size=12).hexdigest()


def _written(path: Path, fill: Callable[[], None]) -> Path:
    """A scene of its own, saved, unless it is there. Its bevels are applied: Blender makes others each time."""
    if path.exists():
        return path
    bpy.ops.wm.read_factory_settings(use_empty=True)
    fill()
    depsgraph = bpy.context.evaluated_depsgraph_get()
    for obj in bpy.data.objects:
        if any(modifier.type == "BEVEL" for modifier in obj.modifiers):
            obj.data = bpy.data.meshes.new_from_object(obj.evaluated_get(depsgraph))
            obj.modifiers.clear()
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    return path


def _sample(folder: Path, name: str) -> None:
    """One of the sample scenes, open."""
    with tempfile.TemporaryDirectory(dir=folder) as own:
        subprocess.run([sys.executable, "-m", "occlusion_bake.samples", name, "--folder", own], check=True)
        bpy.ops.wm.open_mainfile(filepath=str(Path(own, f"{name}.blend")), load_ui=False)


def _udim() -> None:
    """Two crossed squares, each in a tile of its own."""
    vertices = [(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0), (-1, 0, 0), (1, 0, 0), (1, 0, 1), (-1, 0, 1)]
    mesh = bpy.data.meshes.new("Tiles")
    mesh.from_pydata(vertices, [], [(0, 1, 2, 3), (4, 5, 6, 7)])
    square = [(0.1, 0.1), (0.9, 0.1), (0.9, 0.9), (0.1, 0.9)]
    places = [*square, *((u + 1.0, v) for u, v in square)]
    layer = mesh.uv_layers.new(name="UVMap")
    for loop, place in zip(layer.uv, places, strict=True):
        loop.vector = place
    context.scene.collection.objects.link(bpy.data.objects.new("Tiles", mesh))


def _highs() -> None:
    """A low cube, the same with rounded edges, and a cage about it."""
    for name, size in (("Rock_low", 2.0), ("Rock_high", 2.0), ("Rock_cage", 2.2)):
        bpy.ops.mesh.primitive_cube_add(size=size)
        context.object.name = name
    high: Any = bpy.data.objects["Rock_high"].modifiers.new("Bevel", "BEVEL")
    high.width, high.segments = 0.3, 4
    bpy.data.objects["Rock_cage"].hide_render = True


if __name__ == "__main__":
    sys.exit(main())

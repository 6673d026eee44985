"""Try a .glb with our occlusion texture in Khronos' glTF validator and in a page of three.js.

try_engines.py [PICTURE]    PICTURE: where the screenshot of the page goes (docs/pictures/three_js.png)

Wants node, npm and a Chromium; the packages of tools/engines/package.json are installed into build/engines. Where
something of this is missing, it says so, and that is no failure. Run by the Python that has Blender as a module.
"""

from __future__ import annotations

import base64
import json
import shutil
import struct
import subprocess
import sys
import traceback
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NoReturn

import numpy as np
from numpy.typing import NDArray

ROOT = Path(__file__).resolve().parent.parent
SOURCES = ROOT / "tools" / "engines"
WORK = ROOT / "build" / "engines"
PICTURE = ROOT / "docs" / "pictures" / "three_js.png"
CHROMIUMS = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
NAMES = ("the floor, on UV map 0", "the head, on UV map 1")

SAMPLES = 4000  # pixels that are compared
TOLERANCE = 1.0 / 255.0  # Blender's exporter makes 8 bits of our floats, a texel off by up to a step
DARK, OPEN = 0.5, 0.95  # there must be darker and lighter pixels than these, or nothing was shown
TIMEOUT = 300

Doubles = NDArray[np.float64]


def main(arguments: Sequence[str]) -> int:
    picture = Path(arguments[0]) if arguments else PICTURE
    chromium = next(filter(None, map(shutil.which, CHROMIUMS)), None)
    missing = [name for name in ("node", "npm") if shutil.which(name) is None] + ([] if chromium else ["Chromium"])
    if missing:
        return skipped(f"there is no {', no '.join(missing)}")
    if trouble := installed():
        return skipped(f"npm cannot install the packages of tools/engines: {trouble}")
    from engine_scene import make_glb  # loads Blender

    glb = WORK / "scene.glb"
    occlusion = make_glb(glb)
    check_channels(glb)
    validate(glb)
    shown = show(str(chromium), glb, picture)
    points, ratios = sampled(shown["pixels"])
    values, owners = occlusion.at(points)
    for owner, name in enumerate(NAMES):
        mine = owners == owner
        print(f"three.js shows {name}: {compared(ratios[mine], values[mine])}")
    return 0


def skipped(cause: str) -> int:
    print(f"SKIPPED: {cause}", flush=True)
    return 0


class Failed(Exception):
    """Something is not as it should be."""


def installed() -> str:
    """Bring tools/engines and its packages into build/engines. Returns npm's complaint, or nothing."""
    shutil.copytree(SOURCES, WORK, dirs_exist_ok=True)
    lock, stamp = (SOURCES / "package-lock.json").read_text(encoding="utf-8"), WORK / "node_modules" / ".stamp"
    if stamp.is_file() and stamp.read_text(encoding="utf-8") == lock:
        return ""
    command = ["npm", "ci", "--ignore-scripts", "--no-audit", "--no-fund"]
    run = subprocess.run(command, cwd=WORK, capture_output=True, text=True, timeout=TIMEOUT)
    if run.returncode:
        return run.stderr.strip().split("\n")[0]
    stamp.write_text(lock, encoding="utf-8")
    return ""


def node(script: str, *arguments: str) -> Any:
    """What a script of ours prints, as JSON. Raises Failed where it fails."""
    run = subprocess.run(["node", str(WORK / script), *arguments], capture_output=True, text=True, timeout=TIMEOUT)
    if run.returncode:
        raise Failed(f"{script}: {run.stderr.strip()}")
    return json.loads(run.stdout)


def check_channels(glb: Path) -> None:
    """Both materials have an occlusion texture, the head's on its second UV map."""
    materials = {each["name"]: each["occlusionTexture"] for each in described(glb)["materials"]}
    channels = {name: texture.get("texCoord", 0) for name, texture in materials.items()}
    if sorted(channels.values()) != [0, 1]:
        raise Failed(f"the occlusion textures are on UV maps {channels}, not on 0 and 1")
    print(f"{glb.name}: occlusion textures on UV maps {channels}")


def described(glb: Path) -> Any:
    """The JSON of a .glb: after a header of 12 bytes, the first chunk, its length before its type."""
    data = glb.read_bytes()
    (length,) = struct.unpack_from("<I", data, 12)
    return json.loads(data[20 : 20 + length])


def validate(glb: Path) -> None:
    """Neither errors nor warnings."""
    issues = node("validate.mjs", str(glb))
    if issues["numErrors"] or issues["numWarnings"]:
        raise Failed(f"the validator: {json.dumps(issues['messages'], indent=1)}")
    told = sorted({message["code"] for message in issues["messages"]})
    print(f"the validator: no errors, no warnings; remarks: {', '.join(told) or 'none'}")


def show(chromium: str, glb: Path, picture: Path) -> Any:
    """Show it in three.js, and keep a picture of that."""
    picture.parent.mkdir(parents=True, exist_ok=True)
    shown = node("show.mjs", chromium, str(glb), str(picture.resolve()))
    if shown["troubles"] or sorted(mesh["channel"] for mesh in shown["meshes"]) != [0, 1]:
        raise Failed(f"the page: {shown['troubles'] or shown['meshes']}")
    return shown


def sampled(pixels: dict[str, str]) -> tuple[Doubles, Doubles]:
    """Of pixels that show something: the points they show, (N, 3), and how much light AO leaves there, (N,)."""
    place, without, lit = (_decoded(pixels[name]) for name in ("place", "without", "with"))
    covered = np.flatnonzero((place[:, 3] > 0.0) & (without[:, 0] > 0.0))
    chosen = np.random.default_rng(0).choice(covered, min(SAMPLES, len(covered)), replace=False)
    return place[chosen, :3], lit[chosen, 0] / without[chosen, 0]


def _decoded(text: str) -> Doubles:
    return np.frombuffer(base64.b64decode(text), dtype="<f4").reshape(-1, 4).astype(np.float64)


def compared(ratios: Doubles, values: Doubles) -> str:
    """Whether three.js leaves as much light as was baked, pixel by pixel, in words. Raises Failed where not.

    ratios: (N,), light with AO by light without. values: (N,), AO as baked, where those pixels are.
    """
    differences = np.abs(ratios - values)
    within = float(np.quantile(differences, 0.99))
    words = (
        f"of {len(ratios)} pixels 99 in 100 are within {within:.5f} of the baked AO, which is {values.min():.3f} to "
        f"{values.max():.3f}; the mean differs by {abs(float(np.mean(ratios - values))):.5f}"
    )
    if within > TOLERANCE or values.min() > DARK or values.max() < OPEN:
        raise Failed(words)
    return words


def main_and_leave() -> NoReturn:
    """With Blender in it a process cannot end in the ordinary way."""
    from occlusion_bake.addon.cli.hard_exit import leave

    status = 1
    try:
        status = main(sys.argv[1:])
    except Failed as failure:
        print(f"FAILED: {failure}", file=sys.stderr)
    except Exception:
        traceback.print_exc()
    leave(status)


if __name__ == "__main__":
    main_and_leave()

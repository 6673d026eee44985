"""Our occlusion texture in glTF: Khronos' validator has nothing to say, and three.js shows what was baked."""

from __future__ import annotations

import importlib.util
import json
import os
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

TOOLS = Path(__file__).resolve().parents[2] / "tools"


def loaded(name: str) -> Any:
    """A tool as a module."""
    spec = importlib.util.spec_from_file_location(name, TOOLS / f"{name}.py")
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def run(*arguments: str, **environment: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, str(TOOLS / "try_engines.py"), *arguments]
    return subprocess.run(command, env={**os.environ, **environment}, capture_output=True, text=True, timeout=280)


def test_the_validator_and_three_js_take_it_as_it_was_baked(tmp_path: Path) -> None:
    pytest.importorskip("bpy")
    picture = tmp_path / "page.png"
    tried = run(str(picture))
    if skipped := re.search(r"^SKIPPED: .*", tried.stdout, re.MULTILINE):
        pytest.skip(skipped[0])
    assert tried.returncode == 0, tried.stdout + tried.stderr
    assert "the validator: no errors, no warnings" in tried.stdout
    for surface in ("the floor, on UV map 0", "the head, on UV map 1"):
        (found,) = re.findall(rf"{surface}: of (\d+) pixels 99 in 100 are within ([\d.]+)", tried.stdout)
        assert int(found[0]) > 1000 and float(found[1]) <= 1.0 / 255.0
    assert picture.read_bytes().startswith(b"\x89PNG")


def test_what_is_missing_is_said_aloud_and_is_no_failure(tmp_path: Path) -> None:
    tried = run(str(tmp_path / "page.png"), PATH=str(tmp_path))
    assert tried.returncode == 0 and tried.stdout == "SKIPPED: there is no node, no npm, no Chromium\n"
    assert not list(tmp_path.iterdir())


@pytest.fixture(scope="module")
def tool() -> Any:
    return loaded("try_engines")


BAKED = np.linspace(0.1, 1.0, 1000)


def test_what_was_baked_passes(tool: Any) -> None:
    noise = np.random.default_rng(1).uniform(-0.5, 0.5, len(BAKED)) / 255.0
    assert "99 in 100" in tool.compared(BAKED + noise, BAKED)


@pytest.mark.parametrize(
    "shown",
    [
        BAKED[::-1],  # upside down
        np.ones_like(BAKED),  # not shown at all
        BAKED ** (1.0 / 2.2),  # as a colour
        0.5 + 0.5 * BAKED,  # of half the strength
        BAKED + 1.1 / 255.0,  # a step too light
    ],
)
def test_what_is_shown_otherwise_fails(tool: Any, shown: Any) -> None:
    with pytest.raises(tool.Failed):
        tool.compared(shown, BAKED)


@pytest.mark.parametrize("flat", [np.linspace(0.96, 1.0, 1000), np.linspace(0.1, 0.9, 1000)])
def test_a_view_without_dark_or_open_pixels_proves_nothing(tool: Any, flat: Any) -> None:
    with pytest.raises(tool.Failed):
        tool.compared(flat, flat)


def test_texels_are_looked_up_as_a_texture_unit_does() -> None:
    pytest.importorskip("bpy")
    scene = loaded("engine_scene")
    image = np.array([[0.0, 1.0], [2.0, 3.0]])  # the bottom row first
    uv = np.array([[0.25, 0.25], [0.75, 0.25], [0.25, 0.75], [0.5, 0.5], [0.5, 0.25], [0.0, 0.25]])
    assert scene.bilinear(image, uv) == pytest.approx([0.0, 1.0, 2.0, 1.5, 0.5, 0.5])  # the last across the edge
    corners = np.array([[[0.0, 0.0, 1.0], [2.0, 0.0, 1.0], [0.0, 4.0, 1.0]]])
    assert scene.barycentric(corners, np.array([[0.5, 1.0, 1.0]]))[0] == pytest.approx([0.5, 0.25, 0.25])


def test_the_packages_are_pinned_and_tied_to_no_registry() -> None:
    wanted = json.loads((TOOLS / "engines" / "package.json").read_text(encoding="utf-8"))["dependencies"]
    text = (TOOLS / "engines" / "package-lock.json").read_text(encoding="utf-8")
    locked = {name: each for name, each in json.loads(text)["packages"].items() if name}
    assert {name.removeprefix("node_modules/"): each["version"] for name, each in locked.items()} == wanted
    assert all(each["integrity"].startswith("sha512-") for each in locked.values())
    assert "resolved" not in text and "://" not in text

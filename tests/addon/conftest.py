"""Blender's state around a test, and the command run on the open scene."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

SMALL = ("--size", "64", "--margin", "2")
FEW_RAYS = ("--rays", "4")


@pytest.fixture(scope="module")
def registered() -> Iterator[None]:
    """The add-on, as in a Blender where it is enabled."""
    pytest.importorskip("bpy")
    import occlusion_bake

    occlusion_bake.register()
    yield
    occlusion_bake.unregister()


@pytest.fixture
def empty_scene() -> Iterator[None]:
    bpy = pytest.importorskip("bpy")
    # read_factory_settings reads the preferences, too, which takes five times as long
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    yield
    if bpy.context.object and bpy.context.object.mode != "OBJECT":
        bpy.ops.object.mode_set(mode="OBJECT")


@pytest.fixture
def charts_here(monkeypatch: pytest.MonkeyPatch) -> None:
    """Charts are made in this process, which saves the start of another: for tests of what becomes of them."""
    pytest.importorskip("bpy")
    from occlusion_bake.addon.charts import chart_layout
    from occlusion_bake.core.charts.existing import side_by_side
    from occlusion_bake.core.charts.unwrap import unwrap

    def here(make: Callable[..., Any]) -> Callable[..., Any]:
        return lambda *arguments, child, **options: make(*arguments, **options)

    monkeypatch.setattr(chart_layout, "unwrap_in_process", here(unwrap))
    monkeypatch.setattr(chart_layout, "side_by_side_in_process", here(side_by_side))


@dataclass(frozen=True)
class Run:
    """What one run of the command came to."""

    status: int
    out: str
    err: str
    folder: Path  # the output folder, report.json in it

    @property
    def report(self) -> dict[str, Any]:
        return json.loads((self.folder / "report.json").read_text(encoding="utf-8"))

    @property
    def files(self) -> list[str]:
        return sorted(path.name for path in self.folder.rglob("*") if path.is_file())

    @property
    def lines(self) -> list[str]:
        """The command's own lines on stdout, less the name."""
        name = "occlusion_bake: "
        return [line.removeprefix(name) for line in self.out.splitlines() if line.startswith(name)]

    @property
    def complaint(self) -> str:
        """The one line on stderr, less the command's name."""
        assert self.err.count("\n") == 1 and self.err.startswith("occlusion_bake: "), self.err
        return self.err.removeprefix("occlusion_bake: ").strip()

    def refused(self, *words: str) -> str:
        """Assert that input was refused by one line with these words in it, and nothing was written."""
        assert self.status == 2, (self.status, self.out, self.err)
        assert not self.files
        for word in words:
            assert word in self.complaint
        return self.complaint


Bake = Callable[..., Run]


@pytest.fixture
def bake(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> Bake:
    """Run the command in this process on the open scene (saved first) or on a file; later words override earlier.

    effort: how far the bake goes; () for the command's own default.
    """
    pytest.importorskip("bpy")

    def run(*words: str, file: Path | str | None = None, report: bool = True, effort: Sequence[str] = FEW_RAYS) -> Run:
        import bpy
        from occlusion_bake.addon.cli.command import main

        if file is None:
            file = tmp_path / "scene.blend"
            bpy.ops.wm.save_as_mainfile(filepath=str(file), check_existing=False)
        folder = tmp_path / "out"
        reporting = ("--report", str(folder / "report.json")) if report else ()
        capfd.readouterr()
        status = main([str(file), *SMALL, *effort, "--output", str(folder), *reporting, *words])
        return Run(status, *capfd.readouterr(), folder)

    return run


@pytest.fixture
def start(tmp_path: Path) -> Iterator[Callable[..., subprocess.Popen[str]]]:
    """Start the command as a process of its own, as a person does: python -m occlusion_bake …, in an empty folder. None
    outlives the test."""
    started: list[subprocess.Popen[str]] = []

    def popen(*words: str, environment: dict[str, str] | None = None, **options: Any) -> subprocess.Popen[str]:
        import occlusion_bake

        home = str(Path(occlusion_bake.__path__[0]).absolute().parent)
        path = os.pathsep.join(filter(None, (home, os.environ.get("PYTHONPATH", ""))))
        child = subprocess.Popen(
            [sys.executable, "-m", "occlusion_bake", *words],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            encoding="utf-8",
            cwd=tmp_path,
            env={**os.environ, "PYTHONPATH": path, **(environment or {})},
            **options,
        )
        started.append(child)
        return child

    yield popen
    for child in started:
        child.kill()
        child.wait()

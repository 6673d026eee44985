"""Finding Embree, refusing what is not, and that it does not matter which one traces."""

from __future__ import annotations

import ctypes.util
import importlib.util
import re
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from occlusion_bake.core.base.errors import InputError
from occlusion_bake.core.rays import embree
from occlusion_bake.core.rays.embree import OVERRIDE, Device, candidates, open_device
from occlusion_bake.core.rays.map_spec import AO, reflection
from occlusion_bake.core.rays.texel_surface import TexelSurface
from occlusion_bake.core.rays.trace_scene import TraceScene
from occlusion_bake.core.rays.tracer import Sums, TraceOptions, trace
from occlusion_bake.core.scene.world_mesh import world_mesh
from occlusion_bake.core.texels.rasterize import rasterize
from occlusion_bake.tests.oracles import shapes

on_linux = pytest.mark.skipif(sys.platform != "linux", reason="other systems look bare names up in this folder, too")


def open_anew(threads: int = 1) -> Device:
    """Not the device that an earlier call has opened."""
    return embree._opened.__wrapped__(threads)


def library_of(package: str) -> str:
    """The Embree that a wheel brings; skips where there is none."""
    spec = importlib.util.find_spec(package)
    if spec is None or spec.origin is None:
        pytest.skip(f"{package} is not installed")
    site = Path(spec.origin).parents[1]
    found = [path for path in candidates() if Path(path).is_file() and Path(path).is_relative_to(site)]
    mine = [path for path in found if Path(path).relative_to(site).parts[0] in (package, f"{package}.libs")]
    if not mine:
        pytest.skip(f"{package} brings no Embree of its own")
    return mine[0]


def refusal(monkeypatch: pytest.MonkeyPatch, path: str) -> str:
    """What opening an Embree at this path is answered."""
    monkeypatch.setenv(OVERRIDE, path)
    with pytest.raises(InputError) as refused:
        open_anew()
    message = str(refused.value)
    assert "\n" not in message
    assert OVERRIDE in message
    return message


def stage_traced_by(device: Device) -> Sums:
    """AO and RO of a floor under a sphere."""
    floor, ball = shapes.plane(2.0), shapes.sphere((0.2, 0.1, 0.7), 0.6, 48)
    scene = TraceScene(device)
    for mesh in (floor, ball):
        scene.add(mesh.vertices, mesh.triangles)
    scene.commit()
    owner = rasterize("floor", floor.uv, 64, 64).owner
    surface = TexelSurface(world_mesh(shapes.instance(floor), np.zeros(3)), owner)
    return trace(scene, surface, [AO, reflection(10)], TraceOptions(64))


@on_linux
def test_the_candidates_end_with_a_bare_name() -> None:
    paths = list(candidates())
    assert all(Path(path).is_file() for path in paths[:-1])
    assert "embree4" in paths[-1] and Path(paths[-1]).name == paths[-1]


@on_linux
@pytest.mark.parametrize("program", ["", "blender", "./blender"])
def test_nothing_of_the_working_directory_is_a_candidate(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, program: str
) -> None:
    """Not beside a program without a folder, as Blender as a module has it, nor in a folder called as a package."""
    name = "libembree4.so.4"
    for place in ("lib", "blender.shared", "../Resources/lib", "embreex", "embreex/lib", "embreex.libs"):
        folder = tmp_path / "here" / place
        folder.mkdir(parents=True)
        (folder / name).touch()
    monkeypatch.chdir(tmp_path / "here")
    monkeypatch.setattr(sys, "path", [str(tmp_path / "here")])
    importlib.invalidate_caches()
    monkeypatch.setitem(sys.modules, "bpy", blender_at(program))
    assert list(candidates()) == [name]


@pytest.mark.parametrize("platform", ["win32", "darwin"])
def test_no_bare_name_where_the_system_would_look_it_up_here(monkeypatch: pytest.MonkeyPatch, platform: str) -> None:
    monkeypatch.setattr(sys, "platform", platform)
    monkeypatch.setattr("occlusion_bake.core.rays.embree.find_library", lambda name: f"{name}.dll")
    assert all(Path(path).is_absolute() for path in candidates())


def test_the_fastest_comes_first() -> None:
    assert next(candidates()) == library_of("embreex")


def test_the_device_says_what_it_is() -> None:
    device = open_device()
    assert device is open_device()
    major, minor, _ = (int(part) for part in device.version.split("."))
    assert (major, minor) >= (4, 3)
    assert device.native_width in (1, 4, 8, 16)
    assert device.vector_width in (4, 8, 16)
    widths = f"{device.native_width}-wide packets, {device.vector_width}-wide vectors"
    assert device.description == f"{device.version}, {widths}, {device.path}"


@pytest.mark.skipif(not Path("/proc/cpuinfo").exists(), reason="Linux alone says in a file what its processor has")
def test_the_kernel_runs_the_widest_vectors_that_the_processor_has() -> None:
    found = re.search(r"^flags\s*:(.*)$", Path("/proc/cpuinfo").read_text(), re.MULTILINE)
    has = set(found[1].split()).issuperset if found else (lambda names: False)
    wide = has({"avx2", "fma", "bmi2"})
    wider = wide and has({"avx512f", "avx512bw", "avx512dq", "avx512vl"})
    assert open_device().vector_width == (16 if wider else 8 if wide else 4)


def test_a_chosen_library_is_taken(monkeypatch: pytest.MonkeyPatch) -> None:
    chosen = open_device().path
    monkeypatch.setenv(OVERRIDE, chosen)
    assert open_anew().path == chosen


def test_a_wrong_path_is_named(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    path = str(tmp_path / "libembree4.so.4")
    assert path in refusal(monkeypatch, path)


def test_a_file_that_is_no_library_is_named(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    path = tmp_path / "libembree4.so.4"
    path.write_text("not a library")
    assert str(path) in refusal(monkeypatch, str(path))


def test_a_library_that_is_no_embree_is_told_what_it_lacks(monkeypatch: pytest.MonkeyPatch) -> None:
    other = ctypes.util.find_library("m") or "msvcrt.dll"
    message = refusal(monkeypatch, other)
    assert other in message and "rtcNewDevice" in message


def test_no_embree_at_all_names_the_cure(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv(OVERRIDE, raising=False)
    monkeypatch.setattr("occlusion_bake.core.rays.embree.candidates", lambda: iter(["nowhere/libembree4.so"]))
    with pytest.raises(InputError, match=f"nowhere/libembree4.so.*reinstall.*{OVERRIDE}"):
        open_anew()


def test_a_kernel_that_cannot_be_loaded_is_no_fault_of_embree(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse() -> None:
        raise InputError("the occlusion kernel cannot be loaded: it is not installed; reinstall the extension")

    monkeypatch.setattr("occlusion_bake.core.rays.embree.library", refuse)
    with pytest.raises(InputError, match=r"^the occlusion kernel cannot be loaded") as refused:
        open_anew()
    assert "Embree" not in str(refused.value)


def test_a_broken_candidate_is_passed_over(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv(OVERRIDE, raising=False)
    working = open_device().path
    monkeypatch.setattr("occlusion_bake.core.rays.embree.candidates", lambda: iter(["nowhere/libembree4.so", working]))
    assert open_anew().path == working


def test_blenders_own_embree_traces_the_same_picture() -> None:
    ours, blenders = Device(library_of("embreex"), 2), Device(library_of("bpy"), 2)
    assert ours.path != blenders.path
    first, second = (stage_traced_by(device).all for device in (ours, blenders))
    different = first != second  # rays that graze an edge
    assert np.mean(different) < 0.005
    assert np.abs(first - second).max() <= 2.0


@pytest.mark.parametrize(
    ("system", "program", "library"),
    [
        ("linux", "blender", "lib/libembree4.so.4"),
        ("win32", "blender.exe", "blender.shared/embree4.dll"),
        ("darwin", "Blender.app/Contents/MacOS/Blender", "Blender.app/Contents/Resources/lib/libembree4.dylib"),
    ],
)
def test_an_official_blender_is_searched(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, system: str, program: str, library: str
) -> None:
    place = tmp_path / library
    place.parent.mkdir(parents=True)
    place.touch()
    monkeypatch.setattr(sys, "platform", system)
    monkeypatch.setattr("occlusion_bake.core.rays.embree.find_library", lambda name: None)
    monkeypatch.setitem(sys.modules, "bpy", blender_at(tmp_path / program))
    assert str(place) in {str(Path(path).resolve()) for path in candidates()}


@pytest.mark.parametrize(
    ("system", "folder", "library", "beside"),
    [
        ("linux", "embreex.libs", "libembree4-4aef3270.so.4", "libtbb-f3478d83.so.12"),
        ("win32", "embreex.libs", "embree4.dll", "tbb12.dll"),
        ("darwin", "embreex/.dylibs", "libembree4.4.dylib", "libtbb.12.11.dylib"),
    ],
)
def test_the_wheel_is_searched_as_it_is_laid_out_on_each_system(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, system: str, folder: str, library: str, beside: str
) -> None:
    """Names as embreex 4.4.0.post1 has them; what it loads is beside it, and no candidate."""
    (tmp_path / "embreex").mkdir()
    (tmp_path / "embreex" / "__init__.py").touch()
    place = tmp_path / folder
    place.mkdir(exist_ok=True)
    for name in (library, beside):
        (place / name).touch()
    monkeypatch.setattr(sys, "platform", system)
    monkeypatch.setattr("occlusion_bake.core.rays.embree.find_library", lambda name: None)
    monkeypatch.setattr(sys, "path", [str(tmp_path), *sys.path])
    monkeypatch.delitem(sys.modules, "embreex", raising=False)
    importlib.invalidate_caches()
    first, *others = candidates()
    assert Path(first) == place / library
    assert not any(beside in path for path in others)


def blender_at(program: Path | str) -> Any:
    """As much of bpy as the search looks at."""
    spec = importlib.util.spec_from_loader("bpy", loader=None)
    module = importlib.util.module_from_spec(spec) if spec else None
    assert module is not None
    module.app = type("App", (), {"binary_path": str(program)})  # type: ignore[attr-defined]
    return module

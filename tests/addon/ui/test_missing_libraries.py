"""A library that cannot be loaded is told of in the panel, which is there all the same."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace
from unittest.mock import MagicMock

import pytest

bpy = pytest.importorskip("bpy")

from occlusion_bake.addon.ui.missing_libraries import missing_libraries  # noqa: E402
from occlusion_bake.addon.ui.panel import OCCLUSION_BAKE_PT_bake  # noqa: E402

# For a process of its own: a library that was loaded stays so.
_PRELUDE = """
import sys
from pathlib import Path
import bpy, occlusion_bake
"""
_NO_KERNEL = """
import occlusion_bake_kernel
occlusion_bake_kernel.library_path = lambda: Path(sys.argv[1])
"""
_NO_OPENIMAGEIO = """
sys.modules["OpenImageIO"] = None
"""
_REGISTERED = """
occlusion_bake.register()
from occlusion_bake.addon.ui.missing_libraries import missing_libraries
print("there:", hasattr(bpy.types, "OCCLUSION_BAKE_PT_bake"))
print(*missing_libraries(), sep="\\n", flush=True)
occlusion_bake.unregister()
from occlusion_bake.addon.cli.hard_exit import leave
leave(0)
"""


def missing_where(broken: str, path: Path) -> list[str]:
    """What is said to be missing where a library is broken so."""
    program = _PRELUDE + broken + _REGISTERED
    ran = subprocess.run([sys.executable, "-c", program, str(path)], capture_output=True, text=True, check=True)
    _, _, told = ran.stdout.partition("there: True\n")
    assert told, ran.stdout
    return [line for line in told.splitlines() if "cannot be loaded" in line]


def test_here_nothing_is_missing() -> None:
    assert missing_libraries.__wrapped__() == ()


def test_a_kernel_of_another_system(tmp_path: Path) -> None:
    path = tmp_path / "libocclusion_kernel.so"
    path.write_bytes(b"MZ of another system" + bytes(4096))
    (line,) = missing_where(_NO_KERNEL, path)
    assert line.startswith("the occlusion kernel cannot be loaded: ")
    if sys.platform == "linux":
        assert "it is made for another system or processor; install the extension's zip for Linux on" in line


def test_no_openimageio(tmp_path: Path) -> None:
    (line,) = missing_where(_NO_OPENIMAGEIO, tmp_path)
    assert line.startswith("OpenImageIO cannot be loaded") and "reinstall the extension" in line


def test_it_is_said_in_the_panel_before_a_bake(registered: None, monkeypatch: pytest.MonkeyPatch) -> None:
    said = "the occlusion kernel cannot be loaded: it is made for another system or processor; install the other zip"
    monkeypatch.setattr("occlusion_bake.addon.ui.panel.missing_libraries", lambda: (said,))
    context = SimpleNamespace(
        scene=bpy.context.scene,
        window_manager=bpy.context.window_manager,
        preferences=SimpleNamespace(system=SimpleNamespace(ui_scale=1.0)),
        region=SimpleNamespace(width=300),
    )
    panel = SimpleNamespace(layout=MagicMock())
    OCCLUSION_BAKE_PT_bake.draw(panel, context)
    labels = [call.kwargs for call in panel.layout.column().label.call_args_list]
    assert " ".join(label["text"].strip() for label in labels) == said
    assert [label["icon"] for label in labels] == ["ERROR", *["BLANK1"] * (len(labels) - 1)]

"""An unwrap in a process of its own gives what it would give here, can be stopped, and leaves nothing behind."""

from __future__ import annotations

import errno
import os
import subprocess
import sys
import threading
from collections.abc import Iterator
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from occlusion_bake.core.base.errors import Cancelled, InputError, NoUnwrapper
from occlusion_bake.core.charts import unwrap_process
from occlusion_bake.core.charts.unwrap import Charts, unwrap
from occlusion_bake.core.charts.unwrap_process import unwrap_in_process
from occlusion_bake.tests.oracles.chart_layouts import cube, waves

pytest.importorskip("xatlas")

SETTINGS = (512, 4)  # size, padding
DEAF = "import time\nwhile True: time.sleep(1)"  # reads nothing, never ends
DYING = "import sys\nsys.exit('the child fell over')"


def never() -> bool:
    return False


def bits(result: Charts) -> dict[str, Any]:
    return {**asdict(result), "uv": result.uv.tobytes()}


@pytest.fixture
def children(monkeypatch: pytest.MonkeyPatch) -> Iterator[list[subprocess.Popen[bytes]]]:
    """The children that were started; at the end of a test none is left, as a process or as a zombie."""
    started: list[subprocess.Popen[bytes]] = []
    start = subprocess.Popen

    def spy(*arguments: Any, **options: Any) -> subprocess.Popen[bytes]:
        started.append(start(*arguments, **options))
        return started[-1]

    threads = threading.active_count()
    monkeypatch.setattr(subprocess, "Popen", spy)
    yield started
    assert threading.active_count() == threads
    for child in started:
        assert child.returncode is not None
        if os.name == "posix":
            with pytest.raises(ProcessLookupError):
                os.kill(child.pid, 0)


@pytest.fixture
def only_apart(monkeypatch: pytest.MonkeyPatch) -> None:
    """An unwrap in this process fails the test."""

    def here(*_: Any) -> Charts:
        raise AssertionError("unwrapped in this process")

    monkeypatch.setattr(unwrap_process, "unwrap", here)


@pytest.mark.usefixtures("only_apart")
@pytest.mark.parametrize("size", [512, (512, 256)])
def test_same_bits(size: int | tuple[int, int], children: list[Any]) -> None:
    mesh = waves(30, noise=0.1)
    assert bits(unwrap_in_process("waves", *mesh, size, 4, cancelled=never)) == bits(unwrap("waves", *mesh, size, 4))
    assert [child.returncode for child in children] == [0]


@pytest.mark.usefixtures("only_apart")
def test_no_polygons() -> None:
    vertices, triangles, _ = cube()
    result = unwrap_in_process("cube", vertices, triangles, None, *SETTINGS, cancelled=never)
    assert np.array_equal(result.uv, unwrap("cube", vertices, triangles, None, *SETTINGS).uv)


@pytest.mark.usefixtures("only_apart")
def test_other_threads_run_meanwhile(children: list[Any]) -> None:
    """`cancelled` is asked again and again while the child works, in the thread that asked for charts."""
    asked: list[int] = []

    def cancelled() -> bool:
        asked.append(threading.get_ident())
        return False

    unwrap_in_process("waves", *waves(60), *SETTINGS, cancelled=cancelled)
    assert set(asked) == {threading.get_ident()}
    assert len(asked) > 2
    assert len(children) == 1


@pytest.mark.usefixtures("only_apart")
def test_cancel_kills_the_child(children: list[Any]) -> None:
    answers = iter([False, False, True])  # a further question would be a StopIteration
    with pytest.raises(Cancelled):
        unwrap_in_process("waves", *waves(300, noise=0.2), *SETTINGS, cancelled=lambda: next(answers))
    assert len(children) == 1
    assert children[0].returncode != 0, "it was left to finish"


@pytest.mark.usefixtures("only_apart")
def test_cancel_ends_a_child_that_does_not_listen(monkeypatch: pytest.MonkeyPatch, children: list[Any]) -> None:
    """The arguments are more than a pipe holds, so the sender is stuck as well."""
    monkeypatch.setattr(unwrap_process, "_BOOT", DEAF)
    with pytest.raises(Cancelled):
        unwrap_in_process("waves", *waves(300), *SETTINGS, cancelled=lambda: len(children) > 0)
    assert len(children) == 1


def test_cancelled_before_it_began(children: list[Any]) -> None:
    with pytest.raises(Cancelled):
        unwrap_in_process("cube", *cube(), *SETTINGS, cancelled=lambda: True)
    assert children == []


@pytest.mark.usefixtures("only_apart")
def test_a_fault_in_cancelled_ends_the_child(children: list[Any]) -> None:
    def cancelled() -> bool:
        if children:
            raise KeyboardInterrupt
        return False

    with pytest.raises(KeyboardInterrupt):
        unwrap_in_process("waves", *waves(100), *SETTINGS, cancelled=cancelled)


@pytest.mark.usefixtures("only_apart")
def test_input_error_comes_through(children: list[Any]) -> None:
    vertices, triangles, polygons = cube()
    with pytest.raises(InputError) as here:
        unwrap("Würfel", vertices * np.float32(0), triangles, polygons)
    with pytest.raises(InputError) as there:
        unwrap_in_process("Würfel", vertices * np.float32(0), triangles, polygons, *SETTINGS, cancelled=never)
    assert str(there.value) == str(here.value)
    assert len(children) == 1


NOISY = """
import os, sys
os.write(1, b"progress")
os.write(2, b"progress" * 50_000)
print("progress", flush=True)
sys.path.remove(os.path.dirname(__file__))
del sys.modules["xatlas"]
import xatlas
"""


@pytest.mark.usefixtures("only_apart")
def test_a_library_that_prints_does_no_harm(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    (tmp_path / "xatlas.py").write_text(NOISY)
    monkeypatch.setattr(sys, "path", [str(tmp_path), *sys.path])
    assert unwrap_in_process("cube", *cube(), *SETTINGS, cancelled=never).count == 6


@pytest.mark.usefixtures("only_apart")
@pytest.mark.skipif(os.name != "posix", reason="makes a symbolic link")
def test_the_folder_of_the_package_hides_nothing(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """Installed extensions lie side by side; one that is called like a library must not be taken for it."""
    (tmp_path / "numpy").mkdir()
    (tmp_path / "numpy" / "__init__.py").write_text("raise RuntimeError('not the real one')\n")
    (tmp_path / "occlusion_bake").symlink_to(Path(unwrap_process.__file__).absolute().parents[2])
    monkeypatch.setattr(
        unwrap_process, "__file__", str(tmp_path / "occlusion_bake" / "core" / "charts" / "unwrap_process.py")
    )
    assert unwrap_in_process("cube", *cube(), *SETTINGS, cancelled=never).count == 6


def no_interpreter() -> str:
    raise unwrap_process._NoAnswer("no python here")


def fallback(monkeypatch: pytest.MonkeyPatch, kind: str) -> None:
    if kind == "no interpreter":
        monkeypatch.setattr(unwrap_process, "_interpreter", no_interpreter)
    elif kind == "no program":
        monkeypatch.setattr(unwrap_process, "_interpreter", lambda: "/nowhere/python")
    elif kind == "other release":
        monkeypatch.setattr(unwrap_process, "_BOOT", unwrap_process._BOOT.replace("sys.version_info[:2]", "(2, 7)"))
    else:
        monkeypatch.setattr(unwrap_process, "_BOOT", DYING)


KINDS = ["no interpreter", "no program", "other release", "gives up"]


@pytest.mark.parametrize("kind", KINDS)
def test_fallback(kind: str, monkeypatch: pytest.MonkeyPatch, children: list[Any]) -> None:
    fallback(monkeypatch, kind)
    mesh = waves(10)
    assert bits(unwrap_in_process("waves", *mesh, *SETTINGS, cancelled=never)) == bits(
        unwrap("waves", *mesh, *SETTINGS)
    )
    assert all(child.returncode != 0 for child in children)


@pytest.mark.usefixtures("only_apart")
@pytest.mark.skipif(os.name != "posix", reason="ends processes by signals")
@pytest.mark.parametrize(
    ("end", "cause"),
    [
        ("os.kill(os.getpid(), signal.SIGKILL)", "out of memory"),
        ("os.abort()", "ended"),
        ("raise MemoryError", "memory"),
        ("raise ImportError", "no xatlas"),
    ],
)
def test_what_ends_the_child_does_not_happen_here(
    end: str, cause: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    (tmp_path / "xatlas.py").write_text(f"import os, signal\n{end}\n")
    monkeypatch.setattr(sys, "path", [str(tmp_path), *sys.path])
    with pytest.raises(NoUnwrapper, match=f"^Suzanne: .*{cause}.*--uv smart"):
        unwrap_in_process("Suzanne", *cube(), *SETTINGS, cancelled=never)


@pytest.mark.usefixtures("only_apart")
@pytest.mark.parametrize("boot", ["import os\nos.abort()", None], ids=["before it listens", "never started"])
def test_nor_what_ends_it_before_it_begins(boot: str | None, monkeypatch: pytest.MonkeyPatch) -> None:
    if boot is None:
        monkeypatch.setattr(subprocess, "Popen", no_memory)
    else:
        monkeypatch.setattr(unwrap_process, "_BOOT", boot)
    with pytest.raises(NoUnwrapper):
        unwrap_in_process("cube", *cube(), *SETTINGS, cancelled=never)


def no_memory(*_: Any, **__: Any) -> Any:
    raise OSError(errno.ENOMEM, os.strerror(errno.ENOMEM))


def test_an_error_after_the_fallback_tells_of_the_child(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(unwrap_process, "_BOOT", DYING)

    def here(*_: Any) -> Charts:
        raise RuntimeError("and so did this process")

    monkeypatch.setattr(unwrap_process, "unwrap", here)
    with pytest.raises(RuntimeError) as caught:
        unwrap_in_process("cube", *cube(), *SETTINGS, cancelled=never)
    assert "the child fell over" in "\n".join(caught.value.__notes__)


@pytest.mark.usefixtures("only_apart")
def test_no_fallback_after_a_cancel(monkeypatch: pytest.MonkeyPatch) -> None:
    """A Ctrl-C ends the child and sets the wish to stop; nothing is unwrapped then."""
    monkeypatch.setattr(unwrap_process, "_interpreter", no_interpreter)
    answers = iter([False, True])
    with pytest.raises(Cancelled):
        unwrap_in_process("cube", *cube(), *SETTINGS, cancelled=lambda: next(answers))


def program(path: Path) -> str:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.touch(0o755)
    return str(path)


@pytest.mark.skipif(os.name != "posix", reason="lays out a Python as on Linux and macOS")
def test_interpreter(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """sys.executable where it is a Python, else the one at sys.prefix, else none; never Blender itself."""
    blender = program(tmp_path / "blender")
    own = program(tmp_path / "bundled" / "python3")
    monkeypatch.setattr(sys, "prefix", str(tmp_path / "prefix"))
    monkeypatch.setattr(sys, "executable", own)
    assert unwrap_process._interpreter() == own
    for useless in (blender, "", None, str(tmp_path / "python-gone"), str(tmp_path)):
        monkeypatch.setattr(sys, "executable", useless)
        with pytest.raises(unwrap_process._NoAnswer):
            unwrap_process._interpreter()
    release = "python{}.{}".format(*sys.version_info)
    beside = program(tmp_path / "prefix" / "bin" / release)
    assert unwrap_process._interpreter() == beside

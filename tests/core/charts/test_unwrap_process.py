"""An unwrap in a process of its own gives what it would give here, can be stopped, and leaves nothing behind."""

from __future__ import annotations

import errno
import os
import signal
import subprocess
import sys
import textwrap
import threading
import time
from collections.abc import Iterator
from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from occlusion_bake.core.base.errors import Cancelled, InputError, NoUnwrapper
from occlusion_bake.core.base.kernel_api import library
from occlusion_bake.core.charts import child_process, unwrap_process
from occlusion_bake.core.charts.child_process import Child
from occlusion_bake.core.charts.existing import ExistingCharts, side_by_side
from occlusion_bake.core.charts.udim import Udim
from occlusion_bake.core.charts.unwrap import Charts, unwrap
from occlusion_bake.core.charts.unwrap_process import side_by_side_in_process, unwrap_in_process
from occlusion_bake.tests.oracles.charts.hard_surface import cube
from occlusion_bake.tests.oracles.charts.organic import waves

SETTINGS = (512, 4)  # size, padding
DEAF = "import time\nwhile True: time.sleep(1)"  # reads nothing, never ends
GONE_QUIET = """
import os, pickle, sys, time
pickle.load(sys.stdin.buffer)
os.close(0), os.close(1)
time.sleep(3600)
"""
DYING = "import sys\nsys.exit('the child fell over')"


def quietly(*_: Any) -> None:
    """Whoever is told how far the work is lets it go on."""


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

    def here(*_: Any, **__: Any) -> Charts:
        raise AssertionError("unwrapped in this process")

    monkeypatch.setattr(unwrap_process, "unwrap", here)


@pytest.mark.usefixtures("only_apart")
@pytest.mark.parametrize("size", [512, (512, 256)])
def test_same_bits(size: int | tuple[int, int], children: list[Any]) -> None:
    mesh = waves(30, noise=0.1)
    assert bits(unwrap_in_process("waves", *mesh, size, 4, progress=quietly)) == bits(unwrap("waves", *mesh, size, 4))
    assert len(children) == 1


@pytest.mark.usefixtures("only_apart")
def test_one_child_is_asked_again_and_again(children: list[Any]) -> None:
    """After a refusal, too; each answer has the bits of a child of its own."""
    meshes = {"waves": waves(30, noise=0.1), "cube": cube(), "more waves": waves(20)}
    with Child() as child:
        for name, mesh in meshes.items():
            made = unwrap_in_process(name, *mesh, *SETTINGS, progress=quietly, child=child)
            assert bits(made) == bits(unwrap(name, *mesh, *SETTINGS))
            with pytest.raises(InputError):
                unwrap_in_process("flat", mesh[0] * np.float32(0), *mesh[1:], *SETTINGS, progress=quietly, child=child)
    assert len(children) == 1


@pytest.mark.usefixtures("only_apart")
def test_another_is_started_after_one_that_ended(monkeypatch: pytest.MonkeyPatch, children: list[Any]) -> None:
    with Child() as child:
        ask = partial(unwrap_in_process, "cube", *cube(), *SETTINGS, child=child)
        boot = child_process._BOOT
        monkeypatch.setattr(child_process, "_BOOT", instead("raise IndexError('out of bounds')"))
        with pytest.raises(NoUnwrapper):
            ask(progress=quietly)
        monkeypatch.setattr(child_process, "_BOOT", boot)
        assert ask(progress=quietly).count == 6
        children[-1].kill()
        children[-1].wait()
        assert ask(progress=quietly).count == 6
        with pytest.raises(Cancelled):
            unwrap_in_process("waves", *waves(300, noise=0.2), *SETTINGS, progress=stopping(2), child=child)
        assert ask(progress=quietly).count == 6
        assert ask(progress=quietly).count == 6
    assert len(children) == 4


@pytest.mark.usefixtures("only_apart")
def test_no_polygons() -> None:
    vertices, triangles, _ = cube()
    result = unwrap_in_process("cube", vertices, triangles, None, *SETTINGS, progress=quietly)
    assert np.array_equal(result.uv, unwrap("cube", vertices, triangles, None, *SETTINGS).uv)


@pytest.mark.usefixtures("only_apart")
def test_seams_reach_the_child(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """As they are: it answers with what it was given."""
    vertices, triangles, polygons = cube()
    seams = np.zeros(triangles.shape, np.bool_)
    seams[3, 1] = True
    monkeypatch.setattr(child_process, "_BOOT", ECHO)
    with pytest.raises(InputError, match=rf"^\(12, 3\) {int(np.flatnonzero(seams)[0])}$"):
        unwrap_in_process("cube", vertices, triangles, polygons, *SETTINGS, seams=seams, progress=quietly)


ECHO = """
import pickle, sys
pickle.load(sys.stdin.buffer)
seams = pickle.load(sys.stdin.buffer)[2]["seams"]
pickle.dump(("refused", f"{seams.shape} {int(seams.ravel().nonzero()[0][0])}"), sys.stdout.buffer)
"""


@pytest.mark.usefixtures("only_apart")
def test_the_child_has_the_kernel_of_this_process(monkeypatch: pytest.MonkeyPatch) -> None:
    """Which is not on the path of a Python that is started anew where it came with an extension."""
    monkeypatch.setattr(child_process, "_BOOT", child_process._BOOT.replace(ANSWER, KERNEL))
    with pytest.raises(InputError) as told:
        unwrap_in_process("cube", *cube(), *SETTINGS, progress=quietly)
    assert str(told.value) == library()._name


ANSWER = 'importlib.import_module(package + ".core.charts.unwrap_process").answer()'
KERNEL = """
name = importlib.import_module(package + ".core.base.kernel_api").library()._name
pickle.dump(("refused", name), sys.stdout.buffer)
"""


@pytest.mark.usefixtures("only_apart")
def test_how_far_the_child_is_comes_through() -> None:
    """Again and again while it works, in the thread that asked for charts, stage by stage; the share never falls."""
    told: list[tuple[int, float, str]] = []
    unwrap_in_process(
        "waves",
        *waves(60),
        *SETTINGS,
        progress=lambda share, stage: told.append((threading.get_ident(), share, stage)),
    )
    threads, shares, stages = zip(*told, strict=True)
    assert set(threads) == {threading.get_ident()}
    assert len(set(stages)) > 1 and len(told) > 2
    assert list(shares) == sorted(shares) and shares[0] >= 0.0 and shares[-1] <= 1.0


def stopping(after: int) -> Any:
    """Raises Cancelled once it has been told so often; to be told once more would be a StopIteration."""
    answers = iter([False] * after + [True])

    def progress(*_: Any) -> None:
        if next(answers):
            raise Cancelled

    return progress


@pytest.mark.usefixtures("only_apart")
def test_cancel_kills_the_child(children: list[Any]) -> None:
    with pytest.raises(Cancelled):
        unwrap_in_process("waves", *waves(300, noise=0.2), *SETTINGS, progress=stopping(2))
    assert len(children) == 1
    assert children[0].returncode != 0, "it was left to finish"


@pytest.mark.usefixtures("only_apart")
@pytest.mark.parametrize("boot", [DEAF, GONE_QUIET], ids=["does not listen", "says no more"])
def test_cancel_ends_a_child_that_does_not_answer(
    boot: str, monkeypatch: pytest.MonkeyPatch, children: list[Any]
) -> None:
    """The arguments are more than a pipe holds, so the sender is stuck as well."""
    monkeypatch.setattr(child_process, "_BOOT", boot)
    with pytest.raises(Cancelled):
        unwrap_in_process("waves", *waves(300), *SETTINGS, progress=stopping(6))
    assert len(children) == 1


def test_cancelled_before_it_began(children: list[Any]) -> None:
    with pytest.raises(Cancelled):
        unwrap_in_process("cube", *cube(), *SETTINGS, progress=stopping(0))
    assert children == []


@pytest.mark.usefixtures("only_apart")
def test_a_fault_of_whoever_is_told_ends_the_child(children: list[Any]) -> None:
    def progress(*_: Any) -> None:
        if children:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        unwrap_in_process("waves", *waves(100), *SETTINGS, progress=progress)


@pytest.mark.usefixtures("only_apart")
def test_a_large_answer_among_many_words_comes_whole(monkeypatch: pytest.MonkeyPatch) -> None:
    """48 MB, as of two million triangles; stderr is full of lines, and the child hangs once it has answered."""
    monkeypatch.setattr(child_process, "_BOOT", LARGE)
    charts = unwrap_in_process("cube", *cube(), *SETTINGS, progress=quietly)
    assert charts.uv.shape == (2_000_000, 3, 2) and charts.uv.dtype == np.float32
    assert (charts.uv[:, 0, 0] == np.arange(2_000_000, dtype=np.float32)).all()


LARGE = """
import pickle, sys, time
import numpy as np
pickle.load(sys.stdin.buffer), pickle.load(sys.stdin.buffer)
for i in range(5000):
    pickle.dump(("reached", (i / 5000, "stage")), sys.stdout.buffer)
    print("noise " * 20, file=sys.stderr)
uv = np.repeat(np.arange(2_000_000, dtype=np.float32), 6).reshape(-1, 3, 2)
stretch = dict(l2=1.0, p95=1.0, area=1.0, angle=1.0)
charts = dict(uv=uv, count=1, stretch=stretch, utilisation=1.0, padding=4)
pickle.dump(("done", charts), sys.stdout.buffer)
sys.stdout.flush()
time.sleep(3600)
"""


@pytest.mark.skipif(os.name != "posix", reason="looks for a process by its number")
def test_a_child_whose_parent_is_gone_ends(tmp_path: Path) -> None:
    """By the next word to it: none is left over where Blender crashes."""
    place = Path(unwrap_process.__file__).absolute().parents[3]
    parent = subprocess.Popen(
        [sys.executable, "-c", ORPHAN, str(place), str(tmp_path / "pid")], stderr=subprocess.DEVNULL
    )
    assert parent.wait(60) == 1
    child = int((tmp_path / "pid").read_text())
    for _ in range(200):
        try:
            os.kill(child, 0)
        except ProcessLookupError:
            return
        time.sleep(0.05)
    os.kill(child, signal.SIGKILL)
    pytest.fail("it was still there after ten seconds")


ORPHAN = """
import os, pathlib, subprocess, sys
sys.path.insert(0, sys.argv[1])
from occlusion_bake.core.charts.unwrap_process import unwrap_in_process
from occlusion_bake.tests.oracles.charts.organic import waves
start = subprocess.Popen
def spy(*arguments, **options):
    child = start(*arguments, **options)
    pathlib.Path(sys.argv[2]).write_text(str(child.pid))
    return child
subprocess.Popen = spy
def progress(share, stage):
    if share > 0.0 or stage != "making UV charts":
        os._exit(1)
unwrap_in_process("waves", *waves(60), 512, 4, progress=progress)
"""


@pytest.mark.usefixtures("only_apart")
def test_input_error_comes_through(children: list[Any]) -> None:
    vertices, triangles, polygons = cube()
    with pytest.raises(InputError) as here:
        unwrap("Würfel", vertices * np.float32(0), triangles, polygons)
    with pytest.raises(InputError) as there:
        unwrap_in_process("Würfel", vertices * np.float32(0), triangles, polygons, *SETTINGS, progress=quietly)
    assert str(there.value) == str(here.value)
    assert len(children) == 1


def instead(code: str) -> str:
    """What the child runs where this stands in the place of its unwrap, which is called `real` in it."""
    begin, last = child_process._BOOT.rstrip().rsplit("\n", 1)
    return f"""{begin}
import os, signal
child = {last.removesuffix(".answer()")}
real = child.unwrap
def unwrap(*arguments, **more):
{textwrap.indent(code, "    ")}
child.unwrap = unwrap
child.answer()
"""


NOISY = """
os.write(1, b"progress")
os.write(2, b"progress" * 50_000)
print("progress", flush=True)
return real(*arguments, **more)
"""


@pytest.mark.usefixtures("only_apart")
def test_a_library_that_prints_does_no_harm(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(child_process, "_BOOT", instead(NOISY))
    assert unwrap_in_process("cube", *cube(), *SETTINGS, progress=quietly).count == 6


@pytest.mark.usefixtures("only_apart")
@pytest.mark.skipif(os.name != "posix", reason="makes a symbolic link")
def test_the_folder_of_the_package_hides_nothing(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """Installed extensions lie side by side; one that is called like a library must not be taken for it."""
    (tmp_path / "numpy").mkdir()
    (tmp_path / "numpy" / "__init__.py").write_text("raise RuntimeError('not the real one')\n")
    (tmp_path / "occlusion_bake").symlink_to(Path(unwrap_process.__file__).absolute().parents[2])
    monkeypatch.setattr(
        child_process, "__file__", str(tmp_path / "occlusion_bake" / "core" / "charts" / "child_process.py")
    )
    assert unwrap_in_process("cube", *cube(), *SETTINGS, progress=quietly).count == 6


def no_interpreter() -> str:
    raise child_process.NoAnswer("no python here")


def fallback(monkeypatch: pytest.MonkeyPatch, kind: str) -> None:
    if kind == "no interpreter":
        monkeypatch.setattr(child_process, "_interpreter", no_interpreter)
    elif kind == "no program":
        monkeypatch.setattr(child_process, "_interpreter", lambda: "/nowhere/python")
    elif kind == "other release":
        monkeypatch.setattr(child_process, "_BOOT", child_process._BOOT.replace("sys.version_info[:2]", "(2, 7)"))
    else:
        monkeypatch.setattr(child_process, "_BOOT", DYING)


KINDS = ["no interpreter", "no program", "other release", "gives up"]


@pytest.mark.parametrize("kind", KINDS)
def test_fallback(kind: str, monkeypatch: pytest.MonkeyPatch, children: list[Any]) -> None:
    fallback(monkeypatch, kind)
    mesh = waves(10)
    assert bits(unwrap_in_process("waves", *mesh, *SETTINGS, progress=quietly)) == bits(
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
        ("raise IndexError('out of bounds\\nby 1')", r"broke down \(IndexError: out of bounds\)"),
    ],
)
def test_what_ends_the_child_does_not_happen_here(end: str, cause: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(child_process, "_BOOT", instead(end))
    with pytest.raises(NoUnwrapper, match=f"^Suzanne: .*{cause}.*--uv smart"):
        unwrap_in_process("Suzanne", *cube(), *SETTINGS, progress=quietly)


@pytest.mark.usefixtures("only_apart")
def test_a_fault_in_the_child_is_told_in_a_note(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(child_process, "_BOOT", instead("raise IndexError('out of bounds')"))
    with pytest.raises(NoUnwrapper) as caught:
        unwrap_in_process("cube", *cube(), *SETTINGS, progress=quietly)
    assert "Traceback" in caught.value.__notes__[0] and "raise IndexError" not in str(caught.value)


@pytest.mark.usefixtures("only_apart")
@pytest.mark.parametrize("asked_before", [False, True])
def test_what_ends_the_child_while_it_listens_does_not_happen_here(
    asked_before: bool, monkeypatch: pytest.MonkeyPatch, children: list[Any]
) -> None:
    """The arguments are more than a pipe holds: what is left of them is nobody's any more."""
    monkeypatch.setattr(child_process, "_BOOT", LISTENING if asked_before else LISTENING.replace("answer(1)", ""))
    with Child() as child:
        if asked_before:
            with pytest.raises(InputError, match=r"^well$"):
                unwrap_in_process("cube", *cube(), *SETTINGS, progress=quietly, child=child)
        with pytest.raises(NoUnwrapper, match=r"^waves: "):
            unwrap_in_process("waves", *waves(300), *SETTINGS, progress=quietly, child=child)
    assert len(children) == 1


LISTENING = """
import os, pickle, sys
def answer(_):
    pickle.load(sys.stdin.buffer)
    pickle.dump(("refused", "well"), sys.stdout.buffer)
    sys.stdout.flush()
pickle.load(sys.stdin.buffer)
answer(1)
sys.stdin.buffer.read(1)
os.abort()
"""


@pytest.mark.usefixtures("only_apart")
def test_too_little_memory_to_hear(monkeypatch: pytest.MonkeyPatch, children: list[Any]) -> None:
    """The child lives, and waits for the next question."""
    monkeypatch.setattr(child_process, "_BOOT", HEAVY)
    with pytest.raises(NoUnwrapper, match="memory"):
        unwrap_in_process("cube", *cube(), *SETTINGS, progress=quietly)
    assert len(children) == 1


def test_what_cannot_be_understood_is_done_here(monkeypatch: pytest.MonkeyPatch, children: list[Any]) -> None:
    monkeypatch.setattr(child_process, "_BOOT", BABBLING)
    assert unwrap_in_process("cube", *cube(), *SETTINGS, progress=quietly).count == 6
    assert len(children) == 1


def raise_memory_error() -> None:
    raise MemoryError


HEAVY = f"""
import pickle, sys
pickle.load(sys.stdin.buffer), pickle.load(sys.stdin.buffer)
sys.stdout.buffer.write(b"c{__name__}\\nraise_memory_error\\n(tR.")
sys.stdout.flush()
sys.stdin.buffer.read(1)
"""
BABBLING = """
import pickle, sys
pickle.load(sys.stdin.buffer), pickle.load(sys.stdin.buffer)
sys.stdout.buffer.write(b"hello, world" * 9)
sys.stdout.flush()
sys.stdin.buffer.read(1)
"""


@pytest.mark.usefixtures("only_apart")
def test_too_little_memory_to_ask(children: list[Any]) -> None:
    """The child has half of a question then."""
    with pytest.raises(NoUnwrapper, match="memory"):
        unwrap_in_process("waves", *waves(300)[:2], Endless(), *SETTINGS, progress=quietly)  # type: ignore[arg-type]
    assert len(children) == 1


class Endless:
    def __reduce__(self) -> str:
        raise MemoryError


def test_too_little_memory_here_is_no_fault_either(monkeypatch: pytest.MonkeyPatch) -> None:
    def here(*_: Any, **__: Any) -> Charts:
        raise MemoryError

    monkeypatch.setattr(child_process, "_interpreter", no_interpreter)
    monkeypatch.setattr(unwrap_process, "unwrap", here)
    with pytest.raises(NoUnwrapper, match="memory"):
        unwrap_in_process("cube", *cube(), *SETTINGS, progress=quietly)


@pytest.mark.usefixtures("only_apart")
@pytest.mark.parametrize("boot", ["import os\nos.abort()", None], ids=["before it listens", "never started"])
def test_nor_what_ends_it_before_it_begins(boot: str | None, monkeypatch: pytest.MonkeyPatch) -> None:
    if boot is None:
        monkeypatch.setattr(subprocess, "Popen", no_memory)
    else:
        monkeypatch.setattr(child_process, "_BOOT", boot)
    with pytest.raises(NoUnwrapper):
        unwrap_in_process("cube", *cube(), *SETTINGS, progress=quietly)


def no_memory(*_: Any, **__: Any) -> Any:
    raise OSError(errno.ENOMEM, os.strerror(errno.ENOMEM))


def test_an_error_after_the_fallback_tells_of_the_child(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(child_process, "_BOOT", DYING)

    def here(*_: Any, **__: Any) -> Charts:
        raise RuntimeError("and so did this process")

    monkeypatch.setattr(unwrap_process, "unwrap", here)
    with pytest.raises(RuntimeError) as caught:
        unwrap_in_process("cube", *cube(), *SETTINGS, progress=quietly)
    assert "the child fell over" in "\n".join(caught.value.__notes__)


@pytest.mark.usefixtures("only_apart")
def test_no_fallback_after_a_cancel(monkeypatch: pytest.MonkeyPatch) -> None:
    """A Ctrl-C ends the child and sets the wish to stop; nothing is unwrapped then."""
    monkeypatch.setattr(child_process, "_interpreter", no_interpreter)
    with pytest.raises(Cancelled):
        unwrap_in_process("cube", *cube(), *SETTINGS, progress=stopping(1))


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
    assert child_process._interpreter() == own
    for useless in (blender, "", None, str(tmp_path / "python-gone"), str(tmp_path)):
        monkeypatch.setattr(sys, "executable", useless)
        with pytest.raises(child_process.NoAnswer):
            child_process._interpreter()
    release = "python{}.{}".format(*sys.version_info)
    beside = program(tmp_path / "prefix" / "bin" / release)
    assert child_process._interpreter() == beside


# Charts that exist


def test_charts_side_by_side_are_the_same_bits(children: list[Any], monkeypatch: pytest.MonkeyPatch) -> None:
    vertices, triangles, polygons = waves(10)
    uv = unwrap("waves", vertices, triangles, polygons, *SETTINGS).uv
    maps = [ExistingCharts(vertices, triangles, each, udim) for each in (uv, 2.0 * uv) for udim in Udim]
    here = side_by_side("Set", maps, (256, 128), 4)
    monkeypatch.setattr(unwrap_process, "side_by_side", no_interpreter)
    apart = side_by_side_in_process("Set", maps, (256, 128), 4, progress=quietly)
    assert [each.tobytes() for each in apart.uv] == [each.tobytes() for each in here.uv]
    assert (apart.count, apart.padding, apart.stretch) == (here.count, here.padding, here.stretch)
    assert len(children) == 1


def test_charts_side_by_side_are_refused_and_made_here_alike(monkeypatch: pytest.MonkeyPatch) -> None:
    vertices, triangles, _ = cube()
    flat = [ExistingCharts(vertices, triangles, np.zeros((len(triangles), 3, 2), np.float32))]
    for _ in range(2):
        with pytest.raises(InputError, match=r"^Set: no face has an area"):
            side_by_side_in_process("Set", flat, (64, 64), 4, progress=quietly)
        monkeypatch.setattr(child_process, "_interpreter", no_interpreter)

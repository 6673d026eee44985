"""Long work in steps: what runs where, and how it ends."""

from __future__ import annotations

import os
import signal
import threading
from typing import Any

import pytest
from occlusion_bake.addon.job.runner import Runner, Steps, run
from occlusion_bake.addon.job.stop_signals import STOPPING, interrupted_by
from occlusion_bake.core.base.errors import Cancelled, InputError
from occlusion_bake.core.progress import Progress


def test_steps_run_here_and_what_they_yield_in_a_thread() -> None:
    seen: list[Any] = []

    def steps() -> Steps:
        seen.append(threading.current_thread())
        seen.append((yield threading.current_thread))
        seen.append(threading.current_thread())
        seen.append((yield lambda: 6 * 7))

    run(steps(), Progress())
    here = threading.current_thread()
    assert seen[0] is seen[2] is here and seen[1] is not here and seen[3] == 42


def test_an_exception_in_the_thread_arrives_where_it_was_yielded() -> None:
    def steps() -> Steps:
        with pytest.raises(InputError, match="no"):
            yield lambda: fail(InputError("no"))
        yield lambda: fail(ZeroDivisionError())

    with pytest.raises(ZeroDivisionError):
        run(steps(), Progress())


def fail(error: Exception) -> None:
    raise error


@pytest.mark.parametrize("error", [InputError("x"), Cancelled(), MemoryError(), KeyboardInterrupt()])
def test_an_exception_of_the_steps_comes_out_and_they_are_closed(error: BaseException) -> None:
    closed = []

    def steps() -> Steps:
        try:
            yield lambda: None
            raise error
        finally:
            closed.append(True)

    with pytest.raises(type(error)):
        run(steps(), Progress())
    assert closed == [True]


def test_work_without_a_thread() -> None:
    def steps() -> Steps:
        done.append(True)
        return
        yield

    done: list[bool] = []
    run(steps(), Progress())
    assert done == [True]


def test_polling_never_waits() -> None:
    gate, results = threading.Event(), []

    def steps() -> Steps:
        results.append((yield gate.wait))

    runner = Runner(steps(), Progress())
    assert [runner.poll() for _ in range(3)] == [False] * 3
    gate.set()
    while not runner.poll():
        runner.wait(1.0)
    assert results == [True]


def test_closing_cancels_what_runs_and_waits_for_it() -> None:
    progress, ends = Progress(), []

    def work() -> None:
        while not progress.control.cancel:
            pass
        ends.append("thread")

    def steps() -> Steps:
        try:
            yield work
        finally:
            ends.append("steps")

    runner = Runner(steps(), progress)
    runner.poll()
    runner.close()
    runner.close()
    assert ends == ["thread", "steps"] and progress.control.cancel


def test_closing_what_has_not_begun() -> None:
    progress = Progress()
    Runner((_ for _ in ()), progress).close()
    assert not progress.control.cancel


def interrupt() -> None:
    os.kill(os.getpid(), signal.SIGINT)


@pytest.mark.skipif(os.name == "nt", reason="os.kill ends the process there")
def test_ctrl_c_cancels_and_is_given_back() -> None:
    before = signal.getsignal(signal.SIGINT)
    progress = Progress()

    def steps() -> Steps:
        interrupt()
        yield progress.raise_if_cancelled

    with pytest.raises(Cancelled):
        run(steps(), progress)
    assert signal.getsignal(signal.SIGINT) is before


@pytest.mark.skipif(os.name == "nt", reason="os.kill ends the process there")
def test_a_handler_that_is_not_pythons(monkeypatch: pytest.MonkeyPatch) -> None:
    """Blender in the background has its own, which Python knows as None and cannot set again."""
    set_handler = signal.signal
    before = signal.getsignal(signal.SIGINT)
    monkeypatch.setattr(signal, "signal", lambda number, handler: (set_handler(number, handler), None)[1])
    try:
        run((each for each in [lambda: None]), Progress())
    finally:
        set_handler(signal.SIGINT, before)


@pytest.mark.skipif(os.name == "nt", reason="os.kill ends the process there")
@pytest.mark.parametrize("at_once", [True, False])
def test_what_may_not_be_interrupted_is_brought_to_its_end(at_once: bool) -> None:
    """Imports of modules in C swallow an exception within them, or crash of it."""
    ended = []
    with pytest.raises(KeyboardInterrupt), interrupted_by(STOPPING, at_once=at_once):
        os.kill(os.getpid(), signal.SIGTERM)
        ended.append(True)
    assert ended == [True] * (not at_once)


@pytest.mark.skipif(os.name == "nt", reason="os.kill ends the process there")
def test_what_is_ignored_stays_so() -> None:
    """As nohup has it."""
    before = signal.signal(signal.SIGHUP, signal.SIG_IGN)
    try:
        with interrupted_by(STOPPING):
            os.kill(os.getpid(), signal.SIGHUP)
    finally:
        signal.signal(signal.SIGHUP, before)


def test_outside_the_main_thread_it_runs_too() -> None:
    results = []

    def steps() -> Steps:
        results.append((yield lambda: 1))

    thread = threading.Thread(target=run, args=(steps(), Progress()))
    thread.start()
    thread.join()
    assert results == [1]


def test_progress_is_shown_while_it_runs() -> None:
    gate, stages = threading.Event(), []
    progress = Progress()

    def steps() -> Steps:
        progress.enter("waiting")
        yield gate.wait

    def show(shown: Progress) -> None:
        stages.append(shown.stage)
        gate.set()

    run(steps(), progress, show)
    assert stages and set(stages) == {"waiting"}

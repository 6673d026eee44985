"""How far chart making is gets told while it goes on, and whoever is told can stop it."""

from __future__ import annotations

import threading
import time
from typing import Any

import pytest
from occlusion_bake.core.base.errors import Cancelled
from occlusion_bake.core.charts.stages import Stages


def test_a_kernel_calls_counts_are_a_share_of_its_stage() -> None:
    told: list[tuple[float, str]] = []
    with Stages(lambda share, stage: told.append((share, stage))) as stages:
        control = stages.enter("cutting", 0.2, 0.6)
        control.total, control.done = 4, 1
        deadline = time.monotonic() + 10.0
        while told[-1][0] < 0.3 and time.monotonic() < deadline:
            time.sleep(0.01)
        control.done = 40  # more than there are
        while told[-1][0] < 0.6 and time.monotonic() < deadline:
            time.sleep(0.01)
        stages.enter("packing", 0.6, 1.0)
    assert told[0] == (0.2, "cutting") and told[-1] == (0.6, "packing")
    assert (pytest.approx(0.3), "cutting") in told and (pytest.approx(0.6), "cutting") in told


def test_a_running_kernel_call_is_stopped() -> None:
    """Its `cancel` is set; what was raised is raised again, in the place of what the call makes of it."""

    def stop(share: float, stage: str) -> None:
        if share > 0.0:
            raise Cancelled(stage)

    with pytest.raises(Cancelled, match=r"^cutting$"), Stages(stop) as stages:
        control = stages.enter("cutting", 0.0, 1.0)
        control.total = control.done = 1
        deadline = time.monotonic() + 10.0
        while not control.cancel and time.monotonic() < deadline:
            time.sleep(0.01)
        raise Cancelled("as a kernel call says it")


def test_nothing_begins_after_a_stop() -> None:
    def stop(*_: Any) -> None:
        raise Cancelled

    reached = False
    with pytest.raises(Cancelled), Stages(stop) as stages:
        stages.enter("cutting", 0.0, 1.0)
        reached = True
    assert not reached


def test_without_anybody_to_tell() -> None:
    before = threading.active_count()
    with Stages(None) as stages:
        assert stages.enter("cutting", 0.0, 1.0).cancel == 0
        assert threading.active_count() == before


def test_an_error_of_the_work_comes_out_as_it_is() -> None:
    with pytest.raises(ZeroDivisionError), Stages(lambda *_: None) as stages:
        stages.enter("cutting", 0.0, 1.0)
        raise ZeroDivisionError
    assert not [thread for thread in threading.enumerate() if "stages" in thread.name]

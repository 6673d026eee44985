"""The stopwatch: what passes within an inner stage counts there alone."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from occlusion_bake.core.base import timing
from occlusion_bake.core.base.timing import Stopwatch


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> Iterator[list[float]]:
    """The time, to be set."""
    now = [0.0]
    monkeypatch.setattr(timing.time, "perf_counter", lambda: now[0])
    yield now


def test_stages_share_the_time_without_rest(clock: list[float]) -> None:
    watch = Stopwatch()
    with watch.stage("solve"):
        clock[0] = 1.0
        with watch.stage("trace"):
            clock[0] = 3.0
            with watch.stage("probe"):
                clock[0] = 7.0
        clock[0] = 8.0
        with watch.stage("trace"):
            clock[0] = 16.0
    clock[0] = 32.0  # in no stage
    assert watch.seconds == {"solve": 2.0, "trace": 10.0, "probe": 4.0}


def test_a_stage_that_is_left_by_an_exception_has_its_time(clock: list[float]) -> None:
    watch = Stopwatch()
    with pytest.raises(ValueError), watch.stage("texels"):
        clock[0] = 2.0
        raise ValueError
    assert watch.seconds == {"texels": 2.0}

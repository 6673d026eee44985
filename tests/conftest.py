"""What the whole suite shares."""

from __future__ import annotations

import sys

import pytest


@pytest.fixture
def unmeasured(monkeypatch: pytest.MonkeyPatch) -> None:
    """Bakes of a number of rays do not trace their maps again to measure the error, which takes longer than a small map
    does; they tell an error of 0. For tests that look at values alone: those do not depend on it."""
    import numpy as np
    from occlusion_bake.core.solve import probes

    estimates = np.zeros((1, 0))
    none = probes.Probes(np.zeros(0, dtype=np.int64), np.zeros(0), estimates, estimates, probes.MOST_LANE_RAYS, 0)
    monkeypatch.setattr(probes, "draw", lambda *_: none)


@pytest.hookimpl(trylast=True)
def pytest_unconfigure(config: pytest.Config) -> None:
    """Blender as a module may hang in its destructors at exit; by now everything has been said, by workers too."""
    if "bpy" in sys.modules:
        from occlusion_bake.addon.cli.hard_exit import leave

        leave(int(getattr(config, "occlusion_bake_status", 1)))


def pytest_sessionfinish(session: pytest.Session, exitstatus: int) -> None:
    session.config.occlusion_bake_status = exitstatus  # type: ignore[attr-defined]

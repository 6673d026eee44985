"""What the whole suite shares."""

from __future__ import annotations

import sys

import pytest


@pytest.hookimpl(trylast=True)
def pytest_unconfigure(config: pytest.Config) -> None:
    """Blender as a module may hang in its destructors at exit; by now everything has been said."""
    if "bpy" in sys.modules and not hasattr(config, "workerinput"):
        from occlusion_bake.addon.leave import leave

        leave(int(getattr(config, "occlusion_bake_status", 1)))


def pytest_sessionfinish(session: pytest.Session, exitstatus: int) -> None:
    session.config.occlusion_bake_status = exitstatus  # type: ignore[attr-defined]

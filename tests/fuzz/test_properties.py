"""What must hold whatever is baked, with cases drawn by hypothesis: the same few hundred each time.

The long run, with other cases each time, is `python -m occlusion_bake.bench.accuracy.fuzz`.
"""

from __future__ import annotations

from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from occlusion_bake.tests.oracles.properties import PROPERTIES

OF_ERRORS = ("is_sound", "alone_is_as_among_others")  # which are measured for these; the others look at values alone


@pytest.mark.parametrize("name", PROPERTIES)
def test_holds(name: str, request: pytest.FixtureRequest) -> None:
    chosen = PROPERTIES[name]
    if name not in OF_ERRORS:
        request.getfixturevalue("unmeasured")

    @settings(
        max_examples=chosen.short,
        derandomize=True,
        deadline=None,
        database=None,
        suppress_health_check=[*HealthCheck],
    )
    @given(st.tuples(*chosen.cases))
    def holds(case: tuple[Any, ...]) -> None:
        chosen.check(*case)

    holds()

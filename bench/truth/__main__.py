"""`make accuracy`: measure how right the bake is and write docs/accuracy.md; hard.measure writes docs/hard_cases.md.

python -m occlusion_bake.bench.truth [SECTION...] [--models DIR]
"""

from __future__ import annotations

import sys

from ...addon.cli.hard_exit import leave
from ...core.base.version import version
from ..pages import Page
from . import cycles, exact, fuzz, horizon, second

PAGE = Page(
    module="occlusion_bake.bench.truth",
    path="docs/accuracy.md",
    title="Accuracy",
    about=f"Occlusion Bake {version()}. Written by `make accuracy`; one section alone: `.venv/bin/python -m "
    "occlusion_bake.bench.truth SECTION`. How the estimators converge: [the study](../bench/study/README.md). What "
    "meshes do to a bake: [hard cases](hard_cases.md). Values are visibility: 1 open, 0 closed.",
    sections={
        "exact": (exact.measure, exact.page),
        "second": (second.measure, second.page),
        "cycles": (cycles.measure, cycles.page),
        "horizon": (horizon.measure, horizon.page),
        "fuzz": (fuzz.measure, fuzz.page),
    },
)

if __name__ == "__main__":
    leave(PAGE.run(sys.argv[1:]))

"""How long a first look takes: a light object, Draft, beside Cycles with one sample. The section `draft`."""

from __future__ import annotations

import argparse
from functools import partial
from typing import Any

from ...core.settings import QUALITIES
from ...samples.bench_scenes import add_ball_on_plane, empty_scene
from ...tests.oracles.blender import read
from ...tests.oracles.settings import flat_settings
from ..bake_here import bake_here
from ..cycles import bake_cycles
from ..pages import filled, machine
from ..sweep import in_turns, medians

SIZE = 512
SHARE, ALLOWANCE = 0.25, 0.15  # the goal: at most this share of Cycles' seconds, and so many seconds
LEAST_ROUNDS = 9  # they are short


def measure(chosen: argparse.Namespace) -> dict[str, Any]:
    """In turns, after one bake of each that loads libraries."""
    ball, rounds = add_ball_on_plane(empty_scene()), max(chosen.rounds, LEAST_ROUNDS)
    triangles = read([ball.name])[0].targets[0].mesh.triangles
    cases = {"ours": partial(_ours, ball.name), "cycles": partial(_cycles, ball.name)}
    runs = {name: medians(each[1:]) for name, each in in_turns(cases, rounds + 1).items()}
    found = {**runs["ours"], **runs["cycles"], "rounds": rounds, "triangles": len(triangles)}
    return {"about": {"machine": machine()}, "seconds": found}


def page(result: dict[str, Any]) -> list[str]:
    """The section of the page."""
    goal = SHARE * result["seconds"]["cycles"] + ALLOWANCE
    values = {"size": SIZE, "share": SHARE, "allowance": ALLOWANCE, "goal": goal}
    return filled(__file__, about=result["about"], **result["seconds"], **values)


def _ours(name: str, _: int) -> dict[str, float]:
    made = bake_here([name], flat_settings(width=SIZE, height=SIZE, error=QUALITIES["draft"]), with_files=True)
    return {"ours": made.seconds, "error": made.baked.maps["ao"].error}


def _cycles(name: str, number: int) -> dict[str, float]:
    return {"cycles": bake_cycles(name, SIZE, 1, number).seconds}

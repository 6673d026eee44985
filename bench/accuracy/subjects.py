"""What is baked to be compared: the sample scenes, and models that stand on a ground plane."""

from __future__ import annotations

import argparse
from collections.abc import Iterator

import bpy

from ...addon.typed import scene_in
from ...samples.bench_scenes import MODELS, build, stand_on_ground
from ...samples.scenes import SCENES

SUBJECTS = (*SCENES, *MODELS)


def opened(chosen: argparse.Namespace) -> Iterator[tuple[str, str]]:
    """Open one after the other of those asked for. chosen: names (none: all), models (a folder).

    Yields what each is called, and its object to bake; where a model is not in the folder, a line says so.
    """
    for name in getattr(chosen, "names", None) or SUBJECTS:
        if name in MODELS and not (chosen.models / MODELS[name]).is_file():
            print(f"SKIPPED {name}: no {MODELS[name]} in {chosen.models}", flush=True)
            continue
        target = build(name, chosen.models).targets[0]
        if name in MODELS:
            model = bpy.data.objects[target]
            model.name = target = name
            stand_on_ground(scene_in(bpy.context), model)
        yield name, target

"""What is measured: a map of a scene at a size, and which of them a command means."""

from __future__ import annotations

import argparse
import re
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Self

from ...core.rays.map_spec import AO, MapSpec, reflection
from ...samples.bench_scenes import OWN_SIZES, names
from .classes import CLASSES

MAPS: dict[str, MapSpec] = {spec.name: spec for spec in (AO, reflection(10.0), reflection(100.0))}
SIZES = (512, 1024)
QUICK_SCENES, QUICK_SIZE = ("suzanne", "gaps"), 256


@dataclass(frozen=True)
class Case:
    """map: by its name in MAPS."""

    scene: str
    size: int
    map: str = AO.name

    @property
    def name(self) -> str:
        """As files call it."""
        of_map = "" if self.map == AO.name else f"_{self.map}"
        return f"{self.scene}{of_map}_{self.size}"

    @classmethod
    def named(cls, name: str) -> Self | None:
        """The case of this name; None where it is none."""
        others = "|".join(each for each in MAPS if each != AO.name)
        found = re.fullmatch(rf"(\w+?)(?:_({others}))?_(\d+)", name)
        return found and cls(found[1], int(found[3]), found[2] or AO.name)


def is_trial(chosen: argparse.Namespace) -> bool:
    """Whether a command only tries, or measures some points alone, which then are kept apart from the page's."""
    return bool(chosen.quick or chosen.bakers or chosen.errors)


def cases(chosen: argparse.Namespace) -> Iterator[Case]:
    """All that a command could mean by its scenes' names, in the page's order."""
    scenes = [name for name in names(chosen.models) if not chosen.classes or name in _of_classes(chosen.classes)]
    if chosen.quick and not (chosen.sections or chosen.classes):
        scenes = list(QUICK_SCENES)
    for map_ in chosen.maps:
        for size in _sizes(chosen):
            yield from (Case(scene, size, map_) for scene in scenes if not _has_own_size(scene, chosen))
        yield from (Case(scene, OWN_SIZES[scene], map_) for scene in scenes if _has_own_size(scene, chosen))


def is_meant(name: str, given: str) -> bool:
    """Whether a word of the command means what has this name: itself, or its scene."""
    case = Case.named(name)
    return name == given or (case is not None and case.scene == given)


def _sizes(chosen: argparse.Namespace) -> tuple[int, ...]:
    return tuple(chosen.sizes or ((QUICK_SIZE,) if chosen.quick else SIZES))


def _has_own_size(scene: str, chosen: argparse.Namespace) -> bool:
    """Only where it is tried at another."""
    return scene in OWN_SIZES and not (is_trial(chosen) and (chosen.sizes or chosen.quick))


def _of_classes(wanted: list[str]) -> set[str]:
    return {scene for each in CLASSES if each.name in wanted for scene in each.scenes}

"""Ambient and reflection occlusion: the share of a lobe that nothing blocks."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from ..finish.baked import BakedMap, Metadata
from ..finish.map_finisher import MapFinisher
from ..rays.map_spec import AO, Axis, MapSpec
from ..solve.solver import Solved
from .map import Map

_REFLECTION = "ro_"  # what names of RO begin with


@dataclass(frozen=True)
class OcclusionMap(Map):
    """What a spec's rays see, as it is."""

    spec: MapSpec = AO

    is_grey = True

    @property
    def name(self) -> str:
        return self.spec.name

    @property
    def of_whole_lobes(self) -> str:
        return "dividing by the horizon" if self.spec.divided else ""

    def description(self) -> Metadata:
        kind = "ambient occlusion" if self.name == AO.name else "reflection occlusion"
        return {"map": kind, **lobe_description(self.spec)}

    def finish(self, solved: Solved, finisher: MapFinisher) -> BakedMap:
        return finisher.finished(self, solved.values, solved.covered, solved.error, solved.rays)


AMBIENT = OcclusionMap()


def lobe_description(spec: MapSpec) -> Metadata:
    """A lobe and its rays, for those who read the image."""
    return {
        "exponent": spec.exponent,
        "direction": "camera" if spec.axis is Axis.REFLECTED else "normal",
        "horizon": "divided" if spec.divided else "kept",
        "sampler": spec.sampler.name.lower(),
    }


def ambient_among(names: Iterable[str]) -> str | None:
    """The name of AO, where it is among these names of maps."""
    return next((name for name in names if name == AMBIENT.name), None)


def reflection_among(names: Iterable[str]) -> str | None:
    """The first name of an RO map among these."""
    return next((name for name in names if name.startswith(_REFLECTION)), None)

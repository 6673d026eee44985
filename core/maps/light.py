"""The World's light that gets to the surface, and the share of each color that does, by the same rays."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..base.arrays import Floats
from ..base.errors import InputError
from ..finish.baked import BakedMap, Metadata
from ..finish.image_file import holds_floats
from ..finish.map_finisher import MapFinisher
from ..rays.map_spec import MapSpec, light
from ..solve.solver import Solved
from .map import Map
from .occlusion import lobe_description

DIFFUSE = light()


@dataclass(frozen=True)
class LightShareMap(Map):
    """The share of the light that gets through, of each color."""

    spec: MapSpec = DIFFUSE

    @property
    def name(self) -> str:
        return f"{self.spec.name}_ratio"

    def description(self) -> Metadata:
        return {"map": "share of the environment's light", **lobe_description(self.spec)}

    def finish(self, solved: Solved, finisher: MapFinisher) -> BakedMap:
        return finisher.finished(self, _shares(solved), solved.covered, solved.error, solved.rays)


@dataclass(frozen=True)
class LightMap(Map):
    """The light itself, which may be above 1. Its error is that of the share."""

    spec: MapSpec = DIFFUSE

    @property
    def name(self) -> str:
        return self.spec.name

    @property
    def of_whole_lobes(self) -> str:
        return "the light itself (not its share)"

    def description(self) -> Metadata:
        return {"map": "environment's light", **lobe_description(self.spec)}

    def finish(self, solved: Solved, finisher: MapFinisher) -> BakedMap:
        values = _shares(solved) * finisher.open_light(self.spec, solved.covered)
        return finisher.finished(self, values, solved.covered, solved.error, solved.rays)

    def check_file(self, format_name: str, depth: int) -> None:
        if not holds_floats(format_name, depth):
            raise InputError(
                f"light: it may be above 1, which {format_name.upper()} of {depth} bits cuts off; choose EXR"
            )


def _shares(solved: Solved) -> Floats:
    """(H, W, 3): of each color."""
    assert solved.more is not None
    return np.ascontiguousarray(np.moveaxis(solved.more, 0, -1))

"""What a bake keeps of each texel so that its reflection occlusion is known for any view (docs/directional.md)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..base.errors import InputError
from ..finish.baked import BakedMap, Metadata
from ..finish.image_file import holds_floats, holds_names
from ..finish.map_finisher import MapFinisher
from ..map_tracer import MapTracer
from ..solve.directional import DirectionalBaker, DirectionalSettings
from ..spherical.directional_format import DirectionalFormat
from .map import Map


@dataclass(frozen=True)
class DirectionalMap(Map):
    """A directional code."""

    settings: DirectionalSettings

    needs_tangents = True
    has_own_rays = True

    @property
    def name(self) -> str:
        return self.settings.format.name

    @property
    def mixes(self) -> bool:
        return self.settings.format.kind != "mask"

    @property
    def directional(self) -> DirectionalFormat:
        return self.settings.format

    @property
    def of_whole_lobes(self) -> str:
        return "a directional code"

    def description(self) -> Metadata:
        return {"map": "directional code", "code": self.name, "code_rays": self.settings.rays}

    def make(self, finisher: MapFinisher, tracer: MapTracer) -> BakedMap:
        settings, surface = self.settings, finisher.surface
        baker = DirectionalBaker(tracer.scene, surface, finisher.frames, tracer.options_of_codes)
        values = np.zeros((*surface.owner.shape, settings.format.count), dtype=np.float32)
        flat = values.reshape(-1, settings.format.count)
        for these, codes in baker.values(settings, tracer.enter_own):
            flat[these] = codes
        error = baker.error(values, settings, tracer.seed)
        rays = settings.rays * int(np.count_nonzero(surface.covered))
        return finisher.finished(self, values, surface.covered, error, rays)

    def check_file(self, format_name: str, depth: int) -> None:
        if not holds_names(format_name) and holds_floats(format_name, depth):
            raise InputError(
                f"{self.name}: pictures of integers have 8 or 16 bits a channel; choose one of them, or EXR"
            )

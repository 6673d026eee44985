"""One finished texture, on its way to where it goes."""

from __future__ import annotations

from dataclasses import dataclass

from ...core.finish.baked import Baked
from ...core.scene.scene import Instance
from ..read.block_ref import BlockRef


@dataclass(frozen=True, eq=False)
class Result:
    """name: its object's, or the atlas'. objects: those in it; targets: the same, as they were baked. bakes: one, or
    one a tile of a UDIM layout."""

    name: str
    objects: tuple[BlockRef, ...]
    targets: tuple[Instance, ...]
    bakes: tuple[Baked, ...]

    @property
    def target(self) -> Instance:
        """The object; the first of an atlas."""
        return self.targets[0]

    @property
    def baked(self) -> Baked:
        """The bake; the first of a UDIM layout."""
        return self.bakes[0]

    @property
    def warnings(self) -> list[str]:
        """Of all bakes, each line once."""
        return list(dict.fromkeys(line for baked in self.bakes for line in baked.warnings))

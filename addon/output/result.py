"""One finished texture, on its way to where it goes."""

from __future__ import annotations

from dataclasses import dataclass

from ...core.finish.baked import Baked
from ...core.scene.scene import Instance
from ..read.block_ref import BlockRef


@dataclass(frozen=True, eq=False)
class Texture:
    """One texture that may be baked. name, objects, targets, tiles, atlas: as a Result has them. inputs: the hashes of
    what it depends on, of each tile one."""

    name: str
    objects: tuple[BlockRef, ...]
    targets: tuple[Instance, ...]
    inputs: tuple[str, ...]
    tiles: tuple[int, ...] = ()
    atlas: str = ""


@dataclass(frozen=True, eq=False)
class Result:
    """name: its object's, or the atlas'. objects: those in it; targets: the same, as they were baked. tiles: the
    numbers of a UDIM layout, of which each comes as a result of its own, in order, so that one at a time is held; none
    where there is no layout. atlas: its name where it is one. inputs: the hashes of
    what it depends on, of each tile so far one."""

    name: str
    objects: tuple[BlockRef, ...]
    targets: tuple[Instance, ...]
    baked: Baked
    tiles: tuple[int, ...] = ()
    atlas: str = ""
    inputs: tuple[str, ...] = ()

    @property
    def target(self) -> Instance:
        """The object; the first of an atlas."""
        return self.targets[0]

    @property
    def is_first(self) -> bool:
        """Of its tiles; also where there are none."""
        return not self.tiles or self.baked.tile == self.tiles[0]

    @property
    def is_last(self) -> bool:
        """Of its tiles; also where there are none."""
        return not self.tiles or self.baked.tile == self.tiles[-1]

"""What to bake: which maps, into what image, how well, and what blocks their rays; checked once, here."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from .base.errors import InputError
from .maps.map import Map
from .maps.occlusion import AMBIENT
from .rays.map_spec import MapSpec, merged
from .rays.ray_options import ALL_OCCLUDERS, WHOLE_SPREAD, RayOptions
from .solve.goal import Goal

MAX_SIZE = 65536
MAX_THREADS = 1024
QUALITIES = {"draft": 1 / 50, "good": 1 / 255, "final": 1 / 510}  # RMSE; 1/255 is a step of an 8-bit image
DEFAULT_QUALITY = "good"


@dataclass(frozen=True)
class ImageSettings:
    """What is written. width, height: texels. margin: texels by which charts' borders are carried outward.

    Raises InputError, one line, for a value out of range.
    """

    width: int = 1024
    height: int = 1024
    margin: int = 16

    def __post_init__(self) -> None:
        if not (1 <= self.width <= MAX_SIZE and 1 <= self.height <= MAX_SIZE):
            raise InputError(f"size {self.width}x{self.height}: give 1 to {MAX_SIZE} texels a side")
        if not 0 <= self.margin <= MAX_SIZE:
            raise InputError(f"margin {self.margin}: give 0 to {MAX_SIZE} texels")

    @property
    def size(self) -> tuple[int, int]:
        """Width and height."""
        return self.width, self.height


DEFAULT_IMAGE, DEFAULT_GOAL = ImageSettings(), Goal()


@dataclass(frozen=True)
class Settings:
    """What to bake. maps: of each name one. goal: how far to go. rays: what counts as an occluder. normal_maps: whether
    targets' normals are turned by their materials' normal maps; those that are baked from others have none. threads 0:
    all.

    Raises InputError, one line, for a value out of range.
    """

    maps: tuple[Map, ...] = (AMBIENT,)
    image: ImageSettings = DEFAULT_IMAGE
    goal: Goal = DEFAULT_GOAL
    rays: RayOptions = ALL_OCCLUDERS
    normal_maps: bool = False
    seed: int = 0
    threads: int = 0

    def __post_init__(self) -> None:
        if not self.maps:
            raise InputError("nothing to bake; choose AO, RO or another map")
        for names in ([each.name for each in self.maps if each.is_grey], [each.name for each in self.maps]):
            if len(set(names)) < len(names):
                raise InputError(f"of the maps {', '.join(names)} two have the same name; ask for each once")
        if self.rays.spread < WHOLE_SPREAD and (whole := self._of_whole_lobes):
            raise InputError(
                f"spread {self.rays.spread:g}: {whole} is of whole lobes; leave it out, or give 180 degrees"
            )
        if not 0 <= self.threads <= MAX_THREADS:
            raise InputError(f"threads {self.threads}: give 1 to {MAX_THREADS}, or 0 for all")

    @property
    def specs(self) -> list[MapSpec]:
        """What is traced for the maps: rays that several ask for, once."""
        return merged(each.spec for each in self.maps if each.spec is not None)

    @property
    def needs_tangents(self) -> bool:
        """Whether targets must have tangents."""
        return any(each.needs_tangents for each in self.maps)

    @property
    def needs_light(self) -> bool:
        """Whether the scene must have an environment."""
        return any(each.is_light for each in self.specs)

    @property
    def are_grey(self) -> bool:
        """Whether all maps are of one number a texel, from 0 to 1."""
        return all(each.is_grey for each in self.maps)

    @property
    def is_one_grey(self) -> bool:
        """Whether there is but one such map."""
        return self.are_grey and len(self.maps) == 1

    @property
    def _of_whole_lobes(self) -> str:
        """What is asked for that has no meaning within a cone of directions; empty: nothing."""
        return next((each.of_whole_lobes for each in reversed(self.maps) if each.of_whole_lobes), "")


def check_files(maps: Iterable[Map], format_name: str, depth: int) -> None:
    """Refuse, before a bake, files that could not hold its maps. Raises InputError."""
    for each in maps:
        each.check_file(format_name, depth)

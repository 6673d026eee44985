"""What a map must tell of itself, so that nothing else need know which it is."""

from __future__ import annotations

from abc import ABC, abstractmethod

from ..finish.baked import BakedMap, Metadata
from ..finish.map_finisher import MapFinisher
from ..map_tracer import MapTracer
from ..rays.map_spec import MapSpec
from ..solve.solver import Solved
from ..spherical.directional_format import DirectionalFormat


class Map(ABC):
    """One map to bake. A map of rays that others can share has a `spec`, and `finish`; any other has `make`."""

    @property
    @abstractmethod
    def name(self) -> str:
        """What files and reports call it: ao, ro_10, …"""

    @abstractmethod
    def description(self) -> Metadata:
        """What it is, for those who read the image."""

    @property
    def spec(self) -> MapSpec | None:
        """What it asks of rays that others can share; None: it is made by `make`."""
        return None

    @property
    def mixes(self) -> bool:
        """Whether values of texels may be averaged."""
        return True

    @property
    def is_grey(self) -> bool:
        """Whether it is one number a texel, from 0 to 1."""
        return False

    @property
    def needs_tangents(self) -> bool:
        """Whether targets must have tangents."""
        return False

    @property
    def has_own_rays(self) -> bool:
        """Whether `make` traces, which takes its time."""
        return False

    @property
    def directional(self) -> DirectionalFormat | None:
        """The code that it is, in which it is stored; None for another map."""
        return None

    @property
    def of_whole_lobes(self) -> str:
        """What it is called, where it has no meaning within a cone of directions; empty where it has."""
        return ""

    def finish(self, solved: Solved, finisher: MapFinisher) -> BakedMap:
        """The image, from the rows of its spec."""
        raise NotImplementedError

    def make(self, finisher: MapFinisher, tracer: MapTracer) -> BakedMap:
        """The image, by rays of its own or without any: then its error is 0, and so are its rays. Raises InputError,
        Cancelled, MemoryError."""
        raise NotImplementedError

    def check_file(self, format_name: str, depth: int) -> None:  # noqa: B027 - most maps fit into any file
        """Refuse, before a bake, a file that could not hold it. Raises InputError."""

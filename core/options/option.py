"""What a row of the table of options is made of."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from enum import Enum
from operator import attrgetter
from typing import Any

ANGLE = "ANGLE"
Chosen = Any  # the panel's settings, or kept ones: an object with a property for each option


@dataclass(frozen=True)
class Switch:
    """On or off."""

    default: bool = False


@dataclass(frozen=True)
class Whole:
    """A whole number; soft_high: what a slider ends at. unit: as Blender names subtypes."""

    default: int
    low: int = 0
    high: int | None = None
    soft_high: int | None = None
    unit: str = "NONE"


@dataclass(frozen=True)
class Real:
    """A number. unit: as Blender names subtypes; lengths are in scene units, angles in degrees."""

    default: float
    low: float = 0.0
    high: float | None = None
    soft_high: float | None = None
    unit: str = "NONE"


@dataclass(frozen=True)
class Text:
    """Words."""

    default: str = ""


@dataclass(frozen=True)
class Item:
    """One of a choice. value: as the command has it; the panel's is the same in capitals."""

    value: str
    label: str
    description: str


@dataclass(frozen=True)
class Choice:
    """One of several. default: a value; None: the first item's, and in the command none. enum: whose members the values
    name in Settings, None where they stand there as they are."""

    items: tuple[Item, ...]
    default: str | None = None
    enum: type[Enum] | None = None

    @property
    def values(self) -> list[str]:
        """As the command has them."""
        return [item.value for item in self.items]


@dataclass(frozen=True)
class Pointer:
    """Something of the file: a Collection, an Image, or an Object that is a mesh."""

    to: str


Kind = Switch | Whole | Real | Text | Choice | Pointer


_VALUES: Mapping[type, tuple[type, ...]] = {Switch: (bool,), Whole: (int,), Real: (float, int), Text: (str,)}


def is_value(kind: Kind, value: object) -> bool:
    """Whether a value of the panel's is of this kind; of a pointer none is."""
    if isinstance(kind, Choice):
        return value in [item.upper() for item in kind.values]
    return type(value) in _VALUES.get(type(kind), ())


@dataclass(frozen=True)
class Flag:
    """An option in the command. arguments: what `add_argument` takes beside the help, and beside what the kind tells.
    group: flags of one name exclude one another."""

    name: str
    help: str
    arguments: Mapping[str, Any] = field(default_factory=dict)
    group: str = ""


@dataclass(frozen=True)
class Place:
    """An option in the panel. panel: which, by its key; empty: it is drawn by that panel's own code. at: where in it.
    text: its name there, None for the property's own. expand: whether all items are shown side by side. shown, active:
    whether it is there, and whether it counts, by the other settings."""

    label: str
    description: str = ""
    panel: str = ""
    at: int = 0
    text: str | None = None
    expand: bool = False
    shown: Callable[[Chosen], bool] | None = None
    active: Callable[[Chosen], bool] | None = None


@dataclass(frozen=True)
class Told:
    """What images and reports say of an option. name: what they call it. at: its place among the others. words: how its
    value is told, None: as it is."""

    name: str
    at: int = 99
    words: Callable[[Any], str | int | float] | None = None


@dataclass(frozen=True)
class Option:
    """name: of the property in the panel and of the argument in the command. into: where its value stands in Settings,
    as "rays.distance"; empty where more than one option makes it up, or none of Settings. from_panel: the property's
    value as the command has it, by the other settings; None: as it is, items of a choice in small letters."""

    name: str
    kind: Kind
    flag: Flag | None = None
    place: Place | None = None
    into: str = ""
    told: Told | None = None
    from_panel: Callable[[Chosen], Any] | None = None

    def read(self, chosen: Chosen) -> Any:
        """Its value as the command has it, of the panel's settings."""
        if self.from_panel is not None:
            return self.from_panel(chosen)
        value = getattr(chosen, self.name)
        if isinstance(self.kind, Real) and self.kind.unit == ANGLE:  # the property is in radians, and a float32
            return min(max(math.degrees(value), self.kind.low), self.kind.high or math.inf)
        return value.lower() if isinstance(self.kind, Choice) else value

    def to_settings(self, value: Any) -> Any:
        """A value of the command's as Settings have it."""
        return self.kind.enum[value.upper()] if isinstance(self.kind, Choice) and self.kind.enum else value

    def from_settings(self, settings: Any) -> Any:
        """Its value in Settings, as the command has it."""
        value = attrgetter(self.into)(settings)
        return value.name.lower() if isinstance(value, Enum) else value

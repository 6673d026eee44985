"""What a command wants of a case: which bakers, how fine, how long."""

from __future__ import annotations

import argparse
from dataclasses import replace
from fractions import Fraction

from .bakers import (
    CYCLES_DEFAULT,
    DEFAULTS,
    ERRORS,
    FURTHER,
    OURS_ERROR,
    PEERS,
    WORDS,
    Baker,
    bakers,
    quick_settings_of,
    settings_of,
)
from .cases import MAPS, Case, is_trial
from .classes import AIM, BRACKET_SIZE, BRACKETED

PATIENCE = 4.0  # points that are expected to take so many times the budget are left out
BRACKET_SECONDS = 1800.0  # what a point that goes all the way may take


def bakers_for(case: Case, chosen: argparse.Namespace) -> list[Baker]:
    """With the settings that they are to be measured at."""
    spec = MAPS[case.map]
    wanted = [WORDS[word] for word in chosen.bakers or WORDS]
    if chosen.quick:
        made = bakers(spec, quick_settings_of)
    elif is_trial(chosen):
        made = [_until(finest(chosen), each) for each in bakers(spec, lambda name: _asked_for(name, chosen))]
    else:
        made = [_bracketing(case, each) for each in bakers(spec, settings_of)]
    return [each for each in made if each.name in wanted]


def finest(chosen: argparse.Namespace) -> float:
    """The least of the errors asked for."""
    return min(float(Fraction(error)) for error in chosen.errors or ERRORS)


def longest(baker: Baker, setting: str, chosen: argparse.Namespace) -> float:
    """Seconds that a point may be expected to take and yet is measured."""
    limit: float = chosen.longest or PATIENCE * chosen.budget
    return limit if is_trial(chosen) or setting not in baker.further else max(limit, BRACKET_SECONDS)


def _asked_for(name: str, chosen: argparse.Namespace) -> tuple[str, ...]:
    """Of ours the errors asked for; what others take, `_until` says."""
    return {OURS_ERROR: tuple(chosen.errors or ERRORS), CYCLES_DEFAULT: (DEFAULTS,)}.get(name, ())


def _until(error: float, baker: Baker) -> Baker:
    """Rays or samples until this error."""
    if baker.settings:
        return baker
    return replace(baker, further=(*(str(4**power) for power in range(5)), *FURTHER[1:]), until=error)


def _bracketing(case: Case, baker: Baker) -> Baker:
    """Finer than others where peers go all the way."""
    if case.scene not in BRACKETED or case.size != BRACKET_SIZE or baker.name not in PEERS:
        return baker
    further = tuple(each for each in FURTHER if baker.cost(each) > baker.cost(baker.settings[-1]))
    return replace(baker, further=further, until=float(Fraction(AIM)))

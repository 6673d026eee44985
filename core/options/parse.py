"""How the command's words become values."""

from __future__ import annotations

import argparse


def error(text: str) -> float:
    """ "0.004" or "1/255"."""
    above, slash, below = text.partition("/")
    try:
        return float(above) / (float(below) if slash else 1.0)
    except (ValueError, ZeroDivisionError):
        raise argparse.ArgumentTypeError(f"{text!r} is no error; give one as 0.004 or 1/255") from None


def channel(text: str) -> tuple[str, str]:
    """ "orm.png:R"."""
    name, _, letter = text.rpartition(":")
    if not name or letter.upper() not in ("R", "G", "B", "A"):
        raise argparse.ArgumentTypeError(f"{text!r} is no channel of a file; give one as orm.png:R")
    return name, letter.upper()


def size(text: str) -> tuple[int, int]:
    """ "1024" or "2048x1024"."""
    try:
        parts = [int(part) for part in text.lower().split("x")]
    except ValueError:
        parts = []
    if len(parts) not in (1, 2):
        raise argparse.ArgumentTypeError(f"{text!r} is no size; give texels as 1024 or 2048x1024")
    return parts[0], parts[-1]

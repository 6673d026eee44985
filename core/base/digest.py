"""A hash of data: arrays, numbers, words and dataclasses of these. Equal data, equal hash, on every machine."""

from __future__ import annotations

import hashlib
from collections.abc import Collection, Mapping
from dataclasses import fields, is_dataclass
from enum import Enum
from typing import Any

import numpy as np

SIZE = 32  # bytes of a digest


def digest(*values: Any) -> bytes:
    """SHA-256 of values one after the other: numbers, strings, bytes, enums, None, arrays, mappings, dataclasses, and
    collections of these, of which sets are sorted. Arrays count by dtype, shape and content. Raises TypeError for
    anything else."""
    hasher = hashlib.sha256()
    for value in values:
        _feed(hasher, value)
    return hasher.digest()


def _feed(hasher: Any, value: Any) -> None:
    """Each value's kind and length go first, so that no two lists of values read the same."""
    if isinstance(value, np.ndarray):
        hasher.update(f"a{value.dtype.str}{value.shape}".encode())
        hasher.update(np.ascontiguousarray(value).reshape(-1).view(np.uint8).data)
    elif isinstance(value, Enum):
        _feed(hasher, value.name)
    elif value is None or isinstance(value, (bool, int, float)):
        plain = float(value) if isinstance(value, float) else value  # numpy's own are told otherwise by each version
        hasher.update(f"{plain!r};".encode())
    elif isinstance(value, (str, bytes)):
        data = value.encode(errors="surrogatepass") if isinstance(value, str) else value
        hasher.update(f"{type(value).__name__}{len(data)}:".encode() + data)
    elif is_dataclass(value):
        hasher.update(type(value).__name__.encode())
        _feed(hasher, {each.name: getattr(value, each.name) for each in fields(value)})
    elif isinstance(value, Mapping):
        _feed(hasher, [part for item in value.items() for part in item])
    elif isinstance(value, Collection):
        hasher.update(f"[{len(value)}".encode())
        for each in sorted(value) if isinstance(value, (set, frozenset)) else value:
            _feed(hasher, each)
    else:
        raise TypeError(f"{type(value).__name__} has no digest")

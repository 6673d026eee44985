"""Work in numpy that several threads share."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

Piece = TypeVar("Piece")


def for_each(work: Callable[[Piece], None], pieces: Iterable[Piece], threads: int = 0) -> None:
    """Do the work on every piece. threads 0: as many as there are processors. Raises what the work raises."""
    with ThreadPoolExecutor(threads or os.cpu_count()) as pool:
        for _ in pool.map(work, pieces):
            pass

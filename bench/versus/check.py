"""What a check says on the screen: each scene's seconds, error, and ratios at the errors asked for."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from ..tables import table
from .bakers import CYCLES, ERRORS, OURS_ERROR, OURS_RAYS, PEERS
from .class_figures import NONE
from .curves import ratio_at
from .record import Record

COLUMNS = ("case", "asked for", "s", "RMSE made", "told / made", "rays a texel", "times as long: Cycles", "ours plain")


def lines_of(records: Sequence[Record], errors: Sequence[str]) -> list[str]:
    """A table, and below it what each peer was measured at. errors: asked for, empty for all."""
    rows = [row for record in records for row in _rows(record, errors or ERRORS)]
    return ["", *table(COLUMNS, rows), "", *(line for record in records for line in _peers(record)), ""]


def _rows(record: Record, errors: Sequence[str]) -> Iterator[tuple[str, ...]]:
    for point in record.of(OURS_ERROR):
        if point.setting in errors:
            made = point.corrected(record.noise)
            over = record.told_over_made(point)
            told = NONE if over is None else f"{over:.2f}"
            rays = f"{(point.runs[0].rays or 0) / record.about['texels']:.1f}"
            ratios = [_ratio(record, peer, made) for peer in (CYCLES, OURS_RAYS)]
            yield record.name, point.setting, f"{point.seconds:.2f}", f"{made:.5f}", told, rays, *ratios


def _ratio(record: Record, peer: str, rmse: float) -> str:
    """At the RMSE that ours made."""
    curves = record.curve(OURS_ERROR), record.curve(peer)
    return str(ratio_at(rmse, *curves) or NONE) if all(curves) else ""


def _peers(record: Record) -> Iterator[str]:
    for peer in (*PEERS, OURS_RAYS):
        points = [
            f"{point.setting}: {point.seconds:.1f} s, {point.corrected(record.noise):.5f}" for point in record.of(peer)
        ]
        if points:
            yield f"{record.name}, {peer}, its settings, seconds and RMSE: {'; '.join(points)}"
    yield from (f"{record.name}, skipped: {what}: {why}" for what, why in record.skipped.items())

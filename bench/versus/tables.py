"""The measured points as CSV, a file a scene and size."""

from __future__ import annotations

import csv
from pathlib import Path

from .store import KEPT, Point, Record

COLUMNS = (
    *("scene", "size", "baker", "setting"),
    *("round_seconds", "median_seconds"),
    *("rmse", "rmse_as_measured", "bias", "p99"),
    *("estimated_rmse", "estimated_p99", "texels", "rays"),
)


def write_table(record: Record) -> Path:
    """A row a point. rmse is without the reference's noise; seconds of the rounds stand in one field, by spaces."""
    KEPT.mkdir(parents=True, exist_ok=True)
    path = KEPT / f"{record.name}.csv"
    with path.open("w", encoding="utf-8", newline="") as stream:
        table = csv.writer(stream, lineterminator="\n")
        table.writerow(COLUMNS)
        table.writerows(_row(record, point) for point in record.points if point.runs)
    return path


def _row(record: Record, point: Point) -> list[object]:
    last = point.runs[-1]
    own = ["" if each is None else f"{each:.6f}" for each in (last.estimated, last.estimated_p99)]
    return [
        *(record.scene, record.size, point.baker, point.setting),
        *(" ".join(f"{run.seconds:.4f}" for run in point.runs), f"{point.seconds:.4f}"),
        *(f"{point.corrected(record.noise):.6f}", f"{point.rmse:.6f}", f"{point.bias:.6f}", f"{last.p99:.6f}"),
        *(*own, last.texels, "" if last.rays is None else last.rays),
    ]

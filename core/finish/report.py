"""What a bake reports: one JSON object, and the metadata of its images."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ..base.atomic_file import replacing
from ..base.errors import InputError
from ..base.version import version
from .baked import Baked, Metadata
from .compare import Comparison

STAGES = (
    *("extract", "charts", "inputs", "texels", "build", "inside"),
    *("trace", "solve", "probe", "finish", "code", "write"),
)
Json = dict[str, Any]


def object_entry(baked: Baked, files: Mapping[str, Path]) -> Json:
    """One baked object. Times in seconds; `total` is from the button to the texture."""
    seconds = {stage: baked.seconds.get(stage, 0.0) for stage in STAGES}
    return {
        "name": baked.name,
        "size": list(baked.size),
        "texels": baked.texels,
        "rays": baked.rays,
        "seconds": {**seconds, "total": sum(seconds.values())},
        "error": {name: each.error for name, each in baked.maps.items()},
        "p99": {name: each.p99 for name, each in baked.maps.items()},
        "mean": {name: each.mean for name, each in baked.maps.items()},
        "inside": baked.surface.interior,
        "turned": baked.surface.flipped,
        "buried": baked.surface.buried,
        "overlapped": baked.surface.overlapped,
        **({} if baked.tile is None else {"tile": baked.tile}),
        "files": {name: str(path) for name, path in files.items()},
        "warnings": list(baked.warnings),
    }


def error_in_words(entry: Json, name: str) -> str:
    """The error of one of the entry's maps."""
    return f"±{entry['error'][name]:.4f} (99 % within {entry['p99'][name]:.4f})"


def summary(entry: Json) -> str:
    """An entry in a line."""
    seconds, (width, height) = entry["seconds"], entry["size"]
    errors = ", ".join(f"{name} {error_in_words(entry, name)}" for name in entry["error"])
    return (
        f"{entry['name']}: {width}x{height}, {entry['texels']:,} texels, {entry['rays']:,} rays in "
        f"{seconds['total']:.2f} s ({million_rays_per_second(entry):.1f} million rays a second); RMSE {errors}"
    )


def rays_per_texel(entry: Json) -> float:
    """Rays a texel of an entry: those of all its maps, but for those that measured their error."""
    return float(entry["rays"] / max(entry["texels"], 1))


def million_rays_per_second(entry: Json) -> float:
    """Of an entry's tracing."""
    seconds = entry["seconds"]["trace"] + entry["seconds"]["code"]
    return float(entry["rays"] / max(seconds, 1e-9) / 1e6)


def first_of(names: Sequence[str], most: int) -> str:
    """ "A, B and 3 more": so many of the names in a line, and how many are left."""
    more = f" and {len(names) - most} more" if len(names) > most else ""
    return f"{', '.join(names[:most])}{more}"


def comparison_entry(comparison: Comparison, samples: int, seconds: float, other_owner: int, picture: Path) -> Json:
    """How an object's AO compares with Cycles'. other_owner: texels that Cycles gives to another triangle."""
    return {
        "samples": samples,
        "seconds": seconds,
        "texels": comparison.texels,
        "rmse": comparison.rmse,
        "bias": comparison.bias,
        "p99": comparison.p99,
        "texels_of_another_triangle": other_owner,
        "picture": str(picture),
    }


def comparison_total(entries: Iterable[Json]) -> Json:
    """All comparisons of these entries of objects together; nothing where there are none. p99 is the largest of theirs,
    and so a bound. own_seconds: of our bakes."""
    compared = [entry for entry in entries if "cycles" in entry]
    cycles = [entry["cycles"] for entry in compared]
    if not cycles:
        return {}
    texels = np.array([each["texels"] for each in cycles], dtype=np.float64)
    return {
        "images": len(cycles),
        "samples": cycles[0]["samples"],
        "seconds": sum(each["seconds"] for each in cycles),
        "own_seconds": sum(entry["seconds"]["total"] for entry in compared),
        "texels": int(texels.sum()),
        "rmse": float(np.sqrt(np.average([each["rmse"] ** 2 for each in cycles], weights=texels))),
        "bias": float(np.average([each["bias"] for each in cycles], weights=texels)),
        "p99": max(each["p99"] for each in cycles),
    }


def times_as_long(entry: Json) -> float:
    """How much longer a sample takes Cycles than a ray takes here, all stages of both counted: the two seldom take as
    many."""
    cycles = entry["cycles"]
    return float(cycles["seconds"] / cycles["samples"] / (entry["seconds"]["total"] / rays_per_texel(entry)))


def whole_report(asked: Mapping[str, Any], embree: str, seconds: Mapping[str, float], objects: Iterable[Json]) -> Json:
    """The report of one run. asked: what was, by its options. embree: what traced. seconds: what several objects
    share, and `total`."""
    return {
        "version": version(),
        "embree": embree,
        **asked,
        "seconds": dict(seconds),
        "objects": list(objects),
    }


def image_metadata(baked: Baked, name: str, asked: Metadata) -> dict[str, str | int | float]:
    """What an image says of itself: what was baked, how, and how well. rays_per_texel: the mean of what was traced.
    asked: what was, by its options."""
    made = baked.maps[name]
    return {
        "software": f"Occlusion Bake {version()}",
        "object": baked.name,
        **made.kind.description(),
        "rays_per_texel": round(made.rays / max(int(np.count_nonzero(made.covered)), 1), 1),
        **asked,
        "estimated_rmse": made.error,
        "estimated_p99": made.p99,
    }


def write_report(path: Path, report: Json) -> None:
    """Write the report whole: beside its place first, then renamed. Raises InputError naming the path."""
    text = json.dumps(report, indent=2, allow_nan=False) + "\n"
    try:
        with replacing(path) as temporary:
            temporary.write_text(text, encoding="utf-8")
    except OSError as error:
        reason = error.strerror or error
        raise InputError(f"{path}: the report cannot be written ({reason}); choose another place") from error

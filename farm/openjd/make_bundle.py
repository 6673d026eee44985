"""make_bundle.py MANIFEST BUNDLE [--blender PATH] [--items-per-task N] [--threads N]: a job bundle of what was planned.

BUNDLE: a new folder with the template and its parameters: parameter_values.json as AWS Deadline Cloud reads it
(`deadline bundle submit BUNDLE`), parameters.json as openjd does (`-p file://…`). Needs nothing but Python.
"""

from __future__ import annotations

import argparse
import json
import shutil
from pathlib import Path

TEMPLATE = Path(__file__).resolve().parent / "template.yaml"


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n\n")[2])
    parser.add_argument("manifest", type=Path, metavar="MANIFEST")
    parser.add_argument("bundle", type=Path, metavar="BUNDLE")
    parser.add_argument("--blender", default="blender", help="as the machines have it (blender)")
    parser.add_argument("--items-per-task", type=int, default=100, help="(100)")
    parser.add_argument("--threads", type=int, default=0, help="for tracing, 0 for all (0)")
    options = parser.parse_args()
    if options.items_per_task < 1:
        raise SystemExit(f"--items-per-task {options.items_per_task}: give 1 or more")
    count = item_count(options.manifest)
    try:
        options.bundle.mkdir(parents=True)
    except FileExistsError:
        raise SystemExit(f"{options.bundle}: it is there already; give the name of a new folder") from None
    shutil.copy(TEMPLATE, options.bundle)
    parameters = {
        "JobName": f"Occlusion Bake {options.manifest.stem}",
        "Manifest": str(options.manifest.resolve()),
        "Items": f"0-{count - 1}",
        "ItemsPerTask": options.items_per_task,
        "Blender": options.blender,
        "Threads": options.threads,
    }
    values = {"parameterValues": [{"name": name, "value": value} for name, value in parameters.items()]}
    for name, content in (("parameter_values.json", values), ("parameters.json", parameters)):
        (options.bundle / name).write_text(json.dumps(content, indent=2) + "\n", encoding="utf-8")
    print(f"{options.bundle}: {count} items, {-(-count // options.items_per_task)} tasks and the merge")  # noqa: T201


def item_count(manifest: Path) -> int:
    """How many items a manifest has. SystemExit where it is none."""
    try:
        items = json.loads(manifest.read_text(encoding="utf-8"))["items"]
    except (OSError, ValueError, LookupError, TypeError) as error:
        raise SystemExit(f"{manifest}: it is no manifest ({error}); give one that plan has written") from error
    if not items:
        raise SystemExit(f"{manifest}: it has no items; plan again")
    return len(items)


if __name__ == "__main__":
    main()

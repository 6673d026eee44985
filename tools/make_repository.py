"""make_repository.py FOLDER ZIP…: a static repository of extensions, to be put on any web host as it is.

Blender's own tool writes index.json, which Blender reads, and index.html, which people do. The same zips make the same
bytes. The folder is made anew.
"""

from __future__ import annotations

import importlib.util
import json
import shutil
import subprocess
import sys
from pathlib import Path

PAGE = Path(__file__).with_name("repository_page.html")


def blenders_tool() -> Path:
    """The program that `blender --command extension` is made of, which runs without a Blender."""
    spec = importlib.util.find_spec("bpy")
    if spec is None or spec.origin is None:
        raise SystemExit("no Blender as a Python module here: run it by the environment of `make venv`")
    found = sorted(Path(spec.origin).parent.glob("*/scripts/addons_core/bl_pkg/cli/blender_ext.py"))
    if not found:
        raise SystemExit(f"{Path(spec.origin).parent} has no tool for extensions")
    return found[0]


def main(folder: Path, zips: list[Path]) -> None:
    if folder.exists():
        shutil.rmtree(folder)
    folder.mkdir(parents=True)
    for archive in zips:
        shutil.copyfile(archive, folder / archive.name)
    command = [sys.executable, str(blenders_tool()), "server-generate", "--repo-dir", str(folder), "--html"]
    if status := subprocess.run([*command, "--html-template", str(PAGE)]).returncode:
        raise SystemExit(f"Blender's tool ended with {status}; its own lines above say why")
    put_in_order(folder / "index.json")
    print(f"{folder}: {', '.join(sorted(path.name for path in folder.iterdir()))}")


def put_in_order(index: Path) -> None:
    """Entries stand in it as the folder happens to list its files."""
    content = json.loads(index.read_text(encoding="utf-8"))
    content["data"].sort(key=lambda entry: (entry["id"], entry["version"], entry.get("platforms", [])))
    index.write_text(json.dumps(content, indent=2) + "\n", encoding="utf-8")


if __name__ == "__main__":
    if len(sys.argv) < 3:
        raise SystemExit(__doc__)
    main(Path(sys.argv[1]), [Path(name) for name in sys.argv[2:]])

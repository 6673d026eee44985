"""Serve a repository of extensions from this machine, and go an artist's way with it in a complete Blender.

try_repository.py ZIP BLENDER…

The repository is added by its address, the extension installed from it and baked with; a newer version is put in its
place, offered, taken while the old one's libraries are loaded, and baked with; at last it is removed, and nothing is
left.
"""

from __future__ import annotations

import re
import shlex
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from threading import Thread
from typing import Any

import make_repository
from try_extension import BAKE, INSIDE, call, check_bake, environment_of, newer, version_of

NAME, EXTENSION = "tried", "occlusion_bake"  # Blender's name for the repository, and ours
INSTALLED = ("OpenImageIO", "embreex", "occlusion_bake_kernel")


class _Quiet(SimpleHTTPRequestHandler):
    def log_message(self, format: str, *args: Any) -> None:  # noqa: A002
        """Nothing of each request."""


@contextmanager
def served(folder: Path) -> Iterator[str]:
    """A folder on this machine's web; its address."""
    server = ThreadingHTTPServer(("127.0.0.1", 0), partial(_Quiet, directory=str(folder)))
    thread = Thread(target=server.serve_forever)
    thread.start()
    try:
        yield f"http://127.0.0.1:{server.server_port}/index.json"
    finally:
        server.shutdown()
        thread.join()
        server.server_close()


def leftovers(profile: Path) -> list[str]:
    """What of the extension or its libraries is still in a profile."""
    found = [*profile.glob(f"extensions/{NAME}/{EXTENSION}*"), *profile.glob(f"extensions/.user/{NAME}/{EXTENSION}*")]
    for package in INSTALLED:
        found += profile.glob(f"extensions/.local/lib/python*/site-packages/{package}*")
    return [str(path.relative_to(profile)) for path in found]


class _Blender:
    """A command that runs a complete Blender, with a profile of its own that may go online."""

    def __init__(self, command: Sequence[str], work: Path) -> None:
        self._command, self.profile = [*command, "--online-mode"], work / "profile"
        self.profile.mkdir()

    def run(self, *arguments: str) -> None:
        call([*self._command, *arguments], self.profile)

    def extension(self, *arguments: str) -> None:
        self.run("--command", "extension", *arguments)

    def listed(self) -> str:
        """What Blender says of each repository's extensions."""
        command = [*self._command, "--command", "extension", "list", "--sync"]
        print("+", shlex.join(command), flush=True)
        environment = environment_of(self.profile)
        ran = subprocess.run(command, env=environment, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, text=True)
        if ran.returncode:
            raise SystemExit(f"FAILED with status {ran.returncode}: {shlex.join(command)}")
        return re.sub(r"\x1b\[[\d;]*m", "", ran.stdout)

    def inside(self, *words: str) -> None:
        self.run("-b", "--python-exit-code", "1", "-P", INSIDE, "--", *words)

    def bake(self, scene: Path, output: Path) -> None:
        report = output.with_suffix(".json")
        self.run("-b", str(scene), "-c", EXTENSION, *BAKE, "--output", str(output), "--report", str(report))
        check_bake(output, report)


def main(archive: Path, command: Sequence[str]) -> None:
    with tempfile.TemporaryDirectory(prefix="occlusion-bake-") as folder:
        work = Path(folder).resolve()
        web, blender = work / "web", _Blender(command, work)
        later = newer(archive, work)
        make_repository.main(web, [archive])
        with served(web) as address:
            try_all(blender, address, web, [archive, later])
    print(f"{archive.name} installs, updates and goes from a repository in {shlex.join(command)}")


def try_all(blender: _Blender, address: str, web: Path, archives: list[Path]) -> None:
    old, new = map(version_of, archives)
    scene = web.parent / "scene.blend"
    blender.extension("repo-add", "--name", NAME, "--url", address, "--source", "USER", "--clear-all", NAME)
    blender.extension("install", "--sync", "--enable", f"{NAME}.{EXTENSION}")
    blender.inside("version", old, "--", "scene", str(scene))
    blender.bake(scene, web.parent / "first")
    make_repository.main(web, archives[1:])
    said = blender.listed()
    print(said)
    if f"{EXTENSION} [outdated: {old} -> {new}]" not in said:
        raise SystemExit(f"FAILED: {new} is not offered where {old} is installed")
    blender.inside("update", new)
    blender.inside("version", new)
    blender.bake(scene, web.parent / "second")
    blender.extension("remove", f"{NAME}.{EXTENSION}")
    if left := leftovers(blender.profile):
        raise SystemExit(f"FAILED: removed, but there is still {', '.join(left)}")


if __name__ == "__main__":
    if len(sys.argv) < 3:
        raise SystemExit(__doc__)
    main(Path(sys.argv[1]).resolve(), sys.argv[2:])

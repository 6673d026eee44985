"""Try a built extension in the window of a complete Blender, with the mouse, then what it has baked in EEVEE.

try_window.py ZIP NAME COMMAND…    COMMAND opens a Blender on a display of its own and gives it the arguments that
follow, once for each session; the screenshots are out/window/NAME_….png
"""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

from try_extension import call

TOOLS = Path(__file__).resolve().parent
FOLDER = TOOLS.parent / "out" / "window"
SESSIONS = ("window_session.py", "window_render.py")


def main(arguments: Sequence[str]) -> None:
    if len(arguments) < 3:
        raise SystemExit(__doc__)
    archive, name, *command = arguments
    FOLDER.mkdir(parents=True, exist_ok=True)
    for session in SESSIONS:
        with tempfile.TemporaryDirectory(prefix="occlusion-bake-") as profile:
            inside = ["-P", str(TOOLS / session), "--", str(Path(archive).resolve()), str(FOLDER), name]
            call([*command, *inside], Path(profile).resolve())
    print(f"{archive} works in the window: {', '.join(path.name for path in sorted(FOLDER.glob(f'{name}_*.png')))}")


if __name__ == "__main__":
    main(sys.argv[1:])

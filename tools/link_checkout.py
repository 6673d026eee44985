"""link_checkout.py FOLDER: the checkout, whatever it is called, on this Python's path as the package occlusion_bake.

FOLDER is made, and holds a link to the checkout alone.
"""

from __future__ import annotations

import sys
import sysconfig
from pathlib import Path

CHECKOUT = Path(__file__).resolve().parent.parent


def main(folder: Path) -> None:
    folder.mkdir(parents=True)
    link(folder / "occlusion_bake", CHECKOUT)
    path = Path(sysconfig.get_path("purelib"), "occlusion_bake.pth")
    path.write_text(f"{folder.resolve()}\n", encoding="utf-8")


def link(path: Path, target: Path) -> None:
    """A link to a folder; on Windows a junction, which asks for no rights."""
    if sys.platform == "win32":
        import _winapi

        _winapi.CreateJunction(str(target), str(path))
    else:
        path.symlink_to(target)


if __name__ == "__main__":
    if len(sys.argv) != 2:
        raise SystemExit(__doc__)
    main(Path(sys.argv[1]))

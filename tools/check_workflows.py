"""The workflows of a public host, checked by actionlint; skipped aloud where there is no go to fetch it by."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
ACTIONLINT = "github.com/rhysd/actionlint/cmd/actionlint@v1.7.12"


def main() -> int:
    go = shutil.which("go")
    if go is None:
        print("SKIPPED the workflows: no go, by which actionlint is fetched")
        return 1 if os.environ.get("OCCLUSION_BAKE_NO_SKIP") else 0
    files = sorted(str(path) for path in (ROOT / ".github" / "workflows").glob("*.yml"))
    return subprocess.run([go, "run", ACTIONLINT, "-no-color", *files], cwd=ROOT).returncode


if __name__ == "__main__":
    sys.exit(main())

"""The page of settings is what the table of options says."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]


def test_the_page_is_as_the_table_has_it(tmp_path: Path) -> None:
    made = tmp_path / "settings.md"
    subprocess.run([sys.executable, str(ROOT / "tools" / "write_settings.py"), str(made)], check=True)
    assert made.read_text(encoding="utf-8") == (ROOT / "docs" / "settings.md").read_text(encoding="utf-8")

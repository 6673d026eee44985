"""How the kernel is built: nothing is compiled twice, and a library for Windows does not tell when it was linked."""

from __future__ import annotations

import importlib
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

KERNEL = Path(__file__).resolve().parents[2] / "core" / "kernel"


@pytest.fixture
def toolchain(monkeypatch: pytest.MonkeyPatch) -> Iterator[Any]:
    monkeypatch.syspath_prepend(str(KERNEL))
    yield importlib.import_module("toolchain")
    sys.modules.pop("toolchain")


def test_the_time_of_linking_is_taken_out_and_nothing_else(toolchain: Any, tmp_path: Path) -> None:
    data = bytearray(range(256)) * 2
    data[0x3C:0x40] = (0x80).to_bytes(4, "little")
    library = tmp_path / "kernel.dll"
    library.write_bytes(data)
    toolchain.undate(library)
    changed = [place for place, (one, other) in enumerate(zip(data, library.read_bytes(), strict=True)) if one != other]
    assert changed == [0x88, 0x89, 0x8A, 0x8B]
    assert library.read_bytes()[0x88:0x8C] == bytes(4)


def test_a_file_is_compiled_again_when_it_or_its_flags_change(
    toolchain: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    ran: list[str] = []

    def run(command: list[str]) -> None:
        ran.append(Path(command[-1]).stem)
        Path(command[-1]).touch()

    monkeypatch.setattr(toolchain, "run", run)
    monkeypatch.setattr(toolchain, "compiler", lambda: [sys.executable])
    one, other = tmp_path / "one.cpp", tmp_path / "other.cpp"
    one.write_text("int one;")
    other.write_text("int other;")

    def compiled(*extra: str) -> list[str]:
        ran.clear()
        toolchain.compile_all([one, other], tmp_path / "work", extra)
        return sorted(ran)

    assert compiled() == ["one", "other"]
    assert compiled() == []
    one.write_text("long one;")
    assert compiled() == ["one"]
    assert compiled("-O0") == ["one", "other"]
    (tmp_path / "work" / "other.o").unlink()
    assert compiled("-O0") == ["other"]

"""What objects' files are called."""

from __future__ import annotations

import random
from pathlib import Path

import pytest
from occlusion_bake.core.finish import file_names
from occlusion_bake.core.finish.file_names import FileNames, clean_name

NAMES = [
    "a/b",
    "a?b",
    "a_b",
    "a_b_2",
    "Rock",
    "rock",
    "ROCK",
    "caf\u00e9",
    "cafe\u0301",
    "x" * 250,
    "x" * 249 + "y",
    "..",
    "...",
]


@pytest.mark.parametrize("folded", [(True, True), (True, False), (False, False)])
def test_no_two_are_one_file_whatever_the_order(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, folded: tuple[bool, bool]
) -> None:
    monkeypatch.setattr(file_names, "_folded_in", lambda _: folded)
    names = FileNames(tmp_path, NAMES)
    found = {name: names.of(name) for name in NAMES}
    assert len({names.same(stem) for stem in found.values()}) == len(NAMES)
    assert (found["a_b"], found["a/b"], found["a_b_2"], found["a?b"]) == ("a_b", "a_b_3", "a_b_2", "a_b_4")
    assert (found["rock"] == "rock") == (not folded[0])
    shuffled = random.Random(0).sample(NAMES, len(NAMES))
    assert {name: FileNames(tmp_path, shuffled).of(name) for name in NAMES} == found
    late = names.of("A_B")  # an atlas, say
    assert names.of("A_B") == late and (late == "A_B") == (not folded[0])


def test_a_folder_tells_what_it_takes_for_one(tmp_path: Path) -> None:
    """As the file system has it, of a folder that is there by now or only will be; nothing is left in it."""
    (tmp_path / "rock").touch()
    same = (tmp_path / "ROCK").exists()
    for folder in (tmp_path, tmp_path / "not" / "there"):
        names = FileNames(folder)
        assert (names.same("Rock") == names.same("rock")) == same
    assert [path.name for path in tmp_path.iterdir()] == ["rock"]


@pytest.mark.parametrize(
    ("name", "clean"),
    [
        ("Wall/left", "Wall_left"),
        ('<a>:"b"|c\\?*\n', "_a___b__c____"),
        (" Tree. ", "Tree"),
        ("...", "object"),
        ("Cube.001", "Cube.001"),
        ("Cube.1001", "Cube_1001"),
        ("con", "_con"),
        ("LPT1.x", "_LPT1.x"),
        ("console", "console"),
        ("\udcff", "_"),
        ("立" * 80, "立" * 60),
    ],
)
def test_clean_names(name: str, clean: str) -> None:
    assert clean_name(name) == clean

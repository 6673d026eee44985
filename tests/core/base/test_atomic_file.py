"""Files that appear whole: what they replace, and what stays of it."""

from __future__ import annotations

import os
from pathlib import Path

import pytest
from occlusion_bake.core.base.atomic_file import check_place, replacing
from occlusion_bake.core.base.errors import InputError


def write(path: Path, text: str) -> None:
    with replacing(path) as temporary:
        temporary.write_text(text)


def test_mode_and_owner_stay(tmp_path: Path) -> None:
    path = tmp_path / "map.png"
    path.touch()
    path.chmod(0o640)
    if root := getattr(os, "geteuid", lambda: 1)() == 0:
        os.chown(path, 12345, 54321)
    write(path, "new")
    left = path.stat()
    assert path.read_text() == "new"
    if os.name == "posix":  # elsewhere files have no mode
        assert left.st_mode & 0o777 == 0o640
    if root:
        assert (left.st_uid, left.st_gid) == (12345, 54321)


def test_a_new_file_is_as_any_other(tmp_path: Path) -> None:
    (tmp_path / "other").touch()
    write(tmp_path / "new", "")
    assert (tmp_path / "new").stat().st_mode == (tmp_path / "other").stat().st_mode


@pytest.fixture(scope="module")
def links(tmp_path_factory: pytest.TempPathFactory) -> None:
    """Symbolic links, which Windows makes for administrators alone, and Wine not at all."""
    link = tmp_path_factory.mktemp("links") / "link"
    try:
        link.symlink_to("nowhere")
    except OSError:
        pytest.skip("this system makes no symbolic links")
    if not link.is_symlink():
        pytest.skip("this system's symbolic links are none")


@pytest.mark.usefixtures("links")
@pytest.mark.parametrize("there", [True, False], ids=["", "that leads nowhere"])
@pytest.mark.parametrize("relative", [True, False])
def test_a_symbolic_link_stays_and_what_it_leads_to_is_replaced(tmp_path: Path, there: bool, relative: bool) -> None:
    (tmp_path / "store").mkdir()
    stored, link = tmp_path / "store" / "0f3a", tmp_path / "map.png"
    if there:
        stored.write_text("old")
    link.symlink_to("store/0f3a" if relative else stored)
    with replacing(link) as temporary:
        assert temporary.suffix == ".png"  # by which the format is known
        temporary.write_text("new")
    assert link.is_symlink() and stored.read_text() == "new"
    assert len(list(tmp_path.rglob("*"))) == 3


@pytest.mark.usefixtures("links")
def test_after_a_failure_all_is_as_it_was(tmp_path: Path) -> None:
    (tmp_path / "stored").write_text("old")
    (tmp_path / "link").symlink_to("stored")
    with pytest.raises(ZeroDivisionError), replacing(tmp_path / "link") as temporary:
        temporary.write_text("new")
        raise ZeroDivisionError
    assert sorted(path.name for path in tmp_path.iterdir()) == ["link", "stored"]
    assert (tmp_path / "link").read_text() == "old"


def in_the_way(path: Path, what: str) -> None:
    if what == "folder":
        path.mkdir()
    elif what == "pipe":
        os.mkfifo(path)
    else:
        path.symlink_to(path.name)


@pytest.mark.skipif(os.name != "posix", reason="makes pipes and links")
@pytest.mark.parametrize(
    ("what", "words"), [("folder", "a folder"), ("pipe", "a device or pipe"), ("circle", "symbolic links")]
)
def test_what_is_no_file_is_left_alone(tmp_path: Path, what: str, words: str) -> None:
    path = tmp_path / "taken"
    in_the_way(path, what)
    with pytest.raises(InputError, match=f"taken: .*{words}.*; .*choose another"):
        write(path, "new")
    assert [each.name for each in tmp_path.iterdir()] == ["taken"] and not path.is_file()


def test_a_name_that_cannot_be_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="choose a shorter name"):
        check_place(tmp_path / ("x" * 300))

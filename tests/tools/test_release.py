"""What a release is refused for, and what stands in it: of wheels and zips made up here."""

from __future__ import annotations

import importlib
import sys
import zipfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

TOOLS = Path(__file__).resolve().parents[2] / "tools"


@pytest.fixture
def tools(monkeypatch: pytest.MonkeyPatch) -> Iterator[Any]:
    """The tools by their names, as they import one another."""
    monkeypatch.syspath_prepend(str(TOOLS))
    before = set(sys.modules)
    yield importlib.import_module
    for name in set(sys.modules) - before:
        if str(TOOLS) in str(getattr(sys.modules[name], "__file__", "")):
            del sys.modules[name]


def wheel(folder: Path, name: str, version: str, **files: str) -> Path:
    """One that holds these files."""
    path = folder / f"{name}-{version}-py3-none-any.whl"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr(f"{name}-{version}.dist-info/METADATA", f"Name: {name}\nVersion: {version}\n")
        for file, text in files.items():
            archive.writestr(file, text)
    return path


def extension(folder: Path, version: str, *wheels: Path) -> Path:
    path = folder / f"occlusion_bake-{version}-linux_x64.zip"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("blender_manifest.toml", f'id = "occlusion_bake"\nversion = "{version}"\n')
        for each in wheels:
            archive.write(each, f"wheels/{each.name}")
    return path


def test_a_wheel_is_told_with_what_it_brings_along(tools: Any, tmp_path: Path) -> None:
    files = {
        "embreex-4.0.dist-info/licenses/LICENSE": "so be it",
        "embreex.libs/libembree4-4aef.so.4": "",
        "embreex.libs/libtbb-dcf6.so.12": "",
    }
    path = wheel(tmp_path, "embreex", "4.0", **files)
    own, *inside = tools("licences").parts(path.name, path)
    assert (own.name, own.version, own.licence, own.texts) == ("embreex", "4.0", "MIT", {"LICENSE": b"so be it"})
    assert [(part.name, part.licence) for part in inside] == [("Embree", "Apache-2.0"), ("oneTBB", "Apache-2.0")]
    assert all(b"Apache License" in text for part in inside for text in part.texts.values())


@pytest.mark.parametrize(
    ("name", "file"), [("nobody", "nobody/__init__.py"), ("embreex", "embreex.libs/libstranger.so.1")]
)
def test_what_has_no_known_licence_is_not_handed_on(tools: Any, tmp_path: Path, name: str, file: str) -> None:
    path = wheel(tmp_path, name, "1.0", **{file: ""})
    with pytest.raises(SystemExit, match="is not known") as refusal:
        tools("licences").parts(path.name, path)
    assert (name if name == "nobody" else file) in str(refusal.value)


@pytest.mark.parametrize(
    ("head", "version", "faults"),
    [
        ("## 1.2.0, 2026-12-24", "1.2.0", 0),
        ("## 1.2.0, unreleased", "1.2.0", 1),
        ("## 1.1.0, 2026-12-24", "1.2.0", 1),
        ("", "1.2.0", 1),
    ],
)
def test_the_changelog_begins_with_the_release(
    tools: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, head: str, version: str, faults: int
) -> None:
    pytest.importorskip("cyclonedx", reason="make release installs it")
    release = tools("release")
    (tmp_path / "CHANGELOG.md").write_text(
        f"# Changelog\n\n{head}\n\n## 0.1.0, 2026-01-01\n" if head else "", encoding="utf-8"
    )
    monkeypatch.setattr(release, "ROOT", tmp_path)
    assert len(release.changelog_faults(version)) == faults


def test_a_zip_of_another_version_is_refused(tools: Any, tmp_path: Path) -> None:
    pytest.importorskip("cyclonedx", reason="make release installs it")
    found = tools("release").zip_faults({"version": "1.2.0"}, [extension(tmp_path, "1.1.0")])
    assert any("is of version 1.1.0" in line for line in found)


def test_the_bill_names_every_wheel_once_and_is_the_same_each_time(tools: Any, tmp_path: Path) -> None:
    pytest.importorskip("cyclonedx", reason="make release installs it")
    embreex = wheel(tmp_path, "embreex", "4.0", **{"embreex.libs/libtbb-1.so.12": ""})
    zips = [extension(tmp_path, version, embreex) for version in ("1.2.0", "1.2.1")]
    about = {"id": "occlusion_bake", "name": "Occlusion Bake", "version": "1.2.0"}
    first, second = (tools("release").bill_of_materials(about, zips) for _ in range(2))
    assert first == second
    assert first.count('"purl": "pkg:pypi/embreex@4.0') == 1
    assert '"name": "oneTBB"' in first and '"Apache-2.0"' in first


def test_a_newer_version_differs_in_its_number_alone(tools: Any, tmp_path: Path) -> None:
    old = extension(tmp_path, "1.2.9", wheel(tmp_path, "embreex", "4.0"))
    new = tools("try_extension").newer(old, tmp_path)
    assert new.name == "occlusion_bake-1.2.10-linux_x64.zip"
    assert tools("try_extension").version_of(new) == "1.2.10"
    with zipfile.ZipFile(old) as one, zipfile.ZipFile(new) as other:
        assert one.namelist() == other.namelist()

"""The job bundle fits the template, and is not made of anything but a manifest."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

HOME = Path(__file__).resolve().parents[2] / "farm" / "openjd"


def made(manifest: Path, bundle: Path, *words: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, str(HOME / "make_bundle.py"), str(manifest), str(bundle), *words]
    return subprocess.run(command, capture_output=True, text=True)


@pytest.fixture
def manifest(tmp_path: Path) -> Path:
    path: Path = tmp_path / "manifest.json"
    path.write_text(json.dumps({"items": [{}] * 250}))
    return path


def test_a_bundle_gives_all_parameters_of_the_template(manifest: Path, tmp_path: Path) -> None:
    ran = made(manifest, tmp_path / "bundle", "--items-per-task", "100", "--blender", "/opt/blender")
    assert ran.returncode == 0 and "250 items, 3 tasks" in ran.stdout
    template = (tmp_path / "bundle" / "template.yaml").read_text()
    head, _, steps = template.partition("\nsteps:")
    names = re.findall(r"- name: (\w+)", head)
    plain: dict[str, Any] = json.loads((tmp_path / "bundle" / "parameters.json").read_text())
    listed = json.loads((tmp_path / "bundle" / "parameter_values.json").read_text())["parameterValues"]
    assert list(plain) == names == [each["name"] for each in listed]
    assert {each["name"]: each["value"] for each in listed} == plain
    assert (plain["Items"], plain["Manifest"]) == ("0-249", str(manifest))
    assert set(re.findall(r"{{Param\.(\w+)}}", template)) == set(names)  # none is asked for in vain
    assert "{{Task.Param.Items}}" in steps


@pytest.mark.parametrize("text", ["", "{}", "[]", '{"items": []}'])
def test_what_is_no_manifest(tmp_path: Path, text: str) -> None:
    path = tmp_path / "manifest.json"
    path.write_text(text)
    ran = made(path, tmp_path / "bundle")
    assert ran.returncode == 1 and str(path) in ran.stderr and ran.stderr.count("\n") == 1
    assert not (tmp_path / "bundle").exists()


def test_a_folder_that_is_there_is_left(manifest: Path, tmp_path: Path) -> None:
    (tmp_path / "bundle").mkdir()
    ran = made(manifest, tmp_path / "bundle")
    assert ran.returncode == 1 and "already" in ran.stderr and not list((tmp_path / "bundle").iterdir())

"""release.py FOLDER ZIP…: what is put on the web for a release, checked, with checksums and a bill of materials.

FOLDER holds the repository (make_repository.py) of these zips. The checkout must be clean, the manifest's version must
stand at the head of the changelog with a date, every zip must be of it and pass Blender's own check without a warning.
"""

from __future__ import annotations

import hashlib
import re
import subprocess
import sys
import tomllib
import uuid
import zipfile
from datetime import UTC, datetime
from io import BytesIO
from pathlib import Path
from typing import Any

from cyclonedx.model import HashAlgorithm, HashType
from cyclonedx.model.bom import Bom, BomMetaData
from cyclonedx.model.component import Component, ComponentType
from cyclonedx.model.license import LicenseExpression
from cyclonedx.output.json import JsonV1Dot6
from licences import normal, parts
from make_repository import blenders_tool
from packageurl import PackageURL
from try_extension import MANIFEST, version_of

ROOT = Path(__file__).resolve().parent.parent
OWN_LICENCE = "GPL-3.0-or-later"
_HEADING = re.compile(r"^## (\S+), (\d{4}-\d{2}-\d{2})$")


def main(folder: Path, archives: list[Path]) -> None:
    about = tomllib.loads((ROOT / MANIFEST).read_text(encoding="utf-8"))
    wrong = [*tree_faults(), *changelog_faults(about["version"]), *zip_faults(about, archives)]
    if wrong:
        raise SystemExit("\n".join(f"FAILED: {line}" for line in wrong))
    bill = folder / f"{about['id']}-{about['version']}.cdx.json"
    bill.write_text(bill_of_materials(about, archives), encoding="utf-8")
    sums = folder / "SHA256SUMS"
    files = sorted(path for path in folder.iterdir() if path != sums)
    sums.write_text("".join(f"{sha256(path.read_bytes())}  {path.name}\n" for path in files), encoding="utf-8")
    print(f"Version {about['version']}. Put on the web host, as they are, all of {folder.relative_to(ROOT)}:")
    for path in [*files, sums]:
        print(f"  {path.name}  {path.stat().st_size / 1e6:.1f} MB")
    print(f"Then: git tag v{about['version']} && git push --tags")


def tree_faults() -> list[str]:
    """What is built must be what is committed."""
    changed = _git("status", "--porcelain").splitlines()
    return [f"the checkout has {len(changed)} changes that are not committed, {changed[0].strip()}"] if changed else []


def changelog_faults(version: str) -> list[str]:
    text = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
    head = next((line for line in text.splitlines() if line.startswith("## ")), "")
    found = _HEADING.match(head)
    if found is None or found[1] != version:
        return [f"CHANGELOG.md begins with {head!r}; for this release it should be '## {version}, YYYY-MM-DD'"]
    return []


def zip_faults(about: dict[str, object], archives: list[Path]) -> list[str]:
    """Of another version, twice for a platform, or not as Blender wants it."""
    found = []
    for archive in archives:
        if (version := version_of(archive)) != about["version"]:
            found.append(f"{archive.name} is of version {version}")
        checked = subprocess.run(
            [sys.executable, str(blenders_tool()), "validate", str(archive)], capture_output=True, text=True
        )
        said = checked.stdout + checked.stderr
        if checked.returncode or "warning" in said.lower():
            found.append(f"{archive.name} does not pass Blender's check: {said.strip()}")
    return found


def bill_of_materials(about: dict[str, object], archives: list[Path]) -> str:
    """Every wheel in the zips and what those bring along, in CycloneDX's JSON. The same zips give the same bytes."""
    name, version = str(about["name"]), str(about["version"])
    extension = _component(name, version, OWN_LICENCE, str(about["id"]), kind=ComponentType.APPLICATION)
    wheels = {wheel: data for archive in archives for wheel, data in bundled(archive)}
    components = [_of_wheel(wheel, data) for wheel, data in sorted(wheels.items())]
    bom = Bom(
        serial_number=uuid.uuid5(uuid.NAMESPACE_URL, " ".join(sha256(path.read_bytes()) for path in archives)),
        metadata=BomMetaData(
            timestamp=datetime.fromtimestamp(int(_git("log", "-1", "--format=%ct")), UTC), component=extension
        ),
        components=components,
    )
    bom.register_dependency(extension, components)
    return str(JsonV1Dot6(bom).output_as_string(indent=2))


def _of_wheel(wheel: str, data: bytes) -> Component:
    own, *inside = parts(wheel, BytesIO(data))
    return _component(
        own.name,
        own.version,
        own.licence,
        wheel,
        hashes=[HashType(alg=HashAlgorithm.SHA_256, content=sha256(data))],
        purl=PackageURL("pypi", None, normal(own.name), own.version, {"file_name": wheel}),
        components=[_component(part.name, part.version, part.licence, f"{wheel}/{part.name}") for part in inside],
    )


def _component(
    name: str, version: str, licence: str, ref: str, kind: ComponentType = ComponentType.LIBRARY, **more: Any
) -> Component:
    licences = [LicenseExpression(licence)]
    return Component(name=name, version=version or None, type=kind, licenses=licences, bom_ref=ref, **more)


def bundled(archive: Path) -> list[tuple[str, bytes]]:
    """The wheels in a zip: name and content."""
    with zipfile.ZipFile(archive) as opened:
        names = [name for name in opened.namelist() if name.endswith(".whl")]
        return [(Path(name).name, opened.read(name)) for name in names]


def sha256(data: bytes) -> str:
    return hashlib.sha256(data).hexdigest()


def _git(*words: str) -> str:
    return subprocess.run(["git", *words], cwd=ROOT, capture_output=True, text=True, check=True).stdout.strip()


if __name__ == "__main__":
    if len(sys.argv) < 3:
        raise SystemExit(__doc__)
    main(Path(sys.argv[1]).resolve(), [Path(name) for name in sys.argv[2:]])

"""Marks on meshes: which of their UV maps are ours, what those were made for, and whether an artist has been at them.

A map is ours as long as it has one of our names, a mark, and the UVs that we gave it. Where faces have been added or
removed since, those that are in the place where they were then tell: an edit of the mesh leaves their UVs alone. Where
none is, nothing tells, and the map counts as the artist's.
"""

from __future__ import annotations

import hashlib
import json
from dataclasses import asdict, dataclass
from typing import Any

import bpy
import numpy as np

from ...core.base.arrays import Floats
from ...core.base.foreign_text import json_object
from ..materials.mesh_layers import values_of
from ..read.mesh_arrays import corners_of, polygons_of, positions_of, vertices_of
from ..typed import found_in

CHART_MAP, ATLAS_MAP = "Occlusion Bake", "Occlusion Bake Atlas"
OUR_NAMES = (CHART_MAP, ATLAS_MAP)
_KEYS = {CHART_MAP: "occlusion_bake_charts", ATLAS_MAP: "occlusion_bake_atlas"}  # custom properties of meshes
_OF_UV = np.uint64((1 << 20) - 1)  # the bits of a witness that tell of a triangle's UVs


@dataclass(frozen=True)
class Mark:
    """What a UV map was made for, and how it was left. made_for: a fingerprint of what charts depend on. source: the UV
    map whose charts were laid out anew, empty for none. mesh, uv: fingerprints of its corners and of its UVs."""

    made_for: str
    source: str
    mesh: str
    uv: str


def mark_of(mesh: bpy.types.Mesh, layer: str) -> Mark | None:
    """That of a map of one of our names; None where the mesh has no such map, or we did not make it."""
    if layer not in mesh.uv_layers:
        return None
    try:
        return Mark(**json_object(mesh.get(_KEYS[layer])))
    except TypeError:  # there is none, or it is not as we write them
        return None


def set_mark(mesh: bpy.types.Mesh, layer: str, made_for: str, source: str = "") -> None:
    """A map has just been made, of what this fingerprint tells."""
    uv = _uv_of(mesh, layer)
    mark = Mark(made_for, source, _mesh_fingerprint(mesh), _fingerprint(uv))
    _store(mesh, _KEYS[layer], json.dumps(asdict(mark)))
    _store(mesh, _witness_key(layer), _witnesses(mesh, uv).view(np.int32))


def is_ours(mesh: bpy.types.Mesh, layer: str) -> bool:
    """Whether a UV map was made by us and is as we left it, give or take what edits of the mesh do to it. The mesh is
    not in Edit Mode."""
    mark = mark_of(mesh, layer) if layer in OUR_NAMES else None
    if mark is None:
        return False
    uv = _uv_of(mesh, layer)
    if mark.mesh == _mesh_fingerprint(mesh):
        return mark.uv == _fingerprint(uv)
    return _vouched_for(mesh, uv, layer)


@dataclass(frozen=True)
class KeptMark:
    """A mark as it is stored, to be put back."""

    text: Any
    witnesses: Any

    @staticmethod
    def of(mesh: bpy.types.Mesh, layer: str) -> KeptMark:
        """None in it where there is none."""
        witnesses = mesh.get(_witness_key(layer))
        return KeptMark(mesh.get(_KEYS[layer]), None if witnesses is None else np.array(witnesses, np.int32))

    def is_that_of(self, mesh: bpy.types.Mesh, layer: str) -> bool:
        """Whether no other has been set."""
        return bool(mesh.get(_KEYS[layer]) == self.text)

    def restore(self, mesh: bpy.types.Mesh, layer: str) -> None:
        """Put it back."""
        _store(mesh, _KEYS[layer], self.text)
        _store(mesh, _witness_key(layer), self.witnesses)


def _store(mesh: bpy.types.Mesh, key: str, value: Any) -> None:
    """A custom property, None for none. It is made anew, as Blender 4.5 writes an array over a shorter one past its
    end."""
    if mesh.get(key) is not None:
        del mesh[key]
    if value is not None:
        mesh[key] = value


def _witness_key(layer: str) -> str:
    return f"{_KEYS[layer]}_witnesses"


def _uv_of(mesh: bpy.types.Mesh, layer: str) -> Floats:
    """(L, 2) float32."""
    found: Any = found_in(mesh.uv_layers, layer)
    return values_of(found.uv, "vector", len(mesh.loops), 2) + np.float32(0.0)  # -0 is 0


def _fingerprint(*arrays: Any) -> str:
    digest = hashlib.blake2b(digest_size=16)
    for array in arrays:
        digest.update(array.tobytes())
    return digest.hexdigest()


def _mesh_fingerprint(mesh: bpy.types.Mesh) -> str:
    """Of which corner of which polygon is at which vertex, wherever the vertices are."""
    return _fingerprint(vertices_of(mesh, np.arange(len(mesh.loops), dtype=np.int32)), polygons_of(mesh))


def _hashed(values: Floats) -> Any:
    """(n,) uint64 of float32 (n, …)."""
    words = np.ascontiguousarray(values).view(np.uint32).reshape(len(values), -1)
    mixed = np.zeros(len(words), np.uint64)
    for column in range(words.shape[1]):
        mixed = (mixed ^ words[:, column]) * np.uint64(0x9E3779B97F4A7C15)
        mixed ^= mixed >> np.uint64(29)
    return mixed


def _witnesses(mesh: bpy.types.Mesh, uv: Floats) -> Any:
    """(T,) uint64: of each triangle a hash of where it is, the lower bits one of its UVs."""
    corners = corners_of(mesh)
    places = positions_of(mesh)[vertices_of(mesh, corners)] + np.float32(0.0)  # -0 is 0
    return (_hashed(places) & ~_OF_UV) | (_hashed(uv[corners]) & _OF_UV)


def _vouched_for(mesh: bpy.types.Mesh, uv: Floats, layer: str) -> bool:
    """Whether there are triangles where some were, and all of them have the UVs that those had."""
    known = np.array(mesh.get(_witness_key(layer), ()), np.int32).view(np.uint64)
    now = _witnesses(mesh, uv)
    same = np.isin(now, known)
    return bool(same.any()) and not np.isin(now[~same] & ~_OF_UV, known & ~_OF_UV).any()

"""Who takes part in a bake, to be kept in files: what is baked, from what, and who blocks light."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from typing import Any

from ...core.finish.report import Json
from .block_ref import BlockRef, Renewal, restored, stored
from .high_low_pairs import HighMeshes, Pairing
from .occluder_filter import OccluderFilter


def roles_to_json(
    targets: Collection[BlockRef], highs: Mapping[BlockRef, HighMeshes], occluding: OccluderFilter
) -> Json:
    """For `roles_from_json`, of this Blender or another: objects, and who they are as places in that list. Less those
    that are no more."""
    refs = [*targets, *highs, *(ref for each in highs.values() for ref in (*each.meshes, each.cage) if ref)]
    objects = stored(dict.fromkeys([*(ref.uid for ref in refs), *(occluding.objects or ()), *occluding.excluded]))
    places = {uid: place for place, (uid, *_) in enumerate(objects["objects"])}

    def of(uids: Iterable[int]) -> list[int]:
        return sorted(places[uid] for uid in uids if uid in places)

    return {
        "objects": objects,
        "targets": of(ref.uid for ref in targets),
        "highs": [
            {
                "low": of([low.uid]),
                "meshes": of(ref.uid for ref in each.meshes),
                "cage": of([each.cage.uid] if each.cage else []),
                "extrusion": each.extrusion,
            }
            for low, each in highs.items()
        ],
        "occluders": None if occluding.objects is None else of(occluding.objects),
        "alone": occluding.alone,
        "ground": occluding.ground,
        "excluded": of(occluding.excluded),
    }


def with_target(roles: Json, uid: int) -> Json:
    """The same with another object in all that its one target is. Raises as `roles_from_json`."""
    (place,) = roles["targets"]
    objects = Renewal().of(roles["objects"])
    objects["objects"][place : place + 1] = stored([uid])["objects"]
    return {**roles, "objects": objects}


def roles_from_json(roles: Json) -> tuple[Pairing, OccluderFilter]:
    """What is no more is a reference to nothing, and among occluders left out. Raises LookupError, TypeError and
    ValueError for what is no JSON of ours."""
    objects = restored(roles["objects"])

    def of(places: Iterable[int]) -> tuple[BlockRef, ...]:
        return tuple(objects[place] for place in places)

    def uids(places: Iterable[int]) -> frozenset[int]:
        return frozenset(ref.uid for ref in of(places)) - {0}

    highs = {
        low: HighMeshes(of(each["meshes"]), next(iter(of(each["cage"])), None), _length(each["extrusion"]))
        for each in roles["highs"]
        for low in of(each["low"])
    }
    excluded = uids(roles["excluded"])
    occluders = None if roles["occluders"] is None else uids(roles["occluders"])
    pairing = Pairing(of(roles["targets"]), highs, excluded)
    return pairing, OccluderFilter(occluders, roles["alone"], roles["ground"], excluded)


def _length(kept: Any) -> float | None:
    return None if kept is None else float(kept)

"""Items of a manifest, baked: each as it would be in one run of all, to the last bit."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import replace

from ..bake import Baker
from ..base.errors import InputError
from ..finish.baked import Baked
from ..finish.map_files import Folder
from ..finish.report import Json, object_entry
from ..options.values import told_by_images
from ..progress import Progress
from .atlas_parts import write_part
from .files import PLAN_AGAIN
from .manifest import Item, Manifest, Places
from .records import Record, Records
from .scene_file import StoredScene


class ItemBaker:
    """Bakes items of a manifest in one process. Raises InputError where its scene cannot be read."""

    def __init__(
        self,
        places: Places,
        manifest: Manifest,
        folder: Folder,
        items: Sequence[Item],
        threads: int,
        progress: Progress,
    ) -> None:
        """items: those that it will bake. threads 0: all."""
        self._places, self._manifest, self._folder = places, manifest, folder
        self._records = Records(places, manifest, folder)
        settings = replace(manifest.bake_settings, threads=threads)
        self._told = told_by_images(settings)
        if manifest.atlas is not None:  # whose margin is filled once, when all parts are there
            settings = replace(settings, image=replace(settings.image, margin=0))
        wanted = list(dict.fromkeys(item.target for item in items))
        scene = StoredScene(places.whole(manifest.scene)).with_targets(wanted, settings.rays.reach)
        self._targets = dict(zip(wanted, scene.targets, strict=True))
        self._baker = Baker(scene, settings, progress)
        progress.expect(len(items))

    def bake(self, item: Item) -> Record:
        """Bake an item and keep its files and its record, which is returned; of one that cannot be baked it says why.

        Raises InputError where nothing could be written, or the scene is another one than was planned; Cancelled,
        MemoryError."""
        target = self._targets[item.target]
        if self._baker.inputs_of(target, item.tile) != item.inputs:
            scene = self._places.whole(self._manifest.scene)
            raise InputError(f"{scene}: {item.name} is not as it was planned; {PLAN_AGAIN}")
        try:
            baked = self._baker.bake(target, item.tile)
        except InputError as why:
            record = Record(item.inputs, refused=str(why))
        else:
            baked.warnings += item.warnings
            record = Record(item.inputs, self._written(item, baked), embree=self._baker.device.description)
        self._records.keep(item, record)
        return record

    def _written(self, item: Item, baked: Baked) -> Json:
        """Write its files; returns its entry for the report, with their names as the manifest has them."""
        start = time.perf_counter()
        if self._manifest.atlas is not None:
            write_part(self._places.part(item), baked)
        else:
            self._folder.write(baked, self._told, item.stem)
        baked.seconds["write"] = time.perf_counter() - start
        return {**object_entry(baked, {}), "files": dict(item.files)}

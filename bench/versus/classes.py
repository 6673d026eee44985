"""What kinds of scenes there are, what is aimed at for each, and on which scenes peers go all the way."""

from __future__ import annotations

from dataclasses import dataclass

from ...samples.bench_scenes import OWN_SIZES

SIZE = 1024  # texels a side that figures of classes are of, but of scenes that have a size of their own
AIM = "1/255"  # the RMSE that aims are for
MEAN = 200.0  # times as long as ours Cycles takes over all scenes, at least
TOLD = (0.8, 1.25)  # within which what ours tells of its error is, over what it makes


@dataclass(frozen=True)
class SceneClass:
    """name: in the command. least: how many times as long as ours Cycles takes on each of the scenes, at least."""

    name: str
    title: str
    scenes: tuple[str, ...]
    least: float


CLASSES = (
    SceneClass(
        "scanned", "Scanned and character meshes", ("suzanne", "bunny", "rocker", "spot", "igea", "character"), 60.0
    ),
    SceneClass("hard_surface", "Hard surface", ("part", "gaps"), 200.0),
    SceneClass("high_to_low", "High to low", ("igea_low", "bevel_low"), 60.0),
    SceneClass("simple", "Simple", ("nook", "thinwall", "interior"), 200.0),
    # More triangles in the scene than texels in the image.
    SceneClass("fine", "Finer than texels", ("thousands", "foliage", "sculpt", "instances", "props"), 15.0),
)

# Here, at this size, peers are baked until their RMSE is below AIM's; elsewhere their curves may end before, and are
# carried on.
BRACKETED, BRACKET_SIZE = ("spot", "gaps", "nook", "interior"), 512


def size_of(scene: str) -> int:
    """Texels a side that its class' figures are of."""
    return OWN_SIZES.get(scene, SIZE)

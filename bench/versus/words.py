"""The text of bench/RESULTS.md that does not depend on what was measured."""

from .cycles import SAMPLES, THRESHOLD
from .naive import LIFT, MOST_TRIANGLES

ABOUT = (
    "Seconds and RMSE of AO bakes, ours and others', of the same texels of the same scenes. Written by `make bench`; a "
    "scene alone: `.venv/bin/python -m occlusion_bake.bench.versus SCENE`. All points are in "
    "[results/](results). RMSE is of visibility: 1 open, 0 closed."
)

HOW = f"""How it was measured:

- **Ours to an error**: `Goal(error=E)`, which filters; E from 1/50 to 1/510. **Ours plain**: 1 to 1024 rays, no
  filter. Both from the button to the texture: reading the scene out of Blender, texels, tree, rays, error estimate, a
  PNG of 16 bits. In a process that has baked before, so that loading libraries is out.
- **Cycles**: 1 to 1024 samples, adaptive sampling off, no distance limit, no margin, shadow terminator offset 0, its
  operator alone. **Cycles at its defaults**: the same, but adaptive sampling on, with {SAMPLES} samples at most, noise
  threshold {THRESHOLD:g} and 0 as the fewest samples, as Blender's factory file has it.
- **embreex**, **Open3D**: their occlusion query, and numpy around it. Independent cosine rays, 1 to 256 a texel, from
  the texel's middle, {LIFT:g} of the object's diagonal along the normal. Timed from the scene in Blender to the PNG as
  ours, with our texels and our PNG; embreex on as many Python threads as there are processors.
- With Blender 5.2 (`make bench VENV=.venv-3.13`) Cycles spreads its samples over the whole texel, as we do; in 4.5 over
  its middle alone, ±0.25, which is a difference that no samples remove where occlusion changes within a texel.
- All threads for each. Bakers take turns within a round; what takes over a minute is measured in the first round alone.
  Seconds are medians of the rounds, RMSE is of all rounds together, each of a seed of its own.
- **Reference**: ours plain with thousands of rays a texel (each scene says how many), half of them by one seed and half
  by another, which the bakers do not use. Half the RMS difference of the halves is the noise of their mean; it is taken
  out of every RMSE: √(RMSE² − noise²), at least a quarter of the noise.
- Ours, embreex and Open3D are compared over all covered texels; Cycles over those that it covers, too, and gives to the
  same triangle."""

RULES = """Each figure is the peer's seconds over ours at the RMSE at its column's head: 10 means that the peer takes
ten times as long. Of a baker's points those count that no faster one betters; between two, the logarithm of the seconds
is linear in that of the RMSE.

- ≥: ours at its coarsest is finer than asked, and its coarsest point's seconds are taken. ≤: so is the peer.
- ~: carried on beyond a baker's finest point along its last two, always against us: a peer no steeper than seconds ∝
  RMSE⁻², ours no flatter, and ours at most to half its finest RMSE. Or both are finer than asked at their coarsest.
- –: ours did not get there."""

LIMITS = """## What limits

Aimed at, at 1024x1024 and an RMSE of 1/255: with the filter 200 times Cycles in the mean and 50 on the worst scene, 40
times embreex and Open3D; plain 25 times Cycles and 4 times the two; four times a ray's time from 10 thousand to 10
million triangles. The tables above say which of these are met. What stands between:

- Where the surface has detail finer than a texel (`sculpt`, `instances`, `thousands`, in part `foliage`), neighbours
  differ by more than their noise. The filter then leaves each texel its own value, and a texel takes about as many
  rays as without it: some 700 to 3000 for 1/255. The detail also parts the rays of a packet, so that Embree answers 4
  to 9 million a second there, and 20 to 90 elsewhere; such scenes, with more triangles than texels, are traced as
  incoherent, which is 1.1 to 1.7 times as fast ([the kernel's choices](../docs/figures.md#the-kernels-choices)). What
  is left against Cycles is a ray against a sample, 6 to 10 times. A larger image gets there, since the detail then
  spans texels; a better estimate of single texels would, too.
- At few rays on simple scenes half of the time is not tracing: the filter, the probes, reading the scene, the PNG.
- A ray among more triangles misses the caches: the tree of 10 thousand fits into those of a core, that of 100 thousand
  does not, and takes 2.4 times as long.
- Cycles was not run to 1/255 at 1024x1024: its points end at 64 to 256 samples, and its curve is carried on (~).
"""

NOT_EQUAL = f"""## What was not equal

For us:
- Our reference is our own, and shares whatever bias ours has; the table above says how far it is from Cycles. Cycles is
  compared only where both give a texel to the same triangle, since elsewhere it bakes another surface.
- embreex and Open3D trace from the middle of the texel where we, as Cycles, spread rays over the texel; where occlusion
  changes within a texel they cannot get below that difference, however many rays they take. Their rays begin off the
  surface, and independent random rays converge slower than a point set: a script could have one, and a filter, too.
- Their rays are drawn by numpy, on the clock; a native loop would draw them faster.
- They know no instances here: scenes are copied flat; over {MOST_TRIANGLES // 1_000_000} million triangles they are
  left out.
- Cycles exports the scene and builds its tree for each bake, as we do, but evaluates a shader for each sample; for AO
  it has no other way.

Against us:
- Cycles' seconds are its operator alone: reading the image, and writing a PNG, are not in them.
- Each of our bakes traces more rays to measure its error, and that time is in; nobody else tells an error.
- embreex and Open3D use our extraction, texels and PNG writer.

Cycles' denoiser does not apply to AO bakes; nobody's result was denoised but that of ours to an error, whose filter is
part of it. UV charts, where a model had none, were made before anything was timed."""

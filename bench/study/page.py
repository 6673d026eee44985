"""README.md of the study, with its numbers taken from study.csv."""

from __future__ import annotations

from collections.abc import Sequence
from textwrap import fill

import numpy as np

from .cases import DISTANCE, EDGE, HEIGHT, TILT
from .convergence import FIT_FROM, RANDOM_RAYS, RAYS, Curve
from .figures import Figures

SPHERE, HEMISPHERE = "uniform sphere", "uniform hemisphere"
TARGET = 0.01


def page(curves: Sequence[Curve]) -> str:
    """The whole page, Markdown."""
    found = Figures(curves)
    parts = (
        _integrals(),
        _densities(),
        _one_ray(found),
        _ao(found),
        _ro(found),
        _running(found),
        _seen(found),
        _all(found),
    )
    return "\n\n".join(_wrapped(part) for part in (*parts, _light(), _again())) + "\n"


def _integrals() -> str:
    return f"""# How occlusion is estimated, and how fast the error falls

A ray of light either reaches a point or is blocked on its way: V(ω) is 1 or 0. Two maps come from that.

    AO    = ∫ V(ω) max(n·ω, 0)/π dω                    ambient occlusion
    RO(R) = ∫ V(ω) (e+1)/(2π) max(R·ω, 0)^e dω         reflection occlusion, over the hemisphere of n

n is the normal, R the direction in which the viewer's gaze is mirrored, e the Phong exponent: 10 is satin, 100 nearly
polished. Both integrands are a *lobe*, a bundle of directions about an axis, whose integral over all directions is 1.
For AO the axis is n and the exponent 1. So both maps tell which share of a lobe is open.

The study looks at two points where the answers are known exactly:

- **Beside a wall** without end, {HEIGHT:g} high at a distance of {DISTANCE:g}. Its upper edge is
  {np.degrees(EDGE["wall"]):.1f}° off the vertical, so each lobe is cut. R is the normal, or leans
  {TILT["wall"]:g}° towards the wall.
- **In the open**, a floor and nothing else. R is the normal, or leans {TILT["open"]:g}°: then the floor cuts the lobe.

The exact answers follow from splitting each direction into its angle φ from R in the plane across the wall and the
rest. The rest falls out, and what is left is ∫ cosᵉφ dφ over the open φ, divided by the same over ±90°
([cases.py](cases.py))."""


def _densities() -> str:
    return f"""## Three ways to choose directions

To estimate ∫ V f dω, draw a direction from any density p and take V f/p. The mean of many such estimates tends to the
integral whatever p is. How much they scatter depends on p.

| density | p(ω) | drawn with u in (0, 1] by | V f/p for AO | V f/p for RO |
|---|---|---|---|---|
| {SPHERE} | 1/(4π) | cos θ = 1 − 2u | 4 V max(n·ω, 0) | 2(e+1) V max(R·ω, 0)^e |
| {HEMISPHERE} | 1/(2π) | cos θ = u | 2 V n·ω | (e+1) V max(R·ω, 0)^e |
| the lobe itself (for AO: the cosine) | f | cos θ = u^(1/(e+1)) | V | V, 0 below the floor |

θ is the angle from the axis; the angle about it is 2πv. f/p is a ray's *weight*. A sphere ray is wasted where f is
small and counts for much where f is large. Where p is f, each ray counts the same: this is importance sampling. The
code is as short as the table: [naive.py](naive.py)."""


def _one_ray(found: Figures) -> str:
    away = [_deviation(c) for c in found.curves if c.set == "random" and not c.is_exact]
    return f"""## One ray: theory and measurement

A lobe ray gives 1 with the probability p that is the answer, else 0, so its variance is p(1 − p). For the uniform
densities the mean of (V f/p)² is Ω ∫ V f² dω, Ω being 4π or 2π. The square of a lobe is itself a lobe, of twice the
exponent, times (e+1)²/(2π(2e+1)). So

    variance = k (e+1)²/(2e+1) · RO_2e − RO_e²        k = 2 for the sphere, 1 for the hemisphere

and in the open with R = N it is 5/3 for AO by the sphere, 1/3 by the hemisphere, 0 by the cosine.

![AO of an open floor with one ray a texel](open_one_ray.png)

One random ray a texel; the right value is 1 everywhere, here a middle grey. Half of the sphere's rays go into the
floor. The cosine's rays all bring the same.

Measured over {RANDOM_RAYS:,} single rays each, all {len(away)} standard deviations agree with theory: the farthest is
{max(away):.1f} standard errors away. They are in the tables below."""


def _ao(found: Figures) -> str:
    random = [c.slope for c in found.of("wall", 1.0, 0.0) if c.set == "random"]
    wall = {kind: found.one("wall", 1.0, 0.0, "cosine", kind) for kind in ("random", "shipped")}
    sphere = found.one("wall", 1.0, 0.0, SPHERE, "random")
    smooth = found.one("open", 1.0, 0.0, HEMISPHERE, "shipped")
    return f"""## Many rays: AO

![Error of AO against the number of rays](convergence_ao.png)

**Random numbers: the error falls as 1/√N.** Measured slopes beside the wall: {_list(random)}. Four times the rays halve
the error, whatever the density. A better density shifts the line down: a sphere ray scatters
{sphere.case.sigma / wall["random"].case.sigma:.1f} times as much as a cosine ray, so the sphere needs
{(sphere.case.sigma / wall["random"].case.sigma) ** 2:.1f} times as many rays.

**The shipped set: about N^{_signed(-0.75)} where V jumps.** Measured for the cosine beside the wall:
{_with_error(wall["shipped"])}. The bake does not draw its rays independently. It takes a Sobol set, whose first N
points, N a power of two, lie one in each of N equal cells of the unit square: no part of the hemisphere is forgotten,
none sampled twice. After Owen the set is scrambled, by random swaps of halves, of their halves and so on. Each
point alone is then uniform, so that the estimate has no bias, and the cells stay filled. 64 neighbouring texels share
one set, each with a part that is such a set itself; here every texel is a run.

Why that slope: cells in which V is constant do not err at all. About √N of the N cells meet the wall's edge. Each of
those errs by about 1/N, with either sign, and together they err by N^(1/4)/N = N^{_signed(-0.75)} (Mitchell,
*Consequences of stratified sampling in graphics*, 1996).

**Steeper where nothing jumps.** In the open the weight of a hemisphere ray is continuous. It has kinks, as the square
is folded along its diagonals to become the hemisphere. A cell on a kink errs by 1/√N less than one on an edge, and the
same count gives N^{_signed(-1.25)}. Measured: {_with_error(smooth)}.

**One cosine ray in the open is exact.** Every ray brings 1. There is no slope to fit; the marks at the floor of the
plot stand for errors of 0, to the last bit, with either set.

**What it is worth.** For an error of {TARGET:g} beside the wall, random sphere rays need N = {_rays_for(sphere)},
random cosine rays {_rays_for(wall["random"])}, shipped cosine rays {_rays_for(wall["shipped"])}."""


def _ro(found: Figures) -> str:
    straight, low = (
        [found.one(*place, name, "random").case.sigma for name in (SPHERE, "lobe")]
        for place in (("wall", 100.0, 0.0), ("open", 100.0, TILT["open"]))
    )
    slopes = [c.slope for c in found.curves if c.case.name == "lobe" and c.set == "shipped" and not c.is_exact]
    late = {kind: found.one("wall", 100.0, 0.0, SPHERE, kind) for kind in ("random", "shipped")}
    return f"""## Many rays: RO

![Error of RO beside the wall](convergence_ro_wall.png)

**The narrower the lobe, the more a sphere ray is wasted.** With exponent 100 and R = N beside the wall, a sphere ray
scatters {straight[0] / straight[1]:.0f} times as much as a lobe ray. The rays needed grow as the square of that: one
lobe ray is worth
{(straight[0] / straight[1]) ** 2:,.0f} sphere rays. In the open, with R leaning {TILT["open"]:g}°, it is worth
{(low[0] / low[1]) ** 2:,.0f}.

**Lobe rays with the shipped set fall as AO does:** slopes from {_signed(max(slopes))} to {_signed(min(slopes))} in all
{len(slopes)} cases.

**A good set does not mend a bad density.** With exponent 100 few sphere rays hit the lobe at all. As long as they
do not, there is nothing to spread evenly: at N = 64 the shipped set errs {late["shipped"].at(64):.2f} and random
numbers {late["random"].at(64):.2f}. Only then does its line turn down. The fitted {_signed(late["shipped"].slope)}
is that turn, no law.

![Error of RO in the open](convergence_ro_open.png)

**In the open one lobe ray is exact only for R = N.** Then the whole lobe is above the floor. Where R leans, the
floor cuts it: part of the rays fall below the horizon and bring 0, and RO is below 1 in the open, too. It is the
formula as it stands."""


def _running(found: Figures) -> str:
    sphere, lobe = (found.one("wall", 100.0, 0.0, name, "random") for name in (SPHERE, "lobe"))
    return f"""## The estimate itself

![AO while rays come in](running_ao.png)

The same error seen from within: twelve estimates while their rays come in. The grey band is ±σ/√N with the σ of theory.
About two thirds of the random runs should lie in it at any N. The shipped set soon stays far inside.

![RO while rays come in](running_ro.png)

Sphere rays for exponent 100 look settled at 0 for dozens of rays. Then one hits the lobe and counts up to 202. That the
estimates agree with one another says nothing as long as none of them has seen the lobe. At N = 64 the random error is
{sphere.at(64):.2f} by the sphere and {lobe.at(64):.3f} by the lobe, of a value of {lobe.case.exact:.3f}."""


def _seen(found: Figures) -> str:
    sphere, lobe = (found.one("wall", 100.0, 0.0, name, "shipped") for name in (SPHERE, "lobe"))
    return f"""## Seen from the camera

![RO of Suzanne by sphere and lobe rays](reflections.png)

RO of Suzanne on a floor, baked at 512 x 512 with R from the camera and rendered from that camera, the textures
shining by themselves. Values above 1 are white. Above, sphere rays; below, lobe rays; both with the shipped set.
With one sphere ray a texel hardly any hits the lobe, and those that do count for many. One lobe ray shows
the shape already, and a hundred are smooth. For exponent 100 a hundred sphere rays are worse than one lobe ray; so it
is beside the wall, where {sphere.rays[7]:.0f} err {sphere.rmse[7]:.2f} and one lobe ray {lobe.case.sigma:.2f}."""


def _all(found: Figures) -> str:
    runs = {kind: next(c.runs for c in found.curves if c.set == kind) for kind in ("random", "shipped")}
    lines = [
        "## All cases",
        "",
        f"Each error is that of {runs['shipped'][-1]:,.0f} texels of the shipped set ({runs['shipped'][0]:,.0f} up to "
        f"256 rays) and of {runs['random'][-1]:,.0f} to {runs['random'][0]:,.0f} runs of random numbers. "
        "σ: standard deviation of one random ray. Slopes: least squares through log RMSE against log N for "
        f"N = {FIT_FROM} to {RAYS[-1]}; with fewer rays most runs of sphere rays miss the lobe of exponent 100. "
        "±: standard error, from eight groups of runs fitted apart. All points of all curves, with the number of runs "
        "and the standard errors: [study.csv](study.csv).",
    ]
    for point, title in (("wall", "Beside the wall"), ("open", "In the open")):
        lines += [
            "",
            f"| {title} | R | exact | rays by | σ, theory | σ, measured | slope, random | slope, shipped "
            "| RMSE at 64, random | shipped |",
            "|---|---|---|---|---|---|---|---|---|---|",
        ]
        lines += [_row(found, c) for c in found.curves if c.case.point == point and c.set == "random"]
    return "\n".join(lines)


def _row(found: Figures, random: Curve) -> str:
    case = random.case
    shipped = found.one(case.point, case.exponent, case.tilt, case.name, "shipped")
    where = "" if case.map == "AO" else f"{case.tilt:g}°" if case.tilt else "N"
    head = f"| {case.map} | {where} | {case.exact:.5f} | {case.name} | {case.sigma:.5f} "
    if random.is_exact and shipped.is_exact:
        return head + "| 0 | exact | exact | 0 | 0 |"
    measured = f"| {random.rmse[0]:.5f} ± {random.uncertainty[0]:.5f} | {_with_error(random)} | {_with_error(shipped)} "
    return head + measured + f"| {random.at(64):.4f} | {shipped.at(64):.4f} |"


def _light() -> str:
    return """## Light that is not the same from all sides

With light L(ω) the integral is ∫ V L f dω, and the best density would be as V L f. Two are at hand: the lobe f, and
the light itself. Each is good where it has the peak and the other has not, and useless the other way round: a
cosine's rays meet a small sun one time in thousands, and a sky's rays meet a narrow lobe as seldom. Half of each,
weighted by the balance heuristic (Veach & Guibas 1995), stays within three times of the better one beside the wall,
in both cases.

![Errors by rays from the lobe, from the light, and from both](convergence_light.png)

In the open the lobe's rays under a smooth sky have little left to vary, and half of each is some fifty times worse
at 1024 rays. A bake therefore tells the share of light that gets through, a ratio of two sums over the same rays:
in the open it is 1 exactly, whatever the rays ([light.py](light.py))."""


def _again() -> str:
    return """## Again

    make study

measures, draws and writes this page anew, in a few minutes on two cores. The parts run alone, too, in this order:
`python -m occlusion_bake.bench.study convergence` (study.csv and its plots), `running`, `light`, `pictures` (needs
Blender as a module), `page`. The seeds are fixed."""


def _wrapped(text: str) -> str:
    """Plain paragraphs broken into lines anew, now that the numbers are in."""
    blocks = text.split("\n\n")
    plain = [not block.startswith(("#", "|", "-", "!", " ")) for block in blocks]
    return "\n\n".join(
        fill(block, 118, break_long_words=False, break_on_hyphens=False) if flows else block
        for block, flows in zip(blocks, plain, strict=True)
    )


def _deviation(curve: Curve) -> float:
    """Of one ray's measured spread from theory, in standard errors."""
    return float(abs(curve.rmse[0] - curve.case.sigma) / curve.uncertainty[0])


def _rays_for(curve: Curve) -> str:
    """How many rays bring the error to TARGET: random ones by theory, the shipped set between measured numbers."""
    if curve.set == "random":
        return f"{(curve.case.sigma / TARGET) ** 2:,.0f}"
    return f"{np.exp(np.interp(-np.log(TARGET), -np.log(curve.rmse), np.log(curve.rays))):,.0f}"


def _with_error(curve: Curve) -> str:
    return f"{curve.slope:.3f} ± {curve.slope_uncertainty:.3f}".replace("-", "\N{MINUS SIGN}")


def _list(values: Sequence[float]) -> str:
    return ", ".join(_signed(value) for value in values)


def _signed(value: float) -> str:
    return f"{value:.2f}".replace("-", "\N{MINUS SIGN}")

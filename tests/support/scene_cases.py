"""The effect of each key of a scene: a value, and the attribute of the animation that it determines.

The expected numbers are worked out here, apart from the code under test.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from wfluid.animation.animation import Animation
from wfluid.domain.paths import place_at
from wfluid.model.force import Group, LocalForce, flatten

SIDE = 60
"""Longer side of the pictures [px]."""

SECONDS = 2.0
"""Duration of the scenes."""

QUARTERS = np.arange(0, SECONDS, 0.25)
"""Envelopes are sampled by quarters of a second."""


@dataclass(frozen=True)
class Case:
    """A value of a key, and its expected effect."""

    value: Any
    look: Callable[[Animation], Any]
    seen: Any
    table: Mapping[str, Any] | None = None
    """The other keys of the table, if not those of `USUAL`."""
    without: Mapping[str, Any] | None = None
    """The table without the key, if different."""
    more: Mapping[str, Any] = field(default_factory=dict)
    """Further tables of the scene."""


# Looks at an animation


def get(path):
    """A getter of a nested attribute or item."""

    def look(animation):
        found = animation
        for step in path.split("."):
            found = found[int(step)] if step.isdecimal() else getattr(found, step)
        return found

    return look


def force_of(animation):
    return flatten(animation.forces)[0]


def source_of(animation):
    return animation.fluid.densities[0].sources[0]


def of_force(name):
    return lambda animation: getattr(force_of(animation), name)


def of_layer(name):
    return lambda animation: getattr(animation.layers["matte"], name)


def groups(animation):
    """The names of groups, each with its number of forces."""
    return [(group.name, len(group.members)) for group in animation.forces if isinstance(group, Group)]


def work(animation):
    """The impulse in each quarter of a second: push, turn, swell; or the strength of a field."""
    force = force_of(animation)
    if isinstance(force, LocalForce):
        blobs = [force.impulse(t, t + 0.25) for t in QUARTERS]
        return [[*blob.push, blob.turn / blob.radius, blob.swell / 4] for blob in blobs]
    strength = force.vector if hasattr(force, "vector") else [force.strength]
    return [[part * force.envelope.integral(t, t + 0.25) for part in strength] for t in QUARTERS]


def places(animation):
    """Positions of the force over time."""
    return [place_at(force_of(animation).center, t) for t in QUARTERS]


def places_of_source(animation):
    return [place_at(source_of(animation).center, t) for t in QUARTERS]


def poured(animation):
    """Density that the source adds in each quarter of a second."""
    return [source_of(animation).impulse(t, t + 0.25).amount for t in QUARTERS]


def sides(values):
    """Painted values on the left and right."""
    return values[20, 10], values[20, 50]


def weights(animation):
    """Weights of the force on the left and right."""
    weight = force_of(animation).weight
    return (1, 1) if weight is None else sides(weight.values)


def painted_source(animation):
    """Rates of a painted source on the left and right."""
    paint = getattr(source_of(animation), "paint", None)
    return None if paint is None else sides(paint.values)


def painted_density(animation):
    """Initial densities on the left and right."""
    initial = animation.fluid.densities[0].initial
    return None if initial is None else sides(initial.values)


def viscosity_at(t):
    """The viscosity on the left and right at a time [s]."""

    def look(animation):
        found = animation.fluid.viscosity
        found = found.at(t, animation.grid) if hasattr(found, "at") else getattr(found, "values", found)
        return (found, found) if isinstance(found, float) else (found[5, 2], found[5, -3])

    return look


def size(animation):
    return animation.width, animation.height


# Courses in time: what is given in each quarter of a second


def integrals_of(f):
    """Integrals of a function of the time, by midpoints."""
    middles = (np.arange(4000) + 0.5) / 4000 * 0.25
    return np.array([float(np.mean(f(t + middles))) / 4 for t in QUARTERS])


def smooth(s):
    """A ramp 3 s^2 - 2 s^3."""
    s = np.clip(s, 0, 1)
    return s * s * (3 - 2 * s)


STEADY, FIRST_HALF = integrals_of(np.ones_like), integrals_of(lambda t: t < 1)
WAVE = 2 * np.pi / 0.7
"""Envelopes with a period of 0.7 s."""

TIMINGS = {
    "start": (0.5, {}, integrals_of(lambda t: t > 0.5), 2 / 1.5**2),
    "end": (1.25, {}, integrals_of(lambda t: t < 1.25), 2 / 1.25**2),
    "at": (0.5, {}, (QUARTERS == 0.5) * 1.0, 1 / 1.5),
    "period": (0.7, {}, integrals_of(lambda t: np.cos(WAVE * t) * np.where(t < 0.35, 0.5, 1)), WAVE**2),
    "phase": (0.1, {"period": 0.7}, integrals_of(lambda t: np.sin(WAVE * t + 0.2 * np.pi)), WAVE**2),
    "rise": (0.5, {}, integrals_of(lambda t: smooth(t / 0.5)), 0.5),
    "fall": (0.5, {}, integrals_of(lambda t: smooth((2 - t) / 0.5)), 0.5),
    "strength": (-3.0, {}, -3 * STEADY, 0.5),
    "envelope": ("half", {}, FIRST_HALF, 0.5),
}
"""By key: a value, further keys, the envelope, and the acceleration that moves a free particle by 1."""

HALF = {"envelopes": {"half": {"kind": "constant", "end": 1}}}
"""The named envelope of the scene."""


def growing(key, given):
    """A growth is a rate whose integral over the envelope is the growth, times further factors."""
    if key in ("strength", "envelope"):
        return given / STEADY.sum()
    if key in ("period", "phase"):
        ahead = 0.25 if key == "period" else 0.1
        return WAVE * integrals_of(lambda t: np.sin(WAVE * t + 2 * np.pi * ahead))
    return given / given.sum()


# Forces


def push(x, y):
    """Acceleration of an arrow [px]; the pressure halves it."""
    return [2 * x / SIDE, 2 * y / SIDE, 0, 0]


def drag(length, seconds, radius):
    """Acceleration of a stroke to the right [px]: |V| V / (radius sqrt(2 pi))."""
    speed = length / SIDE / seconds
    return np.array([speed**2 / (radius / SIDE * math.sqrt(2 * math.pi)), 0, 0, 0])


SPOT = {"center": [30, 20]}
PATH = [[0, 15, 30], [1, 45, 30]]
ALONG_PATH = [(0.25 + min(t, 1) / 2, 0.5) for t in QUARTERS]
PUSH = {"kind": "push", **SPOT, "by": [6, 3]}
STROKE = {"kind": "stroke", "points": [[10, 20], [40, 20]], "radius": 6}

FORCES = {
    "push": (PUSH, push(6, 3)),
    "vortex": ({"kind": "vortex", **SPOT, "turn": 40}, [0, 0, math.radians(40), 0]),
    "grow": ({"kind": "grow", **SPOT, "factor": 1.5}, [0, 0, 0, 2 * math.log(1.5)]),
    "wind": ({"kind": "wind", "by": [6, 3]}, [6 / SIDE, 3 / SIDE]),
    "noise": ({"kind": "noise", "amount": 4}, [4 / SIDE]),
    "image": ({"kind": "image", "file": "small.png", "amount": 3}, [3 / SIDE]),
    "buoyancy": ({"kind": "buoyancy", "density": "ink", "by": [0, -20]}, [0, -20 / SIDE]),
}
"""By kind: a table, and its effect on a free particle by its envelope."""


def less(table, *names):
    return {name: value for name, value in table.items() if name not in names}


def _forces():
    for kind, (table, given) in FORCES.items():
        for key, (value, needs, in_time, per_length) in TIMINGS.items():
            if (kind, key) == ("grow", "at"):
                continue
            in_time = growing(key, in_time) if kind == "grow" else per_length * in_time
            yield kind, key, Case(value, work, np.outer(in_time, given), {**table, **needs}, more=HALF)
        if "center" in table:
            yield kind, "center", Case([15, 30], places, [(0.25, 0.5)] * 8)
            yield kind, "path", Case(PATH, places, ALONG_PATH, less(table, "center"), table)
            yield kind, "radius", Case(12, of_force("radius"), 0.2)
    for kind, key, value, given in (
        ("push", "by", [-9, 2], push(-9, 2)),
        ("vortex", "turn", -90, [0, 0, -math.pi / 2, 0]),
        ("grow", "factor", 0.5, [0, 0, 0, -2 * math.log(2)]),
        ("wind", "by", [-9, 2], [-9 / SIDE, 2 / SIDE]),
        ("noise", "amount", 7, [7 / SIDE]),
        ("image", "amount", -2, [-2 / SIDE]),
        ("buoyancy", "by", [9, 2], [9 / SIDE, 2 / SIDE]),
    ):
        yield kind, key, Case(value, work, np.outer(STEADY / 2, given))
    yield "noise", "scale", Case(30, of_force("scale"), 0.5)
    yield "noise", "seed", Case(5, of_force("seed"), 5)
    yield "noise", "change", Case(0.5, of_force("period"), 0.5)
    yield "image", "file", Case("right.png", lambda a: sides(force_of(a).picture.pixels[..., 0]), (0, 1))
    yield "image", "along", Case("contour", of_force("kind"), "contour")
    yield "image", "radius", Case(3, of_force("radius"), 0.05)
    two = {"density": [{"name": "ink"}, {"name": "smoke"}]}
    yield "buoyancy", "density", Case("smoke", of_force("density"), "smoke", more=two)
    yield from (("stroke", *case) for case in _strokes())
    for kind in (*FORCES, "stroke"):
        yield kind, "group", Case("nose", groups, [("nose", 1)], more={"group": [{"name": "nose"}]})
        if kind != "buoyancy":
            yield kind, "mask", Case("right.png", weights, (0, 1))


def _strokes():
    """A brush that moves by 30 px in its window."""
    total, late = drag(30, 2, 6), integrals_of(lambda t: t > 0.5)
    path = [[0, 10, 20], [1, 40, 20]]
    yield "points", Case([[10, 20], [30, 20]], work, np.outer(STEADY, drag(20, 2, 6)))
    yield "path", Case(path, work, np.outer(FIRST_HALF, drag(30, 1, 6)), less(STROKE, "points"), STROKE)
    yield "radius", Case(12, work, np.outer(STEADY, drag(30, 2, 12)))
    yield "start", Case(0.5, work, np.outer(late, drag(30, 1.5, 6)))
    yield "end", Case(1, work, np.outer(FIRST_HALF, drag(30, 1, 6)))
    yield "strength", Case(-3, work, np.outer(-3 * STEADY, total))
    yield "envelope", Case("half", work, np.outer(FIRST_HALF, total), more=HALF)


def _envelopes():
    """The values of an envelope, measured by a push."""
    wave = {"kind": "oscillator", "period": 1}
    ramp = {"kind": "samples", "times": [0, 2], "values": [1, 0]}
    turn = 2 * np.pi
    for table, key, value, f in (
        ({"kind": "constant"}, "start", 0.5, lambda t: t > 0.5),
        ({"kind": "constant"}, "end", 0.5, lambda t: t < 0.5),
        ({"kind": "fade"}, "start", 0.5, lambda t: t > 0.5),
        ({"kind": "fade", "fall": 0.5}, "end", 1, lambda t: smooth((1 - t) / 0.5)),
        ({"kind": "fade"}, "rise", 1, smooth),
        ({"kind": "fade"}, "fall", 1, lambda t: smooth(2 - t)),
        (wave, "start", 0.5, lambda t: np.where(t > 0.5, np.cos(turn * (t - 0.5)), 0)),
        (wave, "end", 0.5, lambda t: np.where(t < 0.5, np.cos(turn * t), 0)),
        (wave, "period", 0.8, lambda t: np.cos(turn * t / 0.8)),
        (wave, "phase", 0.1, lambda t: np.sin(turn * (t + 0.1))),
        (ramp, "times", [0, 1], lambda t: np.maximum(1 - t, 0)),
        (ramp, "values", [3, -1], lambda t: 3 - 2 * t),
    ):
        yield table["kind"], key, Case(value, work, np.outer(integrals_of(f) / 2, push(6, 3)), table)


def _sources():
    """A source adds its amount over its window, times its strength and further envelopes."""
    for key, (value, needs, in_time, _) in TIMINGS.items():
        if key in ("period", "phase"):
            continue
        total = STEADY.sum() if key in ("strength", "envelope") else abs(in_time.sum())
        yield key, Case(value, poured, in_time / total, {**SPOT, **needs}, more=HALF)
    yield "center", Case([15, 30], places_of_source, [(0.25, 0.5)] * 8)
    yield "path", Case(PATH, places_of_source, ALONG_PATH, {}, SPOT)
    yield "radius", Case(12, lambda a: source_of(a).radius, 0.2)
    yield "amount", Case(-4, poured, -4 * STEADY / 2)
    yield "image", Case("right.png", painted_source, (0, 1), {}, SPOT)


# Everything else


def _others():
    image, stiff = {"image": "right.png", "value": 2}, viscosity_at(0)
    yield "at the top", "seed", Case(7, of_force("seed"), 7, more={"force": [FORCES["noise"][0]]})
    for heading, key, *case in (
        ("[picture]", "file", "right.png", lambda a: sides(a.picture.pixels[..., 0]), (0, 1)),
        ("[picture]", "size", [600, 400], of_force("center"), (0.05, 0.2 / 6)),
        ("[picture]", "colorspace", "linear", lambda a: a.picture.pixels.mean() > 0.6, True),
        ("[fluid]", "cells", 24, lambda a: (a.grid.nx, a.grid.ny), (24, 16)),
        ("[fluid]", "walls", "periodic,no-slip", get("fluid.walls.y.value"), "no-slip"),
        ("[fluid]", "scheme", "paper", get("fluid.scheme"), "paper"),
        ("[fluid]", "solver", "jacobi", get("fluid.solver"), "jacobi"),
        ("[fluid]", "creeping", True, get("fluid.inertia"), False),
        ("[fluid]", "pressure_cycles", 5, get("fluid.pressure_cycles"), 5),
        ("[fluid]", "diffusion_tolerance", 1e-3, get("fluid.diffusion_tolerance"), 1e-3),
        ("[fluid]", "diffusion_loss", 0.3, get("fluid.diffusion_loss"), 0.3 / 60),
        ("[viscosity]", "value", 0.5, stiff, (0.5, 0.5)),
        ("[viscosity]", "image", "right.png", stiff, (0, 2), {"value": 2}),
        ("[viscosity]", "floor", 0.5, stiff, (0.5, 2), image),
        ("[viscosity]", "invert", True, stiff, (2, 0), image),
        ("[viscosity]", "moves", True, get("fluid.viscosity_moves"), True, image),
        ("[[viscosity.key]]", "time", 2, viscosity_at(0.5), (1.5, 1.5)),
        ("[[viscosity.key]]", "value", 5, viscosity_at(0.5), (3, 3)),
        ("[[viscosity.key]]", "image", "right.png", viscosity_at(0.5), (0.5, 2)),
        ("[freeze]", "mask", "right.png", lambda a: sides(a.fluid.freeze.paint.values), (0, 1)),
        ("[freeze]", "strength", 50, get("fluid.freeze.strength"), 50),
        ("[effect]", "mask", "right.png", weights, (0, 1)),
        ("[time]", "duration", 3, get("timeline.duration"), 3),
        ("[time]", "fps", 20, get("timeline.fps"), 20),
        ("[time]", "substeps", 7, get("timeline.steps_per_frame"), 7),
        ("[time]", "loop", "crossfade", get("loop"), "crossfade"),
        ("[frames]", "width", 30, size, (30, 20)),
        ("[frames]", "scale", 0.25, size, (15, 10)),
        ("[frames]", "filter", "nearest", get("filter"), "nearest"),
        ("[frames]", "edge", "mirror", get("edge"), "mirror"),
        ("[[density]]", "name", "fog", get("fluid.densities.0.name"), "fog"),
        ("[[density]]", "color", "#ff0000", get("fluid.densities.0.color"), (1, 0, 0)),
        ("[[density]]", "look", "smoke", get("fluid.densities.0.look"), "smoke"),
        ("[[density]]", "diffusion", 0.5, get("fluid.densities.0.diffusion"), 0.5),
        ("[[density]]", "image", "right.png", painted_density, (0, 1)),
        ("[[density]]", "amount", 0.5, painted_density, (0, 0.5), {"name": "ink", "image": "right.png"}),
        ("[[layer]]", "name", "hair", lambda a: list(a.layers), ["hair"]),
        ("[[layer]]", "file", "small.png", lambda a: of_layer("pixels")(a).shape, (40, 60, 3)),
        ("[[layer]]", "data", False, of_layer("data"), False),
        ("[tracks]", "points", [[15, 30], [60, 0]], get("points"), [(0.25, 0.5), (1, 0)]),
    ):
        yield heading, key, Case(*case)
    yield "[[group]]", "name", Case("brow", groups, [("brow", 0)])
    more = {**HALF, "force": [{**PUSH, "group": "nose"}]}
    yield "[[group]]", "strength", Case(-3, work, np.outer(-3 * STEADY / 2, push(6, 3)), more=more)
    yield "[[group]]", "envelope", Case("half", work, np.outer(FIRST_HALF / 2, push(6, 3)), more=more)


USUAL = {
    **{f'[[force]] kind = "{kind}"': table for kind, (table, _) in FORCES.items()},
    '[[force]] kind = "stroke"': STROKE,
    "[[viscosity.key]]": {"time": 1, "value": 3},
    "[freeze]": {"mask": "left.png"},
    "[effect]": {"mask": "left.png"},
    "[[group]]": {"name": "nose"},
    "[[density]]": {"name": "ink"},
    "[[density.source]]": SPOT,
    "[[layer]]": {"name": "matte", "file": "right.png"},
}
"""By heading: a table without the tested key."""

CASES = {
    **{(f'[[force]] kind = "{kind}"', key): case for kind, key, case in _forces()},
    **{(f'[envelopes.NAME] kind = "{kind}"', key): case for kind, key, case in _envelopes()},
    **{("[[density.source]]", key): case for key, case in _sources()},
    **{(heading, key): case for heading, key, case in _others()},
}
"""Expected effects by heading and key."""


def scene_with(heading, table, more):
    """The tables of a small scene with a table under a heading."""
    scene = {
        "wfluid": 1,
        "picture": {"file": "small.png"},
        "fluid": {"cells": 16},
        "time": {"duration": SECONDS, "fps": 10},
        "force": [PUSH],
        "density": [{"name": "ink"}],
        **more,
    }
    name = heading.strip("[]")
    if heading == "at the top":
        return {**scene, **table}
    if heading.startswith("[[force]]"):
        return {**scene, "force": [table]}
    if heading.startswith("[envelopes"):
        return {**scene, "envelopes": {"wave": table}, "force": [{**PUSH, "envelope": "wave"}]}
    if heading == "[[density.source]]":
        return {**scene, "density": [{"name": "ink", "source": [table]}]}
    if heading == "[[viscosity.key]]":
        return {**scene, "viscosity": {"key": [{"time": 0, "value": 1}, table]}}
    return {**scene, name: [table] if heading.startswith("[[") else {**scene.get(name, {}), **table}}

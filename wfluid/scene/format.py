"""The keys of a scene file. Lengths are pixels of the frame that `picture.size` names, times seconds."""

from __future__ import annotations

import re
from dataclasses import replace
from typing import Any

from wfluid.domain.curves import CURVES, DELAY_LIMIT
from wfluid.domain.timeline import FPS_LIMIT, LEAST_FPS, LOOPS
from wfluid.model.densities import LOOKS
from wfluid.model.fluid import SCHEMES, SOLVERS
from wfluid.model.image_force import KINDS
from wfluid.model.painted import DRAG_LIMIT, VISCOSITY_LIMIT
from wfluid.pictures.blend import BLEND_SPACES
from wfluid.pictures.formats import COLORSPACES, TYPES
from wfluid.pictures.pairing import FITS
from wfluid.pictures.sampling import EDGES, FILTERS
from wfluid.scene.schema import (
    Key,
    Many,
    Named,
    Table,
    Variants,
    flag,
    names,
    number,
    numbers,
    rows,
    text,
    whole,
    word,
)

VERSION = 1
"""Of the format that this file describes."""

AMOUNT_LIMIT = 1000.0
"""Most density that a source may pour, or a picture paint."""

LEAST_TIME = 0.001
"""Shortest period or window of a force [s]."""


def _version(value: Any) -> int:
    if isinstance(value, bool) or not isinstance(value, int) or value < 1:
        raise ValueError("expected a whole number from 1 on")
    if value > VERSION:
        raise ValueError(f"a scene of a newer version; this wfluid reads up to {VERSION}: update wfluid")
    return value


def _color(value: Any) -> str:
    if not isinstance(value, str) or not re.fullmatch(r"#[0-9a-fA-F]{6}", value):
        raise ValueError('expected a colour such as "#1a2b3c"')
    return value.lower()


def _file(meaning: str, required: bool = False, kind: str = "painting") -> Key:
    return Key(meaning, **text(), required=required, file=kind)


def _curve(value: Any) -> str | list[list[float]]:
    if isinstance(value, str):
        return word(*CURVES)["check"](value)
    return _KEYS["check"](value)


_KEYS = rows(2, 1, "linear, ease, or a list of keys, [[seconds, value], …]")

_POINT = numbers(2, "two numbers, [x, y]")
_PATH = rows(3, 2, "two rows or more of [seconds, x, y]")

COURSE = {
    "start": Key("when it begins", **number(0), unit="s", default="0"),
    "end": Key("when it ends", **number(above=0), unit="s", default="the end"),
    "at": Key("one blow at that time, instead of a window", **number(0), unit="s"),
    "period": Key("oscillate with that period", **number(LEAST_TIME), unit="s"),
    "phase": Key(
        "part of a period it is ahead: 0.25 swings about the place, 0 is the paper's sine",
        **number(),
        default="0.25; in an oscillating loop 0.5",
    ),
    "rise": Key("time over which it grows to its strength", **number(0), unit="s", default="0"),
    "fall": Key("time over which it ceases before its end", **number(0), unit="s", default="0"),
    "strength": Key("factor", **number(), default="1"),
    "envelope": Key("further envelopes that it is multiplied by", **names()),
}
"""When a force acts."""

_FORCE = {
    "name": Key("what it is called, for --set", **text()),
    "group": Key("the group it belongs to", **text()),
    **COURSE,
}
_MASK = {"mask": _file("acts where this picture is white, instead of the scene's effect mask")}
_CENTER = {
    "center": Key("where it acts", **_POINT, unit="px"),
    "path": Key("where it acts over time, instead of center", **_PATH, unit="s, px"),
    "radius": Key("sigma of its Gaussian", **number(above=0), unit="px", default="6 % of the longer side"),
}

FORCES = {
    "push": Table(
        "A push along an arrow",
        {
            **_CENTER,
            "by": Key("the arrow: how far it carries its centre", **_POINT, unit="px", required=True),
            **_FORCE,
            **_MASK,
        },
    ),
    "vortex": Table(
        "A twirl, clockwise for positive angles",
        {
            **_CENTER,
            "turn": Key("how far it turns its centre", **number(), unit="degrees", required=True),
            **_FORCE,
            **_MASK,
        },
    ),
    "grow": Table(
        "Growing, or shrinking, with a ring around that gives way; not where it is frozen",
        {
            **_CENTER,
            "factor": Key("how many times as long the centre becomes", **number(0.05, 20), required=True),
            **{name: key for name, key in _FORCE.items() if name != "at"},
            "phase": replace(COURSE["phase"], default="0.25"),
            **_MASK,
        },
    ),
    "stroke": Table(
        "A drag along a line from start to end",
        {
            "points": Key("the line", **rows(2, 2, "two points or more, [[x, y], …]"), unit="px"),
            "path": Key("the line with its times, instead of points", **_PATH, unit="s, px"),
            "radius": _CENTER["radius"],
            **{key: COURSE[key] for key in ("start", "end", "strength", "envelope")},
            "name": _FORCE["name"],
            "group": _FORCE["group"],
            **_MASK,
        },
    ),
    "wind": Table(
        "One push everywhere; moves something along periodic walls, or under a mask",
        {"by": Key("how far it carries", **_POINT, unit="px", required=True), **_FORCE, **_MASK},
    ),
    "noise": Table(
        "Turbulence: random eddies",
        {
            "amount": Key("how far it carries, root mean square", **number(), unit="px", required=True),
            "scale": Key(
                "mean wavelength, up to twice the longer side",
                **number(above=0),
                unit="px",
                default="20 % of the longer side",
            ),
            "seed": Key("which noise", **whole(0, 2**32 - 1), default="the scene's, and the force's number"),
            "change": Key("time in which it changes and comes back", **number(LEAST_TIME), unit="s"),
            **_FORCE,
            **_MASK,
        },
    ),
    "image": Table(
        "A force from a picture, or from the animated one, self",
        {
            "file": _file("the picture", required=True),
            "along": Key("what it follows", **word(*KINDS), default="gradient"),
            "amount": Key(
                "how far its strongest place is carried",
                **number(),
                unit="px",
                default="2 % of the longer side",
            ),
            "radius": Key(
                "blur before slopes are taken", **number(0), unit="px", default="1 % of the longer side"
            ),
            **_FORCE,
            **_MASK,
        },
    ),
    "buoyancy": Table(
        "A density's own push",
        {
            "density": Key("name of the density", **text(), required=True),
            "by": Key("how far it carries where the density is 1", **_POINT, unit="px", required=True),
            **_FORCE,
        },
    ),
}
"""Kinds of force, by the key `kind`."""

_WINDOW = {"start": COURSE["start"], "end": COURSE["end"]}

ENVELOPES = {
    "constant": Table("1 in a window", dict(_WINDOW)),
    "fade": Table(
        "1 in a window, with smooth ends", {**_WINDOW, "rise": COURSE["rise"], "fall": COURSE["fall"]}
    ),
    "oscillator": Table(
        "A sine",
        {
            **_WINDOW,
            "period": Key("its period", **number(LEAST_TIME), unit="s", required=True),
            "phase": COURSE["phase"],
        },
    ),
    "samples": Table(
        "Straight lines between values",
        {
            "times": Key("when", **rows(1, 2, "two numbers or more"), unit="s", required=True),
            "values": Key("factors", **rows(1, 2, "two numbers or more"), required=True),
        },
    ),
}
"""Kinds of envelope, by the key `kind`."""

_SOURCE = Table(
    "What pours a density in: a spot, or a picture",
    {
        **_CENTER,
        "image": _file("pours where this picture is bright, instead of a spot"),
        "amount": Key(
            "density poured in all, at the brightest place",
            **number(-AMOUNT_LIMIT, AMOUNT_LIMIT),
            default="1",
        ),
        **{key: COURSE[key] for key in COURSE if key not in ("period", "phase")},
    },
)

_MOVE = Table(
    "A point that should be somewhere; several of one point make a path",
    {
        "from": Key("its place in the untouched picture", **_POINT, unit="px", required=True),
        "to": Key("where it should be", **_POINT, unit="px", required=True),
        "time": Key("when", **number(above=0), unit="s", default="that of all"),
        "weight": Key("how much it counts beside others", **number(above=0), default="1"),
    },
)

_FOUND = Table(
    "A force found before, as a saved scene has it: the search goes on from there",
    {
        "center": Key("where it acts", **_POINT, unit="px", required=True),
        "vector": Key("acceleration at its centre", **_POINT, unit="px/s^2", required=True),
        "radius": Key("sigma of its Gaussian", **number(above=0), unit="px", required=True),
        "start": Key("when it begins", **number(0), unit="s", required=True),
        "end": Key("when it ends", **number(above=0), unit="s", required=True),
    },
)

SCENE = Table(
    "A scene",
    {
        "wfluid": Key("version of the format", _version, f"a whole number to {VERSION}", required=True),
        "seed": Key("of noises that name none, and of keyframes", **whole(0, 2**32 - 1), default="0"),
        "picture": Table(
            "What is animated",
            {
                "file": _file("the picture", required=True, kind="file"),
                "size": Key(
                    "width and height that the scene's pixels refer to",
                    **numbers(2, "two numbers, [width, height]"),
                    unit="px",
                    default="the picture's",
                ),
                "colorspace": Key("what its numbers are", **word(*COLORSPACES), default="auto"),
            },
        ),
        "fluid": Table(
            "How the fluid is computed",
            {
                "cells": Key("cells along the longer side", **whole(4, 8192), default="256"),
                "walls": Key(
                    "free-slip, no-slip, periodic, or two of them as x,y", **text(), default="free-slip"
                ),
                "scheme": Key("standard, or the paper's", **word(*SCHEMES), default="standard"),
                "solver": Key("of pressure and diffusion", **word(*SOLVERS), default="by scheme"),
                "pressure_cycles": Key("multigrid cycles a projection", **whole(1, 100), default="3"),
            },
        ),
        "viscosity": Table(
            "How stiff it is",
            {
                "value": Key(
                    "viscosity, or that of the image's white",
                    **number(0, VISCOSITY_LIMIT),
                    unit="longer side^2/s",
                    default="0.001; 0.1 with an image",
                ),
                "image": _file("stiff where this picture is bright (self: the animated one)"),
                "floor": Key(
                    "viscosity of the image's black",
                    **number(0, VISCOSITY_LIMIT),
                    unit="longer side^2/s",
                    default="0",
                ),
                "invert": Key("stiff where the image is dark", **flag(), default="false"),
                "moves": Key("whether it moves with the picture", **flag(), default="false"),
                "key": Many(
                    Table(
                        "A viscosity at a time, instead of value and image; between them straight lines",
                        {
                            "time": Key("when", **number(0), unit="s", required=True),
                            "value": Key(
                                "viscosity, or that of the image's white",
                                **number(0, VISCOSITY_LIMIT),
                                unit="longer side^2/s",
                                required=True,
                            ),
                            "image": _file("stiff where this picture is bright"),
                        },
                    )
                ),
            },
        ),
        "freeze": Table(
            "What stays in its place",
            {
                "mask": _file("white stays, by degrees", required=True),
                "strength": Key("drag of white", **number(0, DRAG_LIMIT), unit="1/s", default="10000"),
            },
        ),
        "effect": Table("Where forces act", {"mask": _file("forces act where it is white", required=True)}),
        "time": Table(
            "When frames are shown",
            {
                "duration": Key(
                    "length", **number(above=0), unit="s", default="that of the last keyframe, or 2"
                ),
                "fps": Key("frames a second", **number(LEAST_FPS, FPS_LIMIT), default="15"),
                "substeps": Key(
                    "steps a frame",
                    **whole(1, 100_000),
                    default="steps of at most 1/96 s, with keyframes 1/48 s",
                ),
                "loop": Key("how the end meets the beginning", **word(*LOOPS), default="not at all"),
            },
        ),
        "frames": Table(
            "What they look like",
            {
                "width": Key("their width", **whole(1, 32768), unit="px", default="the picture's"),
                "scale": Key("their size as a factor, instead of width", **number(above=0)),
                "filter": Key("how the picture is read between pixels", **word(*FILTERS), default="cubic"),
                "edge": Key("what lies beyond the picture", **word(*EDGES), default="clamp"),
            },
        ),
        "envelopes": Named(Variants("A course in time with a name", ENVELOPES)),
        "force": Many(Variants("What moves it", FORCES), unique="name"),
        "group": Many(
            Table(
                "Forces edited as one",
                {
                    "name": Key("what it is called", **text(), required=True),
                    "strength": Key("factor on all", **number(), default="1"),
                    "envelope": Key("envelopes that all are multiplied by", **names()),
                },
            ),
            unique="name",
        ),
        "density": Many(
            Table(
                "Something dissolved in it, seen over the picture",
                {
                    "name": Key("what it is called", **text(), required=True),
                    "color": Key("its colour", _color, 'a colour such as "#1a2b3c"', default="#27274f"),
                    "look": Key("colours, or covers", **word(*LOOKS), default="ink"),
                    "diffusion": Key(
                        "how fast it spreads",
                        **number(0, VISCOSITY_LIMIT),
                        unit="longer side^2/s",
                        default="0",
                    ),
                    "image": _file("there at the beginning where this picture is bright"),
                    "amount": Key("density of the image's white", **number(0, AMOUNT_LIMIT), default="1"),
                    "source": Many(_SOURCE),
                },
            ),
            unique="name",
        ),
        "layer": Many(
            Table(
                "A picture or matte that goes through the same map",
                {
                    "name": Key("what it is called", **text(), required=True),
                    "file": _file("the picture, stretched over the animated one", required=True, kind="file"),
                    "data": Key(
                        "whether its numbers are data, not colours", **flag(), default="true for one channel"
                    ),
                },
            ),
            unique="name",
        ),
        "tracks": Table(
            "Points that are followed",
            {"points": Key("where they begin", **rows(2, 1, "a list of points, [[x, y], …]"), unit="px")},
        ),
        "keyframes": Table(
            "Where points arrive: forces are found that take them there",
            {
                "move": Many(_MOVE),
                "points": _file("moves in a CSV file: from x, y, to x, y, perhaps time", kind="file"),
                "time": Key("of moves that name none", **number(above=0), unit="s", default="the duration"),
                "pins": Key(
                    "points that stay in their place until the last keyframe",
                    **rows(2, 1, "a list of points, [[x, y], …]"),
                    unit="px",
                ),
                "tolerance": Key(
                    "how far a point may end from its keyframe",
                    **number(above=0),
                    unit="px",
                    default="a quarter, of a picture of 512",
                ),
                "force": Many(_FOUND),
            },
        ),
        "morph": Table(
            "Another picture, into which this one flows; keyframes lead from points of this to points of it",
            {
                "to": _file("the other picture", required=True, kind="file"),
                "size": Key(
                    "frame size that its pixels refer to",
                    **numbers(2, "two numbers, [width, height]"),
                    unit="px",
                    default="its own",
                ),
                "fit": Key("how it covers the frame", **word(*FITS), default="fill"),
                "warp_curve": Key(
                    "how far points are on their ways: linear, ease, or [[s, 0 … 1], …]",
                    _curve,
                    "a word or keys",
                    default="ease",
                ),
                "blend_curve": Key(
                    "how much of it is seen, the same", _curve, "a word or keys", default="ease"
                ),
                "blend": Key(
                    "what is mixed: light, or display values", **word(*BLEND_SPACES), default="linear"
                ),
                "timing": _file("a mask, white where it happens first"),
                "delay": Key(
                    "how much later it happens where the mask is black, a part of the duration",
                    **number(0, DELAY_LIMIT),
                    default="0.5",
                ),
                "reverse": Key("from the other picture to this", **flag(), default="false"),
                "pingpong": Key("there and back", **flag(), default="false"),
            },
        ),
        "output": Many(
            Table(
                "What is written",
                {
                    "file": _file(
                        "x.gif, x.mp4, x.####.png, …; x.csv for tracks, x.json for the report",
                        required=True,
                        kind="file",
                    ),
                    "of": Key(
                        "picture, tracks, report, or the name of a layer or density",
                        **text(),
                        default="picture",
                    ),
                    "start": Key("number of a sequence's first frame", **whole(0, 10**9), default="1001"),
                    "type": Key("numbers of a sequence", **word(*TYPES), default="the picture's"),
                    "compression": Key("of EXR and TIFF sequences", **text()),
                    "quality": Key("of JPEG and WebP sequences", **whole(1, 100)),
                },
            )
        ),
    },
)
"""Everything a scene may say."""

SELF = "self"

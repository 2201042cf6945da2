"""wfluid: animate, warp and morph pictures by treating them as a fluid.

    from wfluid import Fluid, GaussianForce, Oscillator, animate, read_picture, write_animation
    picture = read_picture("raccoon.jpg")
    nose = GaussianForce((0.61, 0.44), (1.5, 1.0), 0.06, Oscillator(period=1.0))
    write_animation("nose.gif", animate(picture, Fluid(viscosity=0.001), [nose], duration=2), fps=24)

One unit of length is the picture's longer side, one unit of time a second; x points right, y down.
"""

from __future__ import annotations

from importlib import import_module
from typing import Any

_HOME = {
    "Animation": "animation",
    "Frame": "animation",
    "animate": "animation",
    "parse_force": "command_scene",
    "Functional": "control.functional",
    "ParticleKeyframe": "control.keyframes",
    "Match": "control.match",
    "match_keyframes": "control.match",
    "DensityMisfit": "control.objectives",
    "Effort": "control.objectives",
    "MapMisfit": "control.objectives",
    "PictureMisfit": "control.picture_misfit",
    "ParticleFunction": "control.objectives",
    "ParticleMisfit": "control.objectives",
    "WarpObjective": "control.objectives",
    "Free": "control.variables",
    "Setup": "control.variables",
    "CoordinateMap": "coordinate_map",
    "MapQuality": "coordinate_map",
    "Density": "density",
    "PaintedSource": "density",
    "Source": "density",
    "Arbitrary": "envelopes",
    "Constant": "envelopes",
    "Envelope": "envelopes",
    "Fade": "envelopes",
    "Instantaneous": "envelopes",
    "Oscillator": "envelopes",
    "Drawing": "drawing",
    "Fluid": "fluid",
    "Buoyancy": "forces",
    "GaussianForce": "forces",
    "Group": "forces",
    "Growth": "forces",
    "Stroke": "forces",
    "VortexForce": "forces",
    "Wind": "forces",
    "Grid": "grid",
    "ImageForce": "image_force",
    "LookUp": "look_up",
    "Seam": "loops",
    "Morph": "morphing.morph",
    "morph": "morphing.morph",
    "NoiseForce": "noise_force",
    "write_animation": "output",
    "Freeze": "painted",
    "Keyed": "painted",
    "Painted": "painted",
    "Path": "paths",
    "Encoding": "picture",
    "Picture": "picture",
    "PictureError": "picture",
    "read_picture": "picture",
    "write_picture": "picture",
    "Scene": "scene",
    "SceneError": "scene",
    "read_scene": "scene",
    "write_scene": "scene",
    "SolveReport": "solver",
    "Solver": "solver",
    "stage": "staging",
    "State": "state",
    "Timeline": "timeline",
    "Wall": "walls",
    "Walls": "walls",
}
__version__ = "0.1.0"
__all__ = ["__version__", *_HOME]


def __getattr__(name: str) -> Any:
    """Import a public name when it is first used: `import wfluid` loads neither Warp nor OpenImageIO."""
    if name not in _HOME:
        raise AttributeError(f"module 'wfluid' has no attribute {name!r}")
    return getattr(import_module(f"wfluid.{_HOME[name]}"), name)


def __dir__() -> list[str]:
    return sorted(__all__)

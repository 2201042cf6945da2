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
    "Animation": "animation.animation",
    "animate": "animation.animation",
    "Frame": "animation.frame",
    "Seam": "animation.loops",
    "Run": "animation.run",
    "Arbitrary": "domain.envelopes",
    "Constant": "domain.envelopes",
    "Envelope": "domain.envelopes",
    "Fade": "domain.envelopes",
    "Instantaneous": "domain.envelopes",
    "Oscillator": "domain.envelopes",
    "Grid": "domain.grid",
    "Path": "domain.paths",
    "Timeline": "domain.timeline",
    "Wall": "domain.walls",
    "Walls": "domain.walls",
    "State": "fields.state",
    "write_animation": "files.output",
    "Functional": "gradient.functional",
    "Effort": "gradient.objectives",
    "ParticleFunction": "gradient.objectives",
    "ParticleMisfit": "gradient.objectives",
    "PictureMisfit": "gradient.picture_misfit",
    "DensityMisfit": "gradient.state_objectives",
    "MapMisfit": "gradient.state_objectives",
    "WarpObjective": "gradient.state_objectives",
    "Free": "gradient.variables",
    "Setup": "gradient.variables",
    "ParticleKeyframe": "keyframes.keyframes",
    "Match": "keyframes.match",
    "match_keyframes": "keyframes.match",
    "Density": "model.densities",
    "PaintedSource": "model.densities",
    "Source": "model.densities",
    "Fluid": "model.fluid",
    "Group": "model.force",
    "GaussianForce": "model.gaussian_forces",
    "Growth": "model.gaussian_forces",
    "VortexForce": "model.gaussian_forces",
    "ImageForce": "model.image_force",
    "NoiseForce": "model.noise_force",
    "Freeze": "model.painted",
    "Keyed": "model.painted",
    "Painted": "model.painted",
    "Stroke": "model.stroke",
    "Buoyancy": "model.uniform_forces",
    "Wind": "model.uniform_forces",
    "Morph": "morphing.morph",
    "morph": "morphing.morph",
    "Encoding": "pictures.formats",
    "PictureError": "pictures.formats",
    "Picture": "pictures.picture",
    "read_picture": "pictures.stills",
    "write_picture": "pictures.stills",
    "Scene": "scene.scene",
    "SceneError": "scene.schema",
    "parse_force": "scene.short_forms",
    "read_scene": "scene.toml_file",
    "write_scene": "scene.toml_file",
    "stage": "staging.build",
    "Drawing": "staging.drawing",
    "SolveReport": "step.solver",
    "Solver": "step.solver",
    "CoordinateMap": "view.coordinate_map",
    "LookUp": "view.lookup",
    "MapQuality": "view.quality",
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

"""The types of the public names. `.ci/run` has mypy and pyright check this file; nothing runs it.

`assert_type` fails on Any, so a name without a type fails.
"""

from collections.abc import Sequence
from pathlib import Path as FilePath
from typing import Any, assert_type

import numpy as np

import wfluid
from wfluid import (
    Animation,
    Arbitrary,
    Buoyancy,
    Constant,
    CoordinateMap,
    Density,
    DensityMisfit,
    Drawing,
    Effort,
    Encoding,
    Envelope,
    Fade,
    FileError,
    Fluid,
    Frame,
    Free,
    Freeze,
    Functional,
    GaussianForce,
    Grid,
    Group,
    Growth,
    ImageForce,
    Instantaneous,
    Keyed,
    LookUp,
    MapMisfit,
    MapQuality,
    Match,
    Morph,
    NoiseForce,
    Oscillator,
    Painted,
    PaintedSource,
    ParticleFunction,
    ParticleKeyframe,
    ParticleMisfit,
    Path,
    Picture,
    PictureError,
    PictureMisfit,
    Run,
    Scene,
    SceneError,
    Seam,
    Setup,
    Solver,
    SolveReport,
    Source,
    State,
    Stroke,
    Timeline,
    VortexForce,
    Wall,
    Walls,
    WarpObjective,
    Wind,
    WriteError,
    animate,
    match_keyframes,
    morph,
    parse_force,
    read_picture,
    read_scene,
    stage,
    write_animation,
    write_picture,
    write_scene,
)
from wfluid.gradient.objectives import Sum


def described(picture: Picture) -> None:
    """Descriptions of a shot: fluids, forces, envelopes, densities."""
    assert_type(Fluid(viscosity=0.1), Fluid)
    assert_type(Fluid(viscosity=0.1).density_names, tuple[str, ...])
    assert_type(Walls(Wall.NO_SLIP).x, Wall)
    assert_type(Walls(Wall.PERIODIC).periodic, tuple[bool, bool])
    assert_type(Grid.for_picture(4, 3).nx, int)
    assert_type(Timeline(1.0, fps=24).frames, int)
    assert_type(Path((0, 1), ((0.3, 0.5), (0.6, 0.5))).at(0.5), tuple[float, float])
    envelopes: list[Envelope] = [
        Instantaneous(0.0),
        Constant(0.0, 1.0),
        Fade(rise=0.3),
        Arbitrary(times=(0.0, 1.0), values=(0.0, 1.0)),
        Oscillator(period=1.0),
    ]
    assert_type(envelopes[0].value(0.5), float)
    assert_type(Constant(0.0, 1.0) * Oscillator(period=1.0), Envelope)
    push = GaussianForce((0.5, 0.5), (1.0, 0.0), 0.1, Constant(0.0, 1.0))
    assert_type(push.radius, float)
    assert_type(VortexForce((0.5, 0.5), spin=4.0, radius=0.1).spin, float)
    assert_type(Growth((0.5, 0.5), rate=0.8, radius=0.1).rate, float)
    assert_type(Stroke(Path((0, 1), ((0.1, 0.1), (0.2, 0.2))), radius=0.1).radius, float)
    assert_type(Wind((1.0, 0.0)).reach, float)
    assert_type(NoiseForce(strength=1.0).reach, float)
    assert_type(ImageForce(picture, "contour").reach, float)
    assert_type(Buoyancy("ink", vector=(0.0, -2.0)).density, str)
    assert_type(Group([push], strength=1.2).strength, float)
    assert_type(Painted(picture, scale=10.0).resampled(4, 3), np.ndarray)
    assert_type(Keyed({0.0: 0.1, 1.0: 0.2}).at(0.5, Grid.for_picture(4, 3)), np.ndarray | float)
    assert_type(Freeze(picture).strength, float)
    assert_type(Density("ink", sources=[Source((0.5, 0.5), rate=1.0, radius=0.1)]).name, str)
    assert_type(Source((0.5, 0.5), rate=1.0, radius=0.1).rate, float)
    assert_type(PaintedSource(Painted(picture)).paint, Painted)
    assert_type(Encoding(quality=90).quality, int | None)


def optimised(picture: Picture, array: np.ndarray, animation: Animation) -> None:
    """Objectives, functionals and matches."""
    objective = ParticleMisfit([(0.4, 0.5)], [(0.6, 0.5)], time=1.0) + 1e-4 * Effort()
    assert_type(objective, Sum)
    assert_type(ParticleMisfit([(0.4, 0.5)], [(0.6, 0.5)], time=1.0).times, tuple[float, ...])
    assert_type(
        ParticleFunction([(0.4, 0.5)], lambda t, places: (0.0, places), times=[1.0]).times, Sequence[float]
    )
    assert_type(MapMisfit(array, time=1.0).times, tuple[float, ...])
    assert_type(DensityMisfit("ink", array, time=1.0).density, str)
    assert_type(PictureMisfit(picture, picture, time=1.0).filter, str)
    assert_type(WarpObjective(lambda state, value: None, time=1.0).time, float)
    free = [Free("forces[0].vector", scale=0.1)]
    assert_type(free[0].scale, float)
    functional = Functional(Grid.for_picture(4, 3), Fluid(), animation.forces, Timeline(1.0), objective, free)
    assert_type(functional.value_and_gradient(functional.start), tuple[float, np.ndarray])
    assert_type(functional.setup(functional.start).velocity, np.ndarray)
    match = match_keyframes(animation, [ParticleKeyframe((0.4, 0.5), (0.5, 0.4), time=1.0)])
    assert_type(match, Match)
    assert_type(match.found, tuple[GaussianForce, ...])


def run(picture: Picture, solver: Solver, lookup: LookUp, seam: Seam, drawing: Drawing, setup: Setup) -> None:
    """Animations, morphs and the solver."""
    frames = animate(picture, Fluid(), [], duration=1.0, fps=12.0, cells=96)
    assert_type(frames, Run[Frame])
    for frame in frames:
        assert_type(frame.picture, Picture)
        assert_type(frame.map, CoordinateMap)
        assert_type(frame.map.displacement, np.ndarray)
        assert_type(frame.quality, MapQuality)
        assert_type(frame.quality.jacobian_min, float)
        assert_type(frame.solve, SolveReport | None)
    shot = Animation(picture, Fluid(), [], Timeline(1.0))
    assert_type(shot.frames(), Run[Frame])
    assert_type(write_animation("a.gif", shot.frames()), list[FilePath])
    assert_type(write_animation("a.gif", [picture, "b.png", np.asarray(picture)]), list[FilePath])
    assert_type(shot.frames().fps, float)
    push = GaussianForce((0.5, 0.5), (1.0, 0.0), 0.1, Constant(0.0, 1.0))
    assert_type(animate("a.png", Fluid(), push, duration=1.0), Run[Frame])
    assert_type(morph("a.png", np.asarray(picture), [((0.4, 0.3), (0.3, 0.3))]), Morph)
    assert_type(shot.frames(), Run[Frame])
    made = morph(picture, picture, [((0.4, 0.3), (0.3, 0.3))])
    assert_type(made, Morph)
    assert_type(made.match, Match)
    state = solver.rest()
    assert_type(state, State)
    assert_type(state.grid, Grid)
    assert_type(solver.report().divergence, float)
    assert_type(lookup.width, int)
    assert_type(seam.position_max, float)
    assert_type(drawing.side, float)
    assert_type(setup.velocity, np.ndarray)


def read_and_written() -> None:
    """Pictures and scenes, and their errors."""
    picture = read_picture("a.png")
    assert_type(picture, Picture)
    assert_type(Picture.of("a.png"), Picture)
    assert_type(Picture.of(np.asarray(picture), "linear"), Picture)
    assert_type(Painted("a.png").scale, float)
    assert_type(picture.width, int)
    assert_type(write_picture("b.png", picture), None)
    scene = read_scene("a.toml")
    assert_type(scene, Scene)
    assert_type(scene.source, str)
    assert_type(stage(scene), Animation)
    assert_type(write_scene("b.toml", scene), None)
    assert_type(parse_force("push", "30,20:5,0"), dict[str, Any])
    try:
        assert_type(wfluid.__version__, str)
    except SceneError as error:
        assert_type(error.args, tuple[Any, ...])
    except PictureError as error:
        assert_type(error.args, tuple[Any, ...])
    except FileError as error:
        assert_type(error.args, tuple[Any, ...])
    except WriteError as error:
        assert_type(error.args, tuple[Any, ...])

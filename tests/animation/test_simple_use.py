"""The simple way works, and a mistake is refused in one line that says what to write."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from wfluid import (
    Animation,
    Buoyancy,
    Constant,
    Density,
    Fluid,
    Frame,
    Freeze,
    GaussianForce,
    Group,
    Growth,
    Instantaneous,
    Oscillator,
    Painted,
    ParticleKeyframe,
    ParticleMisfit,
    Source,
    Stroke,
    Timeline,
    VortexForce,
    Wind,
    animate,
    match_keyframes,
    morph,
    read_picture,
)  # fmt: skip
from wfluid import Path as Way

CAT = Path(__file__).parents[2] / "examples" / "images" / "cat.png"
PUSH = GaussianForce((0.4, 0.3), (1.0, 0.5), 0.06)
SMALL = {"cells": 24, "width": 60, "height": 40}


def pixels(frames):
    return [frame.picture.pixels for frame in frames]


def test_a_path_and_one_force_are_enough(device):
    settings = SMALL | {"device": device.alias}
    long = animate(read_picture(CAT), Fluid(), [PUSH], 0.25, 12, **settings)
    codes = np.asarray(read_picture(CAT))
    for picture, force in ((CAT, PUSH), (str(CAT), (PUSH,)), (codes, Group(PUSH))):
        short = animate(picture, Fluid(), force, 0.25, 12, **settings)
        assert short.fps == 12
        long = animate(read_picture(CAT), Fluid(), [PUSH], 0.25, 12, **settings)
        for one, other in zip(pixels(short), pixels(long), strict=True):
            np.testing.assert_array_equal(one, other)


def test_layers_points_densities_and_sources_need_no_wrapping():
    ink = Density(sources=Source((0.5, 0.3), 4.0, 0.04))
    shot = Animation(
        CAT, Fluid(densities=ink), PUSH, Timeline(0.25, 12), layers={"matte": CAT}, points=(0.4, 0.3)
    )
    assert shot.fluid.density_names == ("ink",) and len(ink.sources) == 1
    assert shot.layers["matte"].width == 451 and shot.forces == (PUSH,) and list(shot.points) == [(0.4, 0.3)]


def shown():
    cat = read_picture(CAT)
    frame = Frame(3, 0.125, cat, None, None, None)
    mask = Painted(np.zeros((40, 60)))
    fluid = Fluid(
        viscosity=np.ones((4, 6)), freeze=Freeze(np.eye(9)), densities=Density("smoke", initial=mask)
    )
    shot = Animation(cat, fluid, [PUSH] * 9, Timeline(1.0))
    return [cat, frame, mask, fluid, shot, shot.frames(), fluid.freeze, Group([PUSH] * 9), fluid.densities[0]]


def test_representations_are_short():
    for thing in shown():
        text = repr(thing)
        assert text.startswith(type(thing).__name__) and len(text) < 180 and "\n" not in text, text
    assert repr(shown()[0]) == "Picture(451 x 300 px, 3 channels, uint8)"
    assert repr(shown()[1]).startswith("Frame(3, 0.125 s, Picture(451 x 300")


def force(center=(0.4, 0.3), vector=(1.0, 0.0), radius=0.06, envelope=None, **more):
    return GaussianForce(center, vector, radius, envelope or Constant(), **more)


LOOK = ParticleKeyframe((0.4, 0.3), (0.41, 0.3), 0.25)


def still():
    return Animation(CAT, Fluid(), [], Timeline(0.25, 12), cells=24)


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        ((3, Fluid(), PUSH, 1.0), "picture: expected a picture, as a path, .* got int"),
        ((CAT, 0.1, PUSH, 1.0), r"fluid: expected a Fluid, such as Fluid\(viscosity=0.001\), got float"),
        ((CAT, Fluid(), "push", 1.0), "forces: expected forces, such as GaussianForce.* got str"),
        ((CAT, Fluid(), [3], 1.0), "forces: expected forces, .* got int"),
        ((CAT, Fluid(), GaussianForce, 1.0), "forces: .* got the class GaussianForce"),
        ((CAT, Fluid(), None, 1.0), "forces: .* got NoneType"),
        ((CAT, Fluid(), PUSH, "long"), "duration: expected a number, got str"),
    ],
)
def test_wrong_types_are_refused_in_one_line(arguments, says):
    with pytest.raises(TypeError, match=says) as refused:
        animate(*arguments)
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize(
    ("make", "says"),
    [
        (lambda: Animation(CAT, Fluid(), PUSH, 2.0), r"timeline: expected a Timeline, such as Timeline\(2.0"),
        (
            lambda: Animation(CAT, Fluid(), PUSH, Timeline(1.0), layers=[CAT]),
            "layers: expected pictures by name",
        ),
        (lambda: force(center=5), "GaussianForce.center: expected two numbers x, y, got 5"),
        (lambda: force(vector="right"), "GaussianForce.vector: expected two numbers x, y, got 'right'"),
        (lambda: force(radius="big"), "GaussianForce.radius: expected a number, got str"),
        (lambda: force(envelope=1.0), r"envelope: expected an envelope, such as Constant\(0, 1\)"),
        (lambda: force(weight=3), "GaussianForce.weight: expected a picture"),
        (lambda: VortexForce((0.5, 0.5), "fast", 0.1), "VortexForce.spin: expected a number, got str"),
        (lambda: Buoyancy("ink", envelope=2.0), "Buoyancy.envelope: expected an envelope"),
        (lambda: Fluid(densities="ink"), "densities: expected Density objects, got str"),
        (lambda: Density(sources=3), "sources: expected Source or PaintedSource objects, got int"),
        (lambda: Fluid(viscosity=np.zeros((2, 2), np.uint8)), r"a picture needs a scale: Painted\(picture"),
        (lambda: Fluid(viscosity=CAT), r"a picture needs a scale: Painted\(picture"),
        (lambda: ParticleKeyframe((0.2, 0.2), (0.2, "a"), 1.0), "destination: expected two numbers"),
        (lambda: ParticleKeyframe((0.2, 0.2), (0.3, 0.2), "1"), "ParticleKeyframe.time: expected a number"),
        (lambda: match_keyframes(still(), 3), "keyframes: expected ParticleKeyframe objects, got int"),
        (
            lambda: match_keyframes(still(), LOOK, pins=(0.2, 0.3)),
            "a pin: expected two numbers x, y, got 0.2",
        ),
        (lambda: morph(CAT, 4, [((0.2, 0.2), (0.2, 0.2))]), "b: expected a picture"),
    ],
)
def test_wrong_types_of_parts_are_refused_in_one_line(make, says):
    with pytest.raises(TypeError, match=says) as refused:
        make()
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize(
    "make",
    [
        lambda at: force(center=at),
        lambda at: VortexForce(at, 1.0, 0.1),
        lambda at: Growth(at, 1.0, 0.1),
        lambda at: Source(at, 1.0, 0.1),
        lambda at: Stroke(Way((0, 1), ((0.1, 0.1), at)), 0.1),
        lambda at: ParticleKeyframe(at, (0.5, 0.5), 1.0),
        lambda at: ParticleKeyframe((0.5, 0.5), at, 1.0),
        lambda at: morph(CAT, CAT, [(at, (0.5, 0.5))]),
        lambda at: ParticleMisfit([(0.1, 0.1), at], [(0.5, 0.5)] * 2, time=1.0),
        lambda at: morph(CAT, CAT, [((0.5, 0.5), at)]),
        lambda at: Animation(CAT, Fluid(), PUSH, Timeline(1.0), points=[at]),
    ],
)
def test_places_in_pixels_are_refused_with_the_conversion(make):
    with pytest.raises(ValueError, match=r"205, 162\) looks like pixels: write \(x / side, y / side\)"):
        make((205, 162))


@pytest.mark.parametrize(
    "make",
    [
        lambda at: force(center=at),
        lambda at: VortexForce(at, 1.0, 0.06),
        lambda at: Growth(at, 1.0, 0.06),
        lambda at: Stroke(Way((0, 1), (at, at)), 0.06),
        lambda at: force(center=Way((0, 1), (at, at))),
    ],
)
def test_a_centre_outside_the_picture_is_refused(make):
    """The cat is 1 x 0.665; a periodic axis has no outside."""
    says = r"\(0.5, 0.9\) lies outside the picture, 1 x 0.665188 longer sides: write .* here 451"
    with pytest.raises(ValueError, match=says):
        animate(CAT, Fluid(), make((0.5, 0.9)), 1.0)
    animate(CAT, Fluid(walls="periodic"), make((0.5, 0.9)), 1.0)
    animate(CAT, Fluid(), make((0.5, 0.66)), 1.0)


def test_points_and_keyframes_outside_the_picture_are_refused():
    with pytest.raises(ValueError, match=r"lies outside the picture, .* write"):
        animate(CAT, Fluid(), PUSH, 1.0, points=[(0.5, 0.9)])
    shot = Animation(CAT, Fluid(), [], Timeline(1.0))
    with pytest.raises(ValueError, match=r"the point 0.5,0.9 lies outside the picture, .* write"):
        match_keyframes(shot, [ParticleKeyframe((0.5, 0.9), (0.5, 0.5), 1.0)])


@pytest.mark.parametrize(
    ("acting", "arrow", "walls"),
    [
        (force(vector=(40, 0)), r"40, 0 pixels, write \(0.355, 0\)", "free-slip"),
        (force(vector=(22, 15), envelope=Oscillator(period=1.0)), "write", "free-slip"),
        (force(vector=(20, 0), envelope=Instantaneous()), r"write \(0.0894, 0\)", "free-slip"),
        (Wind((30, 0)), r"30, 0 pixels, write \(0.133, 0\)", "periodic"),
    ],
)
def test_a_vector_in_pixels_is_refused_with_the_conversion(acting, arrow, walls):
    with pytest.raises(ValueError, match=arrow):
        animate(CAT, Fluid(walls=walls), acting, 1.0)


@pytest.mark.parametrize(
    ("acting", "fluid"),
    [
        (force(vector=(100, 0), envelope=Constant(0.2, 0.25)), Fluid()),  # a knock
        (force(vector=(100, 0), envelope=Oscillator(period=0.1)), Fluid()),  # a trembling
        (force(vector=(1000, 0)), Fluid(viscosity=10.0)),  # syrup
        (force(vector=(100, 0)), Fluid(viscosity=1.0, inertia=False)),
        (force(vector=(5, 0)), Fluid()),
    ],
)
def test_large_accelerations_that_carry_little_are_taken(acting, fluid):
    animate(CAT, fluid, acting, 1.0)


def test_the_conversion_moves_a_point_by_the_arrow(device):
    """What the message says to write carries the centre by the arrow in pixels, but for the walls."""
    picture = np.zeros((60, 60), np.uint8)
    with pytest.raises(ValueError, match="write") as refused:
        animate(picture, Fluid(viscosity=0), force((0.5, 0.5), (12, 0), 0.1), 1.0)
    x, y = (float(part) for part in str(refused.value).rpartition("(")[2].rstrip(")").split(","))
    right = force((0.5, 0.5), (x, y), 0.1)
    *_, last = animate(
        picture, Fluid(viscosity=0), right, 1.0, 12, cells=60, points=[(0.5, 0.5)], device=device.alias
    )
    assert last.points[0, 0] * 60 - 30 == pytest.approx(12, rel=0.25)


def test_what_a_search_finds_is_no_mistake():
    """A copy with other forces may have any: the units of the first were checked."""
    shot = Animation(CAT, Fluid(), PUSH, Timeline(1.0))
    found = [force(center=(0.5, 0.7)), force(vector=(2000.0, 0.0))]
    assert replace(shot, forces=found).forces == found

"""Keyframes of a creeping fluid: points arrive without a search, gently, and nothing folds."""

import math

import numpy as np
import pytest
from keyframe_cases import CASES, PAIR, SIDE, Case, around, scattered

from wfluid import Animation, Fluid, Freeze, GaussianForce, Timeline
from wfluid.domain.envelopes import Constant
from wfluid.keyframes.keyframes import ParticleKeyframe
from wfluid.keyframes.match import match_keyframes
from wfluid.keyframes.responses import Responses
from wfluid.keyframes.trajectories import trajectories
from wfluid.pictures.picture import Picture

FACE = (((205, 141), (201, 134)), ((244, 141), (248, 134)), ((252, 92), (252, 84)))
"""Corners of a mouth and a brow of a face, and where they should be [px]."""


def log_strain(warp):
    """Size of the logarithm of the map's singular values at each cell, the larger of the two."""
    grid = warp.grid
    slopes = [np.gradient(warp.source_of, h, axis=axis) for axis, h in ((1, grid.hx), (0, grid.hy))]
    values = np.linalg.svd(np.stack(slopes, axis=-1), compute_uv=False)
    return np.abs(np.log(np.maximum(values, 1e-6))).max(axis=-1)


def seen(match):
    """The longest displacement [px], and the log-strain of 99 % of the cells, at the end."""
    animation = match.animation
    steps = animation.timeline.steps
    maps = trajectories(animation.solver, animation.timeline, animation.forces, match.tracks[0], [steps])[1]
    return SIDE * np.linalg.norm(maps[steps].displacement, axis=2).max(), np.percentile(
        log_strain(maps[steps]), 99
    )


def face(device, cells=128, pins=(), **fluid):
    """The match of the face's arrows."""
    picture = Picture(np.zeros((SIDE, SIDE, 3), np.float32))
    still = Animation(
        picture,
        Fluid(viscosity=0.005, inertia=False, **fluid),
        [],
        Timeline(1.0, 24, 1),
        cells,
        device=device.alias,
    )
    keyframes = [ParticleKeyframe(*(tuple(np.array(p) / SIDE) for p in arrow), 1.0) for arrow in FACE]
    return match_keyframes(still, keyframes, pins=[tuple(np.array(p) / SIDE) for p in pins])


def check_gentle(match):
    """Within 0.25 px, nothing moves far beyond the arrows, and nothing is strained by more than a third."""
    longest, strain = seen(match)
    arrow = max(SIDE * math.dist(a.keyframe.point, a.keyframe.destination) for a in match.arrivals)
    assert match.status == "reached" and match.residual * SIDE <= 0.25
    assert match.jacobian[0] > 0.9 and longest <= 1.5 * arrow and strain <= 0.3, (longest, strain)


@pytest.mark.parametrize("pins", [(), [(190, 100), (225, 120), (265, 130)]], ids=["free", "pins"])
def test_a_smile_moves_a_face_gently(device, pins):
    check_gentle(face(device, 96, pins))


@pytest.mark.long
def test_a_face_in_a_frozen_picture_moves_gently(device):
    """All is frozen outside an ellipse around the face: its volume must turn back within."""
    y, x = np.mgrid[:SIDE, :SIDE] + 0.5
    outside = np.clip((np.hypot((x - 225) / 47, (y - 122) / 60) - 1) / 0.12 + 0.5, 0, 1)
    check_gentle(face(device, freeze=Freeze(outside)))


def creeping(case, **more):
    """A case in a creeping fluid, for a second."""
    settings = {"arrows": case.arrows, "paths": case.paths, "pins": case.pins, "cells": case.cells}
    fluid = {**case.fluid, "inertia": False}
    return Case(**{**settings, "duration": 1.0, "height": case.height, "fluid": fluid, **more})


LONGER = [pytest.param(name, marks=pytest.mark.long) for name in ("a swap", "pins around", "no-slip")]


@pytest.mark.parametrize("name", ["one arrow", "periodic", "not square", *LONGER])
def test_points_arrive_and_nothing_folds(device, name):
    match = creeping(CASES[name], cells=96).match(device.alias)
    assert match.status == "reached" and match.jacobian[0] > 0.9
    assert match.evaluations < 60


@pytest.mark.long
@pytest.mark.parametrize("seed", range(12))
def test_arrows_at_random_arrive(device, seed):
    count = 1 + seed % 6 * 2
    arrows = scattered(count, 0.16, seed) if count > 1 else PAIR[:1]
    match = creeping(Case(arrows=arrows), cells=128).match(device.alias)
    assert match.status == "reached" and match.jacobian[0] > 0.5


def test_a_path_and_a_pin_arrive_at_every_time(device):
    match = CASES["a path, one pinned"]
    match = creeping(match, duration=0.5).match(device.alias)
    assert match.status == "reached" and len(match.arrivals) == 4
    assert np.abs(match.tracks[:, 1] - match.tracks[0, 1]).max() * SIDE < 0.5  # the pin, all the time


def test_what_lies_in_a_corner_does_not_spoil_the_others(device):
    case = Case(arrows=[((0.0, 0.0), (0.2, 0.2)), PAIR[1]], fluid={"inertia": False}, duration=1.0)
    corner, other = case.match(device.alias).arrivals
    assert "corner" in corner.reason and other.residual * SIDE < 0.25


def test_a_point_that_nothing_moves_is_left_with_its_reason(device):
    (corner,) = Case(arrows=[((0.0, 0.0), (0.2, 0.2))], fluid={"inertia": False}).match(device.alias).arrivals
    assert "corner" in corner.reason and corner.particle == (0.0, 0.0)


def test_a_stopped_search_keeps_its_best_pass(device):
    """Eight runs for each of five windows are a pass; stopped in the second, the first one's forces stay."""
    case, count = creeping(CASES["one arrow"], cells=32), []

    def stop(at):
        count.append(at.worst)
        return len(count) > 44

    match = case.match(device.alias, tolerance=1e-9, progress=stop)
    assert match.status == "stopped" and match.residual * SIDE < 2.0


def test_the_gentlest_forces_cost_least():
    """Any other forces that move the points so cost more; the misfits are removed by repetition."""
    rng = np.random.default_rng(3)
    moved, root = rng.standard_normal((4, 10)), rng.standard_normal((10, 10))
    responses, wanted = Responses(moved, root @ root.T + np.eye(10)), rng.standard_normal(4)
    forces = responses.gentlest(moved, wanted, np.ones(4))
    forces += responses.gentlest(moved, wanted - moved @ forces, np.ones(4))
    np.testing.assert_allclose(moved @ forces, wanted, atol=1e-9)
    null = np.linalg.svd(moved)[2][4:]
    for other in forces + 0.1 * np.concatenate([null, -null]):
        assert other @ responses.cost @ other > forces @ responses.cost @ forces


def test_a_creeping_flow_runs_back_the_way_it_came(device):
    """Stokes flow is reversible: forces turned round in reversed order undo the picture's motion.

    What remains is the error of the steps and of the interpolation, 1 % of the way there.
    """
    picture = Picture(np.zeros((64, 64, 3), np.float32))
    there = GaussianForce((0.4, 0.5), (0.4, 0.1), 0.1, Constant(0.0, 0.5))
    back = GaussianForce((0.4, 0.5), (-0.4, -0.1), 0.1, Constant(0.5, 1.0))
    ways = {}
    for name, forces in (("there", [there]), ("back", [there, back])):
        still = Animation(
            picture, Fluid(inertia=False), forces, Timeline(1.0, 24, 2), 64, device=device.alias
        )
        *_, last = still.frames()
        ways[name] = last.quality.displacement_max
    assert ways["there"] > 0.05 and ways["back"] < 0.01 * ways["there"], ways


def test_the_flow_stops_with_its_force_and_depends_on_ratios_of_viscosity_only(device):
    """Ten times the viscosity and the force give the same picture; after the force nothing moves."""
    picture = Picture(np.zeros((48, 48, 3), np.float32))
    found = []
    for factor in (1.0, 10.0):
        force = GaussianForce((0.4, 0.5), (0.3 * factor, 0.0), 0.1, Constant(0.0, 0.25))
        fluid = Fluid(viscosity=0.002 * factor, inertia=False)
        frames = Animation(picture, fluid, [force], Timeline(0.5, 24, 1), 48, device=device.alias).frames()
        found.append([frame.map.displacement.copy() for frame in frames])
    np.testing.assert_allclose(found[0][-1], found[1][-1], atol=1e-4 * np.abs(found[0][-1]).max())
    np.testing.assert_array_equal(found[0][6], found[0][-1])
    assert np.abs(found[0][-1]).max() > 0.05


def test_pins_are_held_by_what_surrounds_them(device):
    case = Case(arrows=[((0.5, 0.5), (0.56, 0.5))], pins=around((0.5, 0.5), 0.15), cells=96, duration=1.0)
    match = creeping(case).match(device.alias)
    held = np.abs(match.tracks[:, 1:] - match.tracks[0, 1:]).max()
    assert match.status == "reached" and held * SIDE < 0.5

"""What the map loses by the solves of the diffusion, against solves to 1e-6: within `diffusion_loss`."""

import warnings

import numpy as np
import pytest

from wfluid.animation.simulation import PoorSolveWarning, Simulation
from wfluid.domain.grid import Grid
from wfluid.domain.limits import DIFFUSION_LOSS
from wfluid.domain.timeline import Timeline
from wfluid.model.fluid import Fluid
from wfluid.model.gaussian_forces import GaussianForce
from wfluid.model.painted import Freeze
from wfluid.step.solver import Solver

SOFT = 1e-3
PUSHES = [GaussianForce((0.5, 0.5), (0.6, 0.3), 0.1), GaussianForce((0.7, 0.65), (-0.4, -0.5), 0.1)]


def distance(n, x=0.5, y=0.5):
    at = (np.arange(n) + 0.5) / n
    return np.hypot(at[None, :] - x, at[:, None] - y)


def discs(n, mu, centers=((0.5, 0.5),), radius=0.15):
    inside = np.any([distance(n, *center) < radius for center in centers], axis=0)
    return np.where(inside, mu, SOFT)


def gentle_stripes(n, mu):
    """Three stripes whose viscosity changes as gently as it can: no cell differs much from its neighbours."""
    wave = 0.5 + 0.5 * np.sin(6 * np.pi * (np.arange(n) + 0.5) / n)
    return np.repeat(SOFT * (mu / SOFT) ** wave[:, None], n, axis=1)


def lost(device, n, fps, fluid, seconds=1.0):
    """How far the map is from that of exact solves, at most, and the estimate of it [longer side]."""
    maps = []
    for exact in ({"diffusion_tolerance": 1e-6}, {}):
        solver = Solver(Grid(n, n), Fluid(**fluid, **exact), device)
        timeline = Timeline(seconds, fps=fps / 4, substeps=4)
        *_, last = Simulation(solver, timeline).moments(PUSHES, timeline.steps // 4)
        maps.append(np.stack(last.state.displacement))
    return np.linalg.norm(maps[1] - maps[0], axis=0).max(), last.solve.map_loss


MEDIA = {
    "disc": lambda n: {"viscosity": discs(n, 10.0)},
    "hard disc": lambda n: {"viscosity": discs(n, 100.0)},
    "three discs": lambda n: {"viscosity": discs(n, 10.0, ((0.3, 0.3), (0.7, 0.35), (0.5, 0.7)), 0.1)},
    "stripes": lambda n: {"viscosity": gentle_stripes(n, 10.0)},
    "no-slip": lambda n: {"viscosity": discs(n, 10.0), "walls": "no-slip"},
    "periodic": lambda n: {"viscosity": discs(n, 10.0), "walls": "periodic"},
    "moving": lambda n: {"viscosity": discs(n, 10.0), "viscosity_moves": True},
    "frozen": lambda n: {
        "viscosity": discs(n, 10.0, ((0.35, 0.35),)),
        "freeze": Freeze((distance(n, 0.7, 0.6) < 0.12) * 1.0),
    },
    "contrast 100": lambda n: {"viscosity": discs(n, 0.1)},
    "contrast 5": lambda n: {"viscosity": discs(n, 0.005)},
    "number": lambda n: {"viscosity": 0.01},
}


@pytest.mark.parametrize("name", MEDIA)
def test_the_map_loses_no_more_than_is_allowed_and_the_estimate_is_right(device, name):
    """The estimate knows no directions and no places, so it is right to a factor of 4."""
    off, estimate = lost(device, 48, 48, MEDIA[name](48))
    assert off < DIFFUSION_LOSS
    assert off / 4 < estimate < 4 * off


@pytest.mark.long
@pytest.mark.parametrize("fps", [24, 96, 192])
@pytest.mark.parametrize("name", ["disc", "three discs", "stripes", "frozen"])
def test_it_loses_no_more_on_a_fine_grid_or_with_other_steps(device, name, fps):
    off, estimate = lost(device, 128, fps, MEDIA[name](128))
    assert off < DIFFUSION_LOSS
    assert off / 4 < estimate < DIFFUSION_LOSS / 2


@pytest.mark.parametrize("name", ["disc", "contrast 5", "number"])
def test_a_smaller_loss_may_be_asked_for(device, name):
    off, estimate = lost(device, 48, 48, {**MEDIA[name](48), "diffusion_loss": DIFFUSION_LOSS / 20})
    assert off < DIFFUSION_LOSS / 20
    assert estimate < DIFFUSION_LOSS / 10


@pytest.mark.parametrize("value", [0.0, 2.0, float("nan")])
def test_a_loss_outside_its_range_is_refused(value):
    with pytest.raises(ValueError, match=r"diffusion_loss .*: expected 1e-9 … 1"):
        Fluid(diffusion_loss=value)


def moments(device, **fluid):
    solver = Solver(Grid(32, 32), Fluid(**fluid), device)
    fast = [GaussianForce((0.5, 0.5), (60.0, 30.0), 0.1)]
    return list(Simulation(solver, Timeline(0.5, fps=24, substeps=1)).moments(fast, 12))


def test_a_loss_that_is_too_large_warns_with_its_remedy(device):
    """A fast push in a thick fluid, where the number of cycles is fixed."""
    warning = r"by \d\.\de-0\d of the longer side; set diffusion_tolerance \(--diffusion-tolerance\) to "
    with pytest.warns(PoorSolveWarning, match=warning) as seen:
        moments(device, viscosity=0.1)
    remedy = float(str(seen[0].message).partition("tolerance) to ")[2].partition(" ")[0])
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        *_, last = moments(device, viscosity=0.1, diffusion_tolerance=remedy)
    assert last.solve.map_loss < 3 * DIFFUSION_LOSS

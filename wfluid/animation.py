"""Animations: frames of a picture carried by the fluid, one after the other."""

from __future__ import annotations

import math
import time
import warnings
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from functools import cached_property

from wfluid.controls import STEP_LIMIT
from wfluid.coordinate_map import CoordinateMap, MapQuality, measure_map
from wfluid.device import open_device
from wfluid.fluid import Fluid
from wfluid.forces import Force, Group
from wfluid.grid import LEAST_CELLS, Grid
from wfluid.linear import ITERATION_LIMIT
from wfluid.look_up import LookUp, check_look_up
from wfluid.picture import Picture
from wfluid.solver import Solver, SolveReport

STEPS_PER_SECOND = 96
"""Steps a second when `substeps` is not given: a step of 1/96 s keeps the splitting error small."""

LEAST_FPS, FPS_LIMIT = 0.01, 1000.0
"""Frame rates that make sense."""

FRAME_LIMIT = 100_000
"""Most frames of one animation."""

CELLS_LIMIT = 8192
"""Most cells along the longer side: indices are 32-bit."""

SIZE_LIMIT = 32768
"""Longest side of a frame [px]."""

POOR_RESIDUAL = 0.02
"""Relative residual of the projection above which a frame warns."""


class PoorSolveWarning(UserWarning):
    """A solve left more than it should; the message has the number and the remedy."""


@dataclass(frozen=True)
class Timeline:
    """Frames at n / fps for n = 0 … round(duration fps), each `substeps` steps after the one before."""

    duration: float
    """Length [s], positive."""
    fps: float = 24.0
    """Frames a second."""
    substeps: int | None = None
    """Steps a frame; by default so many that a step is no longer than 1/96 s."""

    def __post_init__(self) -> None:
        for name in ("duration", "fps"):
            value = getattr(self, name)
            if not (math.isfinite(value) and value > 0):
                raise ValueError(f"{name} {value}: expected a positive number")
        if self.substeps is not None and not (isinstance(self.substeps, int) and self.substeps >= 1):
            raise ValueError(f"substeps {self.substeps}: expected a whole number from 1 on")
        if not 0.5 <= self.duration * self.fps <= FRAME_LIMIT:
            raise ValueError(
                f"{self.duration:g} s at {self.fps:g} fps is {self.duration * self.fps:g} frames: "
                f"expected 1 … {FRAME_LIMIT}"
            )
        if not LEAST_FPS <= self.fps <= FPS_LIMIT:
            raise ValueError(f"fps {self.fps:g}: expected {LEAST_FPS:g} … {FPS_LIMIT:g}")
        if self.dt > STEP_LIMIT:
            raise ValueError(f"steps of {self.dt:g} s: expected at most {STEP_LIMIT:g}; use more substeps")

    @property
    def frames(self) -> int:
        """Frames shown, both ends included."""
        return max(1, round(self.duration * self.fps)) + 1

    @property
    def steps_per_frame(self) -> int:
        """Steps between two frames."""
        return self.substeps or math.ceil(STEPS_PER_SECOND / self.fps)

    @property
    def dt(self) -> float:
        """Length of a step [s]."""
        return self.time_of(1)

    def time_of(self, step: int) -> float:
        """When a step begins [s]: the same number as the end of the one before."""
        return step / (self.fps * self.steps_per_frame)


@dataclass(frozen=True)
class Frame:
    """One picture of an animation, with its map and how good it is."""

    index: int
    """Number of the frame, from 0."""
    time: float
    """Its time [s]."""
    picture: Picture
    """The warped picture; that of frame 0 is the untouched one."""
    map: CoordinateMap
    """Where its colours come from."""
    quality: MapQuality
    """What the map does to the picture."""
    solve: SolveReport | None
    """What the last step's solves left; None for frame 0."""


@dataclass
class Seconds:
    """Where the time of an animation went [s]."""

    compile: float = 0.0
    """Loading the kernels, compiling them first where the cache has none."""
    simulate: float = 0.0
    """Stepping the fluid and judging its map."""
    lookup: float = 0.0
    """Rendering pictures."""


@dataclass(frozen=True)
class Animation:
    """A picture, a fluid, forces and a timeline; iterate over `frames()` to run it.

    Nothing is computed before the first frame is asked for, and no frame is kept.
    """

    picture: Picture
    """What is animated."""
    fluid: Fluid
    """What it is made of."""
    forces: Sequence[Force | Group]
    """What moves it."""
    timeline: Timeline
    """When frames are shown, and how many steps lie between."""
    cells: int = 256
    """Cells of the grid along the picture's longer side."""
    width: int | None = None
    """Width of the frames [px]; the picture's by default."""
    height: int | None = None
    """Height of the frames [px]; the picture's by default."""
    filter: str = "cubic"
    """How the picture is read between pixels: "nearest", "bilinear", "cubic"."""
    edge: str = "clamp"
    """What lies beyond its edges: "clamp", "mirror", "wrap", "transparent"; periodic axes wrap."""
    device: str | None = None
    """"cpu" (default), "cuda", "cuda:1", …"""
    seconds: Seconds = field(default_factory=Seconds, compare=False)
    """Where the time went, filled in while frames are made."""

    def __post_init__(self) -> None:
        for name in ("width", "height"):
            size = getattr(self, name)
            if size is not None and not 1 <= size <= SIZE_LIMIT:
                raise ValueError(f"{name} {size}: expected 1 … {SIZE_LIMIT} pixels")
        check_look_up(self.filter, self.edge)
        if not LEAST_CELLS <= self.cells <= CELLS_LIMIT:
            raise ValueError(f"cells {self.cells}: expected {LEAST_CELLS} … {CELLS_LIMIT}")

    @property
    def grid(self) -> Grid:
        """The fluid's grid."""
        return Grid.for_picture(self.picture.width, self.picture.height, self.cells)

    @cached_property
    def solver(self) -> Solver:
        """The solver; asking for it opens the device and loads the kernels."""
        solver = Solver(self.grid, self.fluid, open_device(self.device))
        self.seconds.compile = solver.compile_seconds
        return solver

    def _source(self) -> Picture:
        """What is looked up in: shrunk first when the frames are smaller, so that they do not alias."""
        width, height = self.width or self.picture.width, self.height or self.picture.height
        return self.picture.resized(min(width, self.picture.width), min(height, self.picture.height))

    def frames(self) -> Iterator[Frame]:
        """Run the animation from rest, one frame at a time."""
        solver, timeline, clock = self.solver, self.timeline, time.perf_counter
        look_up = LookUp(
            self._source(),
            self.grid,
            self.fluid.walls,
            solver.device,
            width=self.width or self.picture.width,
            height=self.height or self.picture.height,
            filter=self.filter,
            edge=self.edge,
        )
        now, after = solver.rest(), solver.rest()
        solve, warned = None, False
        for index in range(timeline.frames):
            began = clock()
            if index:
                for step in range((index - 1) * timeline.steps_per_frame, index * timeline.steps_per_frame):
                    start, end = timeline.time_of(step), timeline.time_of(step + 1)
                    solver.step(now, after, self.forces, start, timeline.dt, until=end)
                    now, after = after, now
                solve = solver.report()
                warned = _judge(solve, self.fluid, index, warned)
            quality = measure_map(now, self.fluid.walls)
            warp = CoordinateMap.of_state(now, self.fluid.walls)
            simulated = clock()
            picture = look_up.render(now.d_x, now.d_y) if index else look_up.untouched
            self.seconds.simulate += simulated - began
            self.seconds.lookup += clock() - simulated
            yield Frame(index, index / timeline.fps, picture, warp, quality, solve)


def animate(
    picture: Picture,
    fluid: Fluid,
    forces: Sequence[Force | Group],
    duration: float,
    fps: float = 24.0,
    substeps: int | None = None,
    **settings,
) -> Iterator[Frame]:
    """Frames of `picture` moved by `forces` for `duration` seconds, made as they are asked for.

    `settings` are those of `Animation`: cells, width, height, filter, edge, device.

    Raises:
        ValueError: a value outside its range; the message names it and the range.
    """
    timeline = Timeline(duration, fps, substeps)
    return Animation(picture, fluid, tuple(forces), timeline, **settings).frames()


def _judge(solve: SolveReport, fluid: Fluid, index: int, warned: bool) -> bool:
    """Stop where the fluid is no longer finite; warn once of a projection that left too much.

    The paper's own scheme is not warned of: few Jacobi sweeps are part of it.
    """
    pressure = solve.pressure
    if not math.isfinite(pressure.norm + pressure.norm_b + solve.divergence):
        raise FloatingPointError(
            f"frame {index}: the velocity is no longer finite; use smaller forces or steps"
        )
    if warned or fluid.scheme == "paper":
        return warned
    text = _poor(solve, fluid)
    if text:
        warnings.warn(f"frame {index}: {text} (said once)", PoorSolveWarning, stacklevel=2)
    return bool(text)


def _poor(solve: SolveReport, fluid: Fluid) -> str | None:
    """What a step's solves left too much of, with the remedy; None if nothing."""
    pressure, diffusion = solve.pressure, solve.diffusion
    if pressure.relative > POOR_RESIDUAL:
        left = f"the projection left {pressure.relative:.1e} of the divergence after {pressure.iterations}"
        if pressure.method == "multigrid":
            more = f"set pressure_cycles (--pressure-cycles) to {fluid.pressure_cycles + 2}"
            return f"{left} cycles; {more}"
        if pressure.method == "jacobi":
            return f"{left} sweeps; set solver (--solver) to multigrid"
        return f"{left} iterations; soften the edges of the freeze mask"
    if diffusion.method == "conjugate gradients" and diffusion.iterations == ITERATION_LIMIT:
        return (
            f"the diffusion left {diffusion.relative:.1e} of its change after "
            f"{diffusion.iterations} iterations; "
            "lower the contrast of the viscosity, soften its edges, or use more substeps"
        )
    return None

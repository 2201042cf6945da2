"""Animations: frames of a picture carried by the fluid, one after the other."""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from wfluid.animation.frame import Frame
from wfluid.animation.loops import Seam, check_loop, fit_to_loop, frames_of, loop_frames
from wfluid.animation.run import Run, RunTimes
from wfluid.animation.simulation import SimulatedFrame, Simulation
from wfluid.animation.swings import balanced_moments, swing_period
from wfluid.domain.checks import check_whole
from wfluid.domain.grid import Grid
from wfluid.domain.limits import CELLS, CELLS_LIMIT, FPS, LEAST_CELLS, SIZE_LIMIT
from wfluid.domain.paths import position
from wfluid.domain.timeline import Timeline
from wfluid.fields.device import open_device
from wfluid.model.fluid import Fluid
from wfluid.model.force import Force, Group, flatten
from wfluid.model.units import check_inside, check_units
from wfluid.pictures.picture import Picture, PictureLike, picture_of
from wfluid.pictures.sampling import EDGE, FILTER, check_look_up
from wfluid.step.solver import Solver
from wfluid.view.coordinate_map import CoordinateMap
from wfluid.view.densities import composite_densities
from wfluid.view.lookup import LookUp
from wfluid.view.quality import measure_map


@dataclass(frozen=True)
class Animation:
    """A picture, a fluid, forces and a timeline; iterate over `frames()` to run it.

    Frames are computed one by one when they are requested, and are not stored.

    Raises:
        TypeError: a value of another type; the message says what to write.
        ValueError: a value outside its range, a centre outside the picture, a vector that looks like pixels,
            or a loop that does not suit the forces.
    """

    picture: Picture
    """The picture that is animated; anything that `Picture.of` takes."""
    fluid: Fluid
    """Viscosity, walls, densities and numerical scheme."""
    forces: Force | Group | Sequence[Force | Group]
    """Forces and groups of forces on the fluid; one needs no list."""
    timeline: Timeline
    """Duration, frame rate and steps per frame."""
    cells: int = CELLS
    """Cells of the grid along the picture's longer side."""
    width: int | None = None
    """Width of the frames [px]; the picture's by default."""
    height: int | None = None
    """Height of the frames [px]; the picture's by default."""
    filter: str = FILTER
    """Interpolation between the picture's pixels: "nearest", "bilinear", "cubic", "lanczos"."""
    edge: str = EDGE
    """Values beyond the edges: "clamp", "mirror", "wrap", "transparent"; periodic axes always wrap."""
    device: str | None = None
    """"cpu" (default), "cuda", "cuda:1", …"""
    layers: Mapping[str, Picture] = field(default_factory=dict)
    """Further pictures and mattes warped by the same map, stretched over the picture, by name; anything that
    `Picture.of` takes."""
    points: Sequence[tuple[float, float]] = ()
    """Positions x, y of points of the picture that are tracked [longer side]."""
    loop: str | None = None
    """Kind of loop: "oscillate", "pingpong" or "crossfade"; None for an animation with an end."""
    balanced: bool = False
    """Whether swings that last stay about their place: a steady force balances the streaming they cause."""

    units_checked: bool = field(default=False, compare=False)
    """Whether places and vectors are known not to be pixels: those of a scene, and of a changed copy."""

    def __post_init__(self) -> None:
        self._take_types()
        for name in ("width", "height"):
            if getattr(self, name) is not None:
                check_whole(name, getattr(self, name), 1, SIZE_LIMIT, " pixels")
        check_look_up(self.filter, self.edge)
        check_whole("cells", self.cells, LEAST_CELLS, CELLS_LIMIT)
        forces = flatten(self.forces)
        if not self.units_checked:
            self._check_units(forces)
        if self.loop is not None:
            check_loop(self.loop, forces)
            forces = tuple(fit_to_loop(force, self._loop_frames / self.timeline.fps) for force in forces)
        object.__setattr__(self, "_acting", forces)

    def _take_types(self) -> None:
        """Make pictures of what is given as one, and check the other types."""
        object.__setattr__(self, "picture", picture_of("picture", self.picture))
        if not isinstance(self.fluid, Fluid):
            given = type(self.fluid).__name__
            raise TypeError(f"fluid: expected a Fluid, such as Fluid(viscosity=0.001), got {given}")
        if not isinstance(self.timeline, Timeline):
            given = type(self.timeline).__name__
            raise TypeError(f"timeline: expected a Timeline, such as Timeline(2.0, fps=24), got {given}")
        if not isinstance(self.layers, Mapping):
            given = type(self.layers).__name__
            raise TypeError(f'layers: expected pictures by name, such as {{"matte": picture}}, got {given}')
        layers = {name: picture_of(f"layer {name}", layer) for name, layer in self.layers.items()}
        object.__setattr__(self, "layers", layers)
        if isinstance(self.forces, Force | Group):
            object.__setattr__(self, "forces", (self.forces,))

    def _check_units(self, forces: Sequence[Force]) -> None:
        """Refuse places outside the picture, and vectors in pixels."""
        picture, grid = self.picture, self.grid
        extent, side = (grid.width, grid.height), max(picture.width, picture.height)
        check_units(forces, self.fluid, extent, side, self.timeline.end)
        if np.ndim(self.points) == 1 and len(self.points) == 2:
            object.__setattr__(self, "points", (self.points,))
        for point in self.points:
            check_inside("a point", position("points", point), extent, side)
        object.__setattr__(self, "units_checked", True)

    def __repr__(self) -> str:
        frames, fps = self.frame_count, self.timeline.fps
        return f"Animation({self.picture}, {len(self._acting)} forces, {frames} frames at {fps:g} per second)"

    @property
    def _loop_frames(self) -> int:
        return frames_of(self.loop, self.timeline.frames - 1)

    @property
    def frame_count(self) -> int:
        """Number of frames, both ends included; a loop omits its last frame, which equals the first."""
        return self.timeline.frames if self.loop is None else self._loop_frames

    @property
    def grid(self) -> Grid:
        """The grid of the fluid."""
        return Grid.for_picture(self.picture.width, self.picture.height, self.cells)

    @cached_property
    def solver(self) -> Solver:
        """The solver; the first access opens the device and loads the kernels."""
        return Solver(self.grid, self.fluid, open_device(self.device))

    @property
    def _swing_period(self) -> float:
        """The period of swings that are balanced [s]; 0 if none are."""
        return swing_period(self._acting, self.fluid, self.timeline) if self.balanced else 0.0

    def _moments(self, seam: Seam | None) -> Iterator[SimulatedFrame]:
        """The fluid at every frame; the measurements of a loop go to `seam`."""
        simulation = Simulation(self.solver, self.timeline, self.points)
        if seam is None and self._swing_period:
            arguments = self.solver, self.timeline, self._acting, self.points, self._swing_period
            return balanced_moments(*arguments)
        if seam is None:
            return simulation.moments(self._acting, self.timeline.frames - 1)
        return loop_frames(self.loop, simulation, self._acting, self._loop_frames, self.timeline.fps, seam)

    def look_up(self, picture: Picture) -> LookUp:
        """A look-up of a picture; if frames are smaller, the picture is reduced first, against aliasing."""
        width, height = self.width or self.picture.width, self.height or self.picture.height
        return LookUp(
            picture.shrunk(width, height),
            self.grid,
            self.fluid.walls,
            self.solver.device,
            width=width,
            height=height,
            filter=self.filter,
            edge=self.edge,
        )

    def frames(self) -> Run[Frame]:
        """A run of the animation from rest: an iterator of its frames, with computing times and the seam."""
        seconds, seam = RunTimes(), None if self.loop is None else Seam()
        return Run(self._frames(seconds, seam), self.frame_count, self.timeline.fps, seconds, seam)

    def _frames(self, seconds: RunTimes, seam: Seam | None) -> Iterator[Frame]:
        clock, walls = time.perf_counter, self.fluid.walls
        shown = self.look_up(self.picture)
        layers = {name: self.look_up(layer) for name, layer in self.layers.items()}
        moments = self._moments(seam)
        for index in range(self.frame_count):
            began = clock()
            moment = next(moments)
            state = moment.state
            warp = CoordinateMap.of_state(state, walls)
            quality = measure_map(state, warp)
            simulated = clock()
            still = quality.displacement_max == 0
            picture, *others = (
                look_up.untouched if still else look_up.render(state.d_x, state.d_y)
                for look_up in (shown, *layers.values())
            )
            densities = state.densities
            picture = composite_densities(picture, self.fluid.densities, densities, walls.periodic)
            seconds.simulate += simulated - began
            seconds.lookup += clock() - simulated
            yield Frame(
                index,
                index / self.timeline.fps,
                picture,
                warp,
                quality,
                moment.solve,
                dict(zip(layers, others, strict=True)),
                dict(zip(self.fluid.density_names, densities, strict=True)),
                state.points,
            )
        next(moments, None)  # a loop measures its seam after its last frame


def animate(
    picture: PictureLike,
    fluid: Fluid,
    forces: Force | Group | Sequence[Force | Group],
    duration: float,
    fps: float = FPS,
    substeps: int | None = None,
    **settings,
) -> Run[Frame]:
    """Frames of `picture` moved by `forces` for `duration` seconds, computed when they are requested.

    `picture` is anything that `Picture.of` takes, such as a path; one force needs no list.
    The frames know their rate, `fps`.

    `settings` are those of `Animation`: cells, width, height, filter, edge, device, layers, points, loop.

    Raises:
        TypeError: a value of another type; the message says what to write.
        ValueError: as `Animation`.
    """
    timeline = Timeline(duration, fps, substeps)
    return Animation(picture_of("picture", picture), fluid, flatten(forces), timeline, **settings).frames()

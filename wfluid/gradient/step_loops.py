"""The forward and backward loop over the steps of a run, captured as graphs, with the arrays they work in.

A `wp.Tape` records the stages of one step. One graph is a loop of steps; the other is a loop that plays the
tape backward. Both count their steps in device memory (`StepCounter`). Each step reads its numbers from the
counter's row of several tables (`StepTable`), and writes its results there. So the graphs are captured once,
in the time of one step, and serve runs of any length and with any numbers. Only another method of a solve
(more cycles for a larger viscosity) needs new captures.
"""

from __future__ import annotations

import warp as wp

from wfluid.fields.arrays import zeros
from wfluid.fields.graph import CapturedGraph
from wfluid.fields.state import State
from wfluid.gradient.step_tables import StepCounter, StepTable
from wfluid.kernels.adjoint import misfit
from wfluid.kernels.cell.strips import STRIP, repeat_while
from wfluid.step.forcing import Forcing
from wfluid.step.step import Step
from wfluid.step.tape import recording

WORKING_STATES = 4
"""States before and after a step, and the gradients with respect to both."""


class WorkingStates:
    """The states before and after the step that a loop is at, and the gradients with respect to them."""

    def __init__(self, step: Step, points: int):
        self._with_pressure = step.keeps_pressure
        self.before, self.after, self.bar, self.after_bar = (
            State.at_rest(step.grid, step.device, len(step.densities), points) for _ in range(WORKING_STATES)
        )
        self.before.take_gradient(self.bar)
        self.after.take_gradient(self.after_bar)
        self.end = self.before.view()
        self.end.take_gradient(self.after_bar)

    before: State
    """The state before a step. After the last step, the end of the run."""
    after: State
    """The state after a step."""
    bar: State
    """The gradient with respect to the state before a step."""
    after_bar: State
    """The gradient with respect to the state after a step."""
    end: State
    """The arrays of `before`, with `after_bar` as their gradient: objectives of the end add to it."""

    def stored(self, state: State) -> list[wp.array]:
        """The arrays of a state that are stored for every step: all but a pressure that no step reads."""
        fields = state.fields if self._with_pressure else [f for f in state.fields if f is not state.q]
        return [*fields, *state.particles]


class StepLoops:
    """The captured loops over steps, and their tables with a row for each of `rows` steps.

    With `effort` the forward loop also sums the squared velocity changes due to forces.
    """

    def __init__(
        self, step: Step, states: WorkingStates, forcing: Forcing, rows: int, of_viscosity: bool, effort: bool
    ):
        self.step, self.device, self.working, self.forcing = step, step.device, states, forcing
        self._of_viscosity = of_viscosity
        self.states = [StepTable(a, rows + 1) for a in states.stored(states.before)]
        self.numbers, self.boxes, self.bars = (
            StepTable(a, rows) for a in (forcing.numbers, forcing.boxes, forcing.bars)
        )
        self.particle_bars = [StepTable(p, rows + 1) for p in states.before.particles]
        coefficients = step.coefficients
        changes = coefficients and coefficients.changes
        self.viscosities = StepTable(coefficients.painted_mu, rows) if coefficients and changes else None
        self._row_squares = zeros(2 * step.grid.ny if effort else 0, step.device)
        self.squares = StepTable(self._row_squares, rows)
        self.pool = step.helpers(alone=True)
        self._counter, self._tape = StepCounter(step.device), wp.Tape()
        self._coefficients_graph: CapturedGraph | None = None

    states: list[StepTable]
    """The states before each step, and the last one, array by array."""
    numbers: StepTable
    """`Forcing.numbers` of each step."""
    boxes: StepTable
    """`Forcing.boxes` of each step."""
    bars: StepTable
    """`Forcing.bars` of each step, which the backward loop writes."""
    particle_bars: list[StepTable]
    """The gradients with respect to the particles' positions [cells] before each step and at the end, x and
    y, that the backward loop adds to those of the states."""
    viscosities: StepTable | None
    """The painted viscosity of each step, where it depends on time."""
    squares: StepTable
    """Sums along rows of the squared velocity changes due to forces, in each step."""
    methods: tuple = ()
    """The methods of the solves for which the loops are captured."""

    def capture(self, methods: tuple) -> None:
        """Capture both loops, unless they have been for the same methods of the solves."""
        if methods == self.methods:
            return
        self.methods = ()  # an interrupted capture must be repeated
        self.step.allow_gradients(self._of_viscosity)
        forward = CapturedGraph(self.device, self.record_forward, self.pool)
        backward = CapturedGraph(self.device, self.record_backward, self.pool)
        self._forward, self._backward, self.methods = forward, backward, methods

    def update_coefficients(self) -> None:
        """Replay `Step.update_coefficients`."""
        if self._coefficients_graph is None:
            self._coefficients_graph = CapturedGraph(self.device, self.step.update_coefficients, self.pool)
        self._coefficients_graph.launch()

    def forward(self, first: int, end: int) -> None:
        """Take the steps of the rows `first` … `end` - 1 from the state before to the end of the run."""
        self._counter.set(first, end)
        self._forward.launch()

    def backward(self, first: int, end: int) -> None:
        """Play the tape back through the steps of the rows `end` - 1 … `first`."""
        self._counter.set(end, first)
        self._backward.launch()

    def backward_step(self, row: int) -> None:
        """The same for the step of one row, launched without a graph."""
        self._counter.set(row + 1, row)
        self._step_back()

    def record_forward(self) -> None:
        """The loop of steps, with one of them recorded on the tape: launches only."""
        counter, forcing, states = self._counter, self.forcing, self.working

        def step() -> None:
            self._read_numbers()
            if _first_strip():  # the other strips launch the same
                with recording() as self._tape:
                    self.step.advance(states.before, states.after, forcing)
            else:
                self.step.advance(states.before, states.after, forcing)
            if self._row_squares.size:
                self._measure_effort()
                self.squares.give(counter, self._row_squares)
            pairs = zip(self.states, states.stored(states.after), states.stored(states.before), strict=True)
            for table, after, before in pairs:
                table.give(counter, after, ahead=1)
                table.copy(after, before)
            counter.count(1)

        repeat_while(counter.going, step)

    def record_backward(self) -> None:
        """The loop that plays the tape: launches only."""
        repeat_while(self._counter.going, self._step_back)

    def _step_back(self) -> None:
        """One step of the backward loop: launches only."""
        counter, states = self._counter, self.working
        counter.count(-1)
        self._read_numbers()
        for table, f in zip(self.states, states.stored(states.before), strict=True):
            table.take(counter, f)
        if self.step.transports_with_new_velocity:
            for table, f in zip(self.states, (states.after.u, states.after.v), strict=False):
                table.take(counter, f, ahead=1)
        for table, p_bar in zip(self.particle_bars, states.after_bar.particles, strict=True):
            table.add_to(counter, p_bar, ahead=1)
        self.step.recompute(states.before, states.after, self.forcing)
        self._tape.backward()
        self.bars.give(counter, self.forcing.bars)
        pairs = zip(self.states, states.stored(states.bar), states.stored(states.after_bar), strict=True)
        for table, bar, after_bar in pairs:
            table.copy(bar, after_bar)

    def _read_numbers(self) -> None:
        """Read the forcing of the counter's step, and its viscosity where that changes: launches only."""
        self.numbers.take(self._counter, self.forcing.numbers)
        self.boxes.take(self._counter, self.forcing.boxes)
        coefficients = self.step.coefficients
        if not self.viscosities or not coefficients:
            return
        self.viscosities.take(self._counter, coefficients.painted_mu)
        coefficients.fill_painted()
        if not self.step.fluid.viscosity_moves:  # else the step itself updates them
            self.step.update_coefficients()

    def _measure_effort(self) -> None:
        """Sum along rows the squared velocity changes due to forces: launches only."""
        state, layout = self.working.before, self.step.layout
        pushed = self.step.pushed if self.forcing.adds_velocity else (state.u, state.v)
        for n, (after, before) in enumerate(zip(pushed, (state.u, state.v), strict=True)):
            inputs = [after, before, layout.nx, layout.pitch, n * layout.ny]
            misfit.row_squares.launch(layout.ny, self.device, inputs, [self._row_squares])


def _first_strip() -> bool:
    """Whether the first strip, or the only one, is being captured."""
    strip = STRIP.get()
    return strip is None or strip.index == 0

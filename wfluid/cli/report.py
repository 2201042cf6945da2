"""The report of a run: one JSON object with settings, times and the extremes over all frames."""

from __future__ import annotations

import json
import math
import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from wfluid.animation.animation import Animation
from wfluid.animation.frame import Frame
from wfluid.animation.loops import Seam
from wfluid.cli.folds import Folds
from wfluid.cli.smoothness import Smoothness
from wfluid.domain.walls import Walls
from wfluid.keyframes.match import Match
from wfluid.model.force import Force, flatten
from wfluid.model.painted import Keyed, Painted
from wfluid.morphing.frame import MorphFrame
from wfluid.morphing.morph import Morph
from wfluid.solve.system import Residual
from wfluid.system.atomic import atomic_write_text


@dataclass
class Report:
    """Measures of a run, collected frame by frame."""

    animation: Animation
    """The animation that runs."""
    match: Match | None = None
    """The result of the search for its keyframes."""
    side: float = 1.0
    """The longer side in the scene's pixels."""
    morph: Morph | None = None
    """The morph, whose flow the animation is."""
    arrow: float | None = None
    """The longest arrow [longer side]; None if not everything that moves has one."""
    frames: int = 0
    """Frames so far."""
    extremes: dict[str, float] = field(
        default_factory=lambda: {
            "divergence_max": 0.0,
            "jacobian_min": math.inf,
            "jacobian_max": -math.inf,
            "displacement_max_px": 0.0,
            "displacement_mean_px": 0.0,
            "outside_fraction": 0.0,
            "divergence_prescribed_max": 0.0,
            "divergence_removed_max": 0.0,
            "diffusion_loss_px": 0.0,
        }
    )
    """Over all frames; the mean displacement is that of the frame where it is largest."""
    folds: Folds = field(default_factory=Folds)
    """The frames that fold."""
    smoothness: Smoothness = field(init=False)
    """Displacement and strain."""
    solves: dict[str, dict[str, Any]] = field(default_factory=dict)
    """Methods, most iterations and largest residuals of projection and diffusion."""
    of_b: list[float] = field(default_factory=lambda: [math.inf, -math.inf])
    """Smallest and largest det J of the map into a morph's second picture."""

    def __post_init__(self) -> None:
        picture = self.animation.picture
        self.smoothness = Smoothness(max(picture.width, picture.height), self.arrow)

    def add(self, frame: Frame) -> None:
        """Add the measures of a frame."""
        side = max(self.animation.picture.width, self.animation.picture.height)
        seen, quality = self.extremes, frame.quality
        self.frames += 1
        self.folds.add(frame)
        self.smoothness.add(frame)
        seen["jacobian_min"] = min(seen["jacobian_min"], quality.jacobian_min)
        seen["jacobian_max"] = max(seen["jacobian_max"], quality.jacobian_max)
        for name, value in (
            ("displacement_max_px", quality.displacement_max * side),
            ("displacement_mean_px", quality.displacement_mean * side),
            ("outside_fraction", quality.outside_fraction),
            ("divergence_max", frame.solve.divergence if frame.solve else 0.0),
            ("divergence_prescribed_max", frame.solve.prescribed if frame.solve else 0.0),
            ("divergence_removed_max", abs(frame.solve.removed) if frame.solve else 0.0),
            ("diffusion_loss_px", frame.solve.map_loss * side if frame.solve else 0.0),
        ):
            seen[name] = max(seen[name], value)
        if isinstance(frame, MorphFrame) and frame.to_quality:
            self.of_b[0] = min(self.of_b[0], frame.to_quality.jacobian_min)
            self.of_b[1] = max(self.of_b[1], frame.to_quality.jacobian_max)
        if frame.solve:
            self._add_solve("projection", frame.solve.pressure)
            self._add_solve("diffusion", frame.solve.diffusion)

    def _add_solve(self, name: str, left: Residual) -> None:
        blank = {"methods": [], "iterations_max": 0, "residual_max": 0.0, "backward_error_max": 0.0}
        seen = self.solves.setdefault(name, blank)
        if left.method not in seen["methods"]:
            seen["methods"].append(left.method)
        for key, value in (
            ("iterations_max", left.iterations),
            ("residual_max", left.relative),
            ("backward_error_max", left.backward),
        ):
            seen[key] = max(seen[key], value)

    @property
    def _steps(self) -> int:
        timeline = self.animation.timeline
        return timeline.steps if self.morph else max(self.frames - 1, 0) * timeline.steps_per_frame

    def _loop(self, seam: Seam | None) -> dict[str, Any]:
        """The measurements of a loop's seam."""
        animation = self.animation
        if seam is None:
            return {}
        side = max(animation.picture.width, animation.picture.height)
        a_frame = side / animation.timeline.fps
        return {
            "loop": {
                "kind": animation.loop,
                "position_gap_px": {"max": seam.position_max * side, "mean": seam.position_mean * side},
                "velocity_gap_px_per_frame": {
                    "max": seam.velocity_max * a_frame,
                    "mean": seam.velocity_mean * a_frame,
                },
                "drift_removed_px": {"max": seam.drift_max * side, "mean": seam.drift_mean * side},
            }
        }

    def _keyframes(self) -> dict[str, Any]:
        """The result of the search; a residual is the larger of the particle's and the map's."""
        match, side = self.match, self.side
        if match is None:
            return {}
        residuals = [arrival.residual * side for arrival in match.arrivals]
        return {
            "keyframes": [
                {
                    "from": [value * side for value in arrival.keyframe.point],
                    "to": [value * side for value in arrival.keyframe.destination],
                    "time": arrival.keyframe.time,
                    "pinned": arrival.pinned,
                    "residual_px": residual,
                    "reason": arrival.reason,
                }
                for arrival, residual in zip(match.arrivals, residuals, strict=True)
            ],
            "residual_px": residuals,
            "residual_max_px": max(residuals),
            "tolerance_px": match.tolerance * side,
            "status": match.status,
            "iterations": match.iterations,
            "evaluations": match.evaluations,
            "history": [
                {
                    "stage": at.stage,
                    "evaluations": at.evaluations,
                    "objective": at.value,
                    "worst_px": at.worst * side,
                }
                for at in match.history
            ],
            "search_seconds": match.seconds,
        }

    def _morph(self) -> dict[str, Any]:
        """The measures of a morph."""
        morph = self.morph
        if morph is None:
            return {}
        mean, most = morph.inconsistency_px()
        residuals = [float(value) for value in morph.residuals_of_b()]
        window, settings = morph.pair.window, morph.settings
        return {
            "morph": {
                "to": list(morph.pair.size),
                "window": [window.x, window.y, window.width, window.height],
                "residual_px": {
                    "first": [arrival.residual * self.side for arrival in morph.match.arrivals],
                    "second": residuals,
                },
                "residual_max_px": {
                    "first": morph.match.residual * self.side,
                    "second": max(residuals),
                },
                "jacobian": {
                    "first": [self.extremes["jacobian_min"], self.extremes["jacobian_max"]],
                    "second": self.of_b,
                },
                "inconsistency_px": {"mean": mean, "max": most},
                "blend": settings.blend,
                "notes": [*morph.pair.notes, *morph.notes],
            }
        }

    def as_dict(self, seconds: Mapping[str, float], seam: Seam | None = None) -> dict[str, Any]:
        """The report; `seconds` are the times of the command [s], `seam` is that of a loop."""
        animation, fluid = self.animation, self.animation.fluid
        walls = Walls.parse(fluid.walls)
        return {
            "picture": [animation.picture.width, animation.picture.height],
            "grid": [animation.grid.nx, animation.grid.ny],
            "frames": self.frames,
            "fps": (self.morph.settings if self.morph else animation).timeline.fps,
            "steps": self._steps,
            "settings": {
                "viscosity": _described(fluid.viscosity),
                "viscosity_moves": fluid.viscosity_moves,
                "freeze": fluid.freeze.strength if fluid.freeze else None,
                "walls": [walls.x.value, walls.y.value],
                "scheme": fluid.scheme,
                "solver": fluid.solver,
                "substeps": animation.timeline.steps_per_frame,
                "filter": animation.filter,
                "edge": animation.edge,
                "loop": animation.loop,
                "forces": [_kind(force) for force in flatten(animation.forces)],
                "densities": list(fluid.density_names),
                "layers": list(animation.layers),
            },
            "seconds": dict(seconds),
            **self.extremes,
            "smoothness": self.smoothness.as_dict(),
            "folds": self.folds.as_dict(),
            "area": _area(self.extremes),
            **self._loop(seam),
            **self._keyframes(),
            **self._morph(),
            "solves": self.solves,
            "device": str(animation.solver.device.name),
            "versions": versions(),
        }


def _area(extremes: Mapping[str, float]) -> str:
    """Whether the flow should preserve areas; the range of det J shows how well it does."""
    if extremes["divergence_prescribed_max"] > 0:
        return "not preserved: some forces grow or shrink parts of the picture"
    return "preserved, up to the errors that det J shows"


def _described(viscosity: object) -> float | list[float] | str:
    """A number; the smallest and largest value of a picture; or a word for another kind."""
    if isinstance(viscosity, Painted):
        return [float(viscosity.values.min()), float(viscosity.values.max())]
    if isinstance(viscosity, float):
        return viscosity
    return "keyed" if isinstance(viscosity, Keyed) else "of time"


def _kind(force: Force) -> str:
    return type(force).__name__ + (" under a mask" if force.weight is not None else "")


def versions() -> dict[str, str]:
    """Versions of wfluid and of the libraries that its results depend on."""
    import numpy
    import OpenImageIO
    import warp

    from wfluid import __version__

    return {
        "wfluid": __version__,
        "warp": warp.__version__,
        "OpenImageIO": OpenImageIO.__version__,
        "numpy": numpy.__version__,
    }


def write_report(path: str | os.PathLike, report: Mapping[str, Any]) -> None:
    """Write a report as JSON; on an error no file is left behind.

    Raises:
        FileError: a name that cannot be written to.
        WriteError: the file cannot be written to its end, as on a full disk.
    """
    atomic_write_text(Path(path), json.dumps(report, indent=2) + "\n")

"""What makes a motion gentler, in the options of the command in use."""

from __future__ import annotations

from wfluid.domain.limits import (
    CELLS_LIMIT,
    MORPH_VISCOSITY,
    PAINTED_VISCOSITY,
    SUBSTEPS_LIMIT,
    VISCOSITY,
    VISCOSITY_LIMIT,
)
from wfluid.scene.scene import Scene
from wfluid.staging.build import Staged, StagedKeyframes, StagedMorph

COMMAND_LINE = "command line"
"""Source of a scene that is made from flags."""


def option(scene: Scene, flag: str, key: str, value: float | str) -> str:
    """The option that sets a key: its flag, or --set where the scene is a file."""
    shown = value if isinstance(value, str) else f"{value:.3g}"
    return f"{flag} {shown}" if scene.source == COMMAND_LINE else f"--set {key}={shown}"


def gentler(scene: Scene, staged: Staged) -> str:
    """How to make a scene's motion gentler."""
    if isinstance(staged, StagedKeyframes):
        time = "" if isinstance(staged, StagedMorph) else "later arrival times, "
        return f"{_stiffer(scene, staged)}, {time}or fewer points whose paths pass close to each other"
    looped = option(scene, "--loop", "time.loop", "oscillate")
    swings = any(getattr(force, "period", None) for force in scene.forces) and scene.time.loop is None
    loop = f"{looped}, which keeps swings about their place, " if swings else ""
    return f"{loop}{_stiffer(scene, staged)}, or a force that is weaker, wider or acts longer"


def finer(scene: Scene, staged: Staged) -> str:
    """How to compute a scene on a finer grid, with shorter steps where they are free."""
    timeline = staged.animation.timeline
    options = [option(scene, "--cells", "fluid.cells", min(CELLS_LIMIT, 2 * scene.fluid.cells))]
    if not isinstance(staged, StagedMorph):
        steps = min(SUBSTEPS_LIMIT, 2 * timeline.steps_per_frame)
        options.append(option(scene, "--substeps", "time.substeps", steps))
    return f"a finer computation ({' '.join(options)})"


def _stiffer(scene: Scene, staged: Staged) -> str:
    """More viscosity: four times the scene's."""
    viscosity = scene.viscosity
    if viscosity.keys:
        return "more viscosity"
    value = viscosity.value
    if value is None:
        plain = MORPH_VISCOSITY if isinstance(staged, StagedMorph) else VISCOSITY
        value = PAINTED_VISCOSITY if viscosity.image else plain
    more = min(VISCOSITY_LIMIT, 4 * value or VISCOSITY)
    return f"more viscosity ({option(scene, '--viscosity', 'viscosity.value', more)})"

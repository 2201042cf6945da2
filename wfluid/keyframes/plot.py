"""A figure of a match: arrows over the picture, the deformed grid, and the progress of the search.

`plot_match(match, "match.png")` writes the figure of a result of `match_keyframes`. The first panel follows
Bonilla & Velho, figure 3: sources, targets and final positions of points.
"""

from __future__ import annotations

import io
import os
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from itertools import groupby, pairwise
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from wfluid.animation.animation import Animation
from wfluid.animation.frame import Frame
from wfluid.domain.paths import Place
from wfluid.files.names import check_folder
from wfluid.keyframes.arrival import Arrival
from wfluid.keyframes.match import Match
from wfluid.keyframes.search import COARSE, FINE, MARCH, SPLINE
from wfluid.pictures.fitting import display_rgb
from wfluid.pictures.picture import Picture
from wfluid.system.atomic import atomic_write
from wfluid.system.errors import FileError

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

ENDINGS = (".png", ".pdf", ".svg")
"""File formats of figures, by the ending of the name."""

LINES = 24
"""Number of grid lines along the longer side."""

_DPI = 140
_SHOWN = 1200  # longest side of a picture in a figure [px]: more than a panel has
_SAMPLES = 12  # samples of the map between two lines of the grid

_PANEL, _NARROWEST, _LOWEST, _CURVES = 4.3, 3.5, 2.75, 3.3  # widths and heights of panels [inch]
_LEFT, _GAP, _RIGHT, _TOP, _BOTTOM = 0.55, 0.55, 0.7, 0.62, 0.95  # around them [inch]

_INK, _GREY, _MISFIT, _OBJECTIVE = "#1a1a1a", "#666666", "#0050c8", "#c05000"
_ARROW, _TRACK, _REACHED, _PIN = "#ffb000", "#00b4ff", "#0050c8", "#ff2d78"
_TINTS = {SPLINE: "#dff0e4", MARCH: "#e4e9f0", COARSE: "#e6dcf3", FINE: "#dff0e4"}

_STYLE = {
    "font.family": "DejaVu Sans",
    "font.size": 8.5,
    "axes.edgecolor": "#999999",
    "axes.linewidth": 0.7,
    "axes.labelcolor": _INK,
    "axes.titlesize": 10.5,
    "axes.titleweight": "bold",
    "axes.titlelocation": "left",
    "xtick.color": _GREY,
    "ytick.color": _GREY,
    "legend.frameon": False,
    "svg.hashsalt": "wfluid",  # the same figure has the same bits
}

_UNDATED = {".png": {}, ".pdf": {"CreationDate": None}, ".svg": {"Date": None}}


def check_plot(path: str | os.PathLike) -> Path:
    """Check before a long search that a figure can be written to a path; returns the path.

    Raises:
        ValueError: matplotlib is not installed.
        FileError: an unknown ending, or a folder that does not exist or cannot be written.
    """
    path = Path(path)
    if path.suffix.lower() not in ENDINGS:
        raise FileError(f"{path}: plots are written as {', '.join(ENDINGS)}")
    check_folder(path)
    try:
        import matplotlib  # noqa: F401
    except ImportError:
        raise ValueError(
            f"{path}: plots need matplotlib; install it in the clone of wfluid: pip install -e '.[plot]'"
        ) from None
    return path


def plot_match(match: Match, path: str | os.PathLike) -> None:
    """Write a figure of a match as PNG, PDF or SVG, completely or not at all.

    The panels show the untouched picture with points, arrows, trajectories and pins; the last frame, for
    which the animation is run, with the deformed grid; and the progress of the search. Lengths are in pixels
    of the animation's picture.

    Raises:
        ValueError: matplotlib is not installed.
        FileError: an unknown ending, or a name that cannot be written to.
        WriteError: the file cannot be written to its end, as on a full disk.
    """
    path = check_plot(path)
    ending = path.suffix.lower()
    with _styled():
        figure = figure_of(match)
        drawn = io.BytesIO()
        figure.savefig(drawn, format=ending[1:], dpi=_DPI, metadata=_UNDATED[ending])
    atomic_write(path, drawn.getbuffer())


def figure_of(match: Match) -> Figure:
    """The figure that `plot_match` writes; its artists have names (`get_gid`)."""
    from matplotlib.figure import Figure

    picture = match.animation.picture
    width, height = _panel(picture)
    total = _LEFT + 2 * width + _CURVES + 2.5 * _GAP + _RIGHT, _BOTTOM + height + _TOP
    figure = Figure(figsize=total, facecolor="white")

    def panel(left: float, wide: float) -> Axes:
        return figure.add_axes((left / total[0], _BOTTOM / total[1], wide / total[0], height / total[1]))

    with _styled():
        _draw_points(panel(_LEFT, width), match)
        _draw_grid(panel(_LEFT + width + _GAP, width), match, _last_frame(match.animation))
        _draw_history(panel(_LEFT + 2 * width + 2.5 * _GAP, _CURVES), match)
    return figure


@contextmanager
def _styled() -> Iterator[None]:
    """Use matplotlib's defaults and `_STYLE` instead of the user's settings."""
    from matplotlib import style

    with style.context(_STYLE, after_reset=True):
        yield


def _panel(picture: Picture) -> tuple[float, float]:
    """Width and height of a panel with the picture [inch]; a very long picture does not fill its panel."""
    aspect = picture.width / picture.height
    height = max(_PANEL / max(aspect, 1.0), _LOWEST)
    return max(min(height * aspect, _PANEL), _NARROWEST), height


def _side(match: Match) -> int:
    """The longer side [px]."""
    return max(match.animation.picture.width, match.animation.picture.height)


def _small(picture: Picture) -> tuple[int, int]:
    """Width and height at which a picture is drawn [px]."""
    factor = min(1.0, _SHOWN / max(picture.width, picture.height))
    return max(1, round(factor * picture.width)), max(1, round(factor * picture.height))


def _last_frame(animation: Animation) -> Frame:
    width, height = _small(animation.picture)
    *_, last = replace(animation, width=width, height=height, layers={}).frames()
    return last


def _show(axes: Axes, shown: Picture, extent: tuple[int, int], light: float) -> None:
    """Draw a picture on axes in the pixels of `extent`, covered by white of opacity `light`."""
    width, height = extent
    whole = replace(shown, metadata=None)  # not its display window alone
    colours = display_rgb(whole.shrunk(*_small(shown))) / 255
    colours = colours + light * (1 - colours)
    axes.imshow(colours, extent=(0, width, height, 0), interpolation="antialiased")
    axes.set(xlim=(0, width), ylim=(height, 0), aspect="equal", anchor="NW")
    axes.tick_params(length=2.5, width=0.7)


def _draw_points(axes: Axes, match: Match) -> None:
    """Draw points, arrows from keyframe to keyframe, trajectories, and positions reached."""
    from matplotlib.lines import Line2D
    from matplotlib.patheffects import withStroke

    picture, side = match.animation.picture, _side(match)
    _show(axes, picture, (picture.width, picture.height), 0.0)
    worst = f"worst misfit {side * match.residual:.2g} px, {side * match.tolerance:.2g} allowed"
    _title(axes, "Keyframes and trajectories", f"{match.status}: {worst}")
    points = [list(own) for _, own in groupby(match.arrivals, key=lambda arrival: arrival.keyframe.point)]
    moved = [own for own in points if not own[0].pinned]
    size = float(np.clip(np.sqrt(12 / len(points)), 0.5, 1.0))
    halo = [withStroke(linewidth=size * 3.2, foreground=_INK, alpha=0.6)]

    for n, places in enumerate(np.moveaxis(side * match.tracks, 1, 0)):
        axes.plot(
            *places.T,
            color=_TRACK,
            linewidth=2.0 * size,
            path_effects=halo,
            zorder=2.5,
            gid=f"trajectory-{n}",
        )
    arrow = {
        "arrowstyle": "-|>,head_length=0.5,head_width=0.25",
        "mutation_scale": 12 * size,
        "shrinkA": 0,
        "shrinkB": 0,
        "color": _ARROW,
        "linewidth": 1.1 * size,
        "path_effects": halo,
    }
    for n, (start, stop) in enumerate(_legs(moved)):
        tail, tip = (tuple(side * value for value in place) for place in (start, stop))
        axes.annotate("", tip, tail, arrowprops=arrow, annotation_clip=False, zorder=2.8).set_gid(
            f"arrow-{n}"
        )

    def mark(name: str, places: Sequence[Place], marker: str, width: float, **look) -> None:
        if places:
            x, y = side * np.array(places).T
            look = {"markersize": width * size, "markeredgewidth": 1.1 * size, **look}
            axes.plot(x, y, marker, label=name, gid=name, clip_on=False, zorder=3, **look)

    keyed = [arrival for own in moved for arrival in own]
    end = match.animation.timeline.end
    gone = [n for n, own in enumerate(moved) if own[-1].keyframe.time < end * (1 - 1e-6)]
    mark("source", [own[0].keyframe.point for own in moved], "o", 6, mfc="white", mec=_INK)
    aims = [arrival.keyframe.destination for arrival in keyed]
    mark("_outline", aims, "o", 9, mfc="none", mec=_INK, markeredgewidth=3.4 * size)
    mark("keyframe", aims, "o", 9, mfc="none", mec=_ARROW, markeredgewidth=1.8 * size)
    mark("reached", [arrival.particle for arrival in keyed], "o", 4, mfc=_REACHED, mec="white")
    mark("at the end", [tuple(match.tracks[-1, n]) for n in gone], "D", 4.5, mfc=_TRACK, mec=_INK)
    mark("pin", [own[0].keyframe.point for own in points if own[0].pinned], "s", 6.5, mfc=_PIN, mec="white")
    if len({arrival.keyframe.time for arrival in keyed}) > 1:
        for arrival in keyed:
            x, y = (side * value for value in arrival.keyframe.destination)
            axes.annotate(
                f"{arrival.keyframe.time:.3g} s",
                (x, y),
                (6, -3),
                textcoords="offset points",
                va="top",
                fontsize=8 * size,
                color="white",
                zorder=5,
                path_effects=[withStroke(linewidth=2, foreground=_INK, alpha=0.7)],
            )
    handles, _ = axes.get_legend_handles_labels()
    handles.insert(
        1, Line2D([], [], ls="none", marker="$\u2192$", markersize=13, color=_ARROW, label="arrow")
    )
    handles.append(Line2D([], [], color=_TRACK, linewidth=1.5, path_effects=halo, label="trajectory"))
    _legend(axes, handles, 0.27)


def _legs(moved: Sequence[Sequence[Arrival]]) -> Iterator[tuple[Place, Place]]:
    """Start and end of each arrow: from a point to its first keyframe, and from each to the next."""
    for own in moved:
        stops = [own[0].keyframe.point, *(arrival.keyframe.destination for arrival in own)]
        yield from (leg for leg in pairwise(stops) if leg[0] != leg[1])


def _draw_grid(axes: Axes, match: Match, frame: Frame) -> None:
    """Draw the last frame with the deformed grid: contour lines of the coordinates of the backward map."""
    picture, side = match.animation.picture, _side(match)
    _show(axes, frame.picture, (picture.width, picture.height), 0.25)
    least, greatest = match.jacobian
    lines = f"lines every {side / LINES:.3g} px; det J {least:.2f} … {greatest:.2f} in all frames"
    _title(axes, f"Deformed grid at {frame.time:.3g} s", lines)
    warp = frame.map
    extent = np.array([warp.grid.width, warp.grid.height])
    counts = np.maximum(2, np.ceil(extent * LINES * _SAMPLES)).astype(int) + 1
    places = np.meshgrid(*(np.linspace(0, size, count) for size, count in zip(extent, counts, strict=True)))
    sources = warp.source_at(np.stack(places, axis=-1).reshape(-1, 2)).reshape(*places[0].shape, 2)
    for n, (name, periodic) in enumerate(zip("xy", warp.walls.periodic, strict=True)):
        values = LINES * sources[..., n]
        levels = np.arange(np.floor(values.min()), np.ceil(values.max()) + 1)
        if not periodic:  # the walls themselves are lines, of which contours would find crumbs
            levels = levels[(levels > 0.01) & (levels < LINES * extent[n] - 0.01)]
        if not len(levels):
            continue  # the picture is narrower than a line's distance
        x, y = (side * place for place in places)
        for colour, wide, alpha in ((_INK, 1.5, 0.35), ("white", 0.65, 1.0)):
            drawn = axes.contour(x, y, values, levels, colors=colour, linewidths=wide, alpha=alpha)
            drawn.set_gid(f"lines-{name}-{colour}")


def _draw_history(axes: Axes, match: Match) -> None:
    """Draw the longest misfit and the objective by iteration, with the stages as tinted bands."""
    from matplotlib.ticker import FuncFormatter, MaxNLocator, NullFormatter

    history, side = match.history, _side(match)
    seconds = match.seconds["total"]
    _title(
        axes, "Convergence", f"{match.iterations} iterations, {match.evaluations} gradients, {seconds:.3g} s"
    )
    axes.set_xlabel("iteration")
    axes.set_ylabel("worst misfit [px]", color=_MISFIT)
    other = axes.twinx()
    other.set_ylabel("objective", color=_OBJECTIVE)
    if not history:
        axes.text(0.5, 0.5, "nothing was left to find", transform=axes.transAxes, ha="center", color=_GREY)
        for one in (axes, other):
            one.set(xticks=[], yticks=[])
        return
    at, allowed = np.array([progress.iteration for progress in history]), side * match.tolerance
    for one, name, values, level, colour in (
        (other, "objective", [progress.value for progress in history], np.nan, _OBJECTIVE),
        (axes, "worst misfit", [side * progress.worst for progress in history], allowed, _MISFIT),
    ):
        values = np.array(values, dtype=float)
        values[~np.isfinite(values) | (values <= 0)] = np.nan  # no keyframe in the stage's time
        one.plot(at, values, "-o", color=colour, linewidth=1.3, markersize=1.8, gid=name)
        one.set_yscale("log")
        one.set_ylim(*_decades(np.append(values, level)))
        one.yaxis.set_minor_formatter(NullFormatter())
        one.tick_params(axis="y", which="both", colors=colour, length=2.5)
    line = axes.axhline(allowed, color=_MISFIT, linewidth=0.9, linestyle=(0, (4, 3)), gid="tolerance")
    axes.set(xlim=(at[0] - 0.5, at[-1] + 0.5))
    axes.xaxis.set_major_locator(MaxNLocator(7, integer=True))
    axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axes.set_zorder(other.get_zorder() + 1)
    axes.patch.set_visible(False)
    tints = {}
    for stage, entries in groupby(history, key=lambda progress: progress.stage):
        own = [progress.iteration for progress in entries]
        tints[stage] = other.axvspan(own[0] - 0.5, own[-1] + 0.5, color=_TINTS[stage], linewidth=0, zorder=-1)
        tints[stage].set(gid=f"{stage}-{own[0]}", label=stage)
    line.set_label("allowed")
    _legend(axes, [*tints.values(), line], 0.52)


def _decades(values: np.ndarray) -> tuple[float, float]:
    """Limits of a logarithmic axis that contain at least two powers of ten."""
    known = values[np.isfinite(values)]
    least, greatest = (known.min(), known.max()) if len(known) else (1.0, 1.0)
    room = max(1.4, np.sqrt(100 * least / greatest))
    return least / room, greatest * room


def _title(axes: Axes, title: str, subtitle: str) -> None:
    axes.set_title(title, pad=19)
    axes.annotate(subtitle, (0, 1), (0, 6), xycoords="axes fraction", textcoords="offset points", color=_GREY)


def _legend(axes: Axes, handles: Sequence[Artist], below: float) -> None:
    """Draw a legend at a distance below a panel [inch]."""
    from matplotlib.transforms import ScaledTranslation

    axes.legend(
        handles=handles,
        loc="upper left",
        bbox_to_anchor=(0, 0),
        bbox_transform=axes.transAxes + ScaledTranslation(-0.07, -below, axes.figure.dpi_scale_trans),
        ncols=len(handles) if len(handles) <= 4 else 3,
        borderaxespad=0,
        borderpad=0,
        handletextpad=0.6,
        columnspacing=1.6,
    )

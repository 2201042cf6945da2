"""The figure of a match: marks at their places in the picture's pixels, and complete files."""

import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest

from wfluid.animation.animation import Animation
from wfluid.domain.timeline import Timeline
from wfluid.keyframes.keyframes import ParticleKeyframe
from wfluid.keyframes.match import match_keyframes
from wfluid.keyframes.plot import LINES, check_plot, figure_of, plot_match
from wfluid.keyframes.search import COARSE, FINE, MARCH, Progress
from wfluid.model.fluid import Fluid
from wfluid.pictures.picture import Picture
from wfluid.system.errors import FileError

WIDTH, HEIGHT = 64, 48

NOSE, EAR, PIN = (20.0, 24.0), (40.0, 30.0), (52.0, 10.0)
"""Points [px]; the nose has two keyframes, the ear one before the end."""

NOSE_WAY, EAR_AIM = ((22.0, 23.0), (24.0, 21.0)), (38.0, 31.5)


def longer_sides(place):
    return place[0] / WIDTH, place[1] / WIDTH


@pytest.fixture(scope="module")
def match():
    pixels = np.random.default_rng(5).random((HEIGHT, WIDTH, 3), dtype=np.float32)
    timeline = Timeline(0.25, fps=24, substeps=2)
    animation = Animation(Picture(pixels), Fluid(viscosity=0.005), [], timeline, cells=32)
    keyframes = [
        ParticleKeyframe(longer_sides(NOSE), longer_sides(NOSE_WAY[0]), 0.125),
        ParticleKeyframe(longer_sides(EAR), longer_sides(EAR_AIM), 0.125),
        ParticleKeyframe(longer_sides(NOSE), longer_sides(NOSE_WAY[1]), 0.25),
    ]
    return match_keyframes(animation, keyframes, pins=[longer_sides(PIN)], tolerance=0.5 / WIDTH)


@pytest.fixture(scope="module")
def figure(match):
    pytest.importorskip("matplotlib")
    return figure_of(match)


def named(figure, name):
    """The artists with a name, or with a prefix if the name ends in a dash."""

    def is_it(artist):
        own = artist.get_gid() or ""
        return own == name or (name.endswith("-") and own.startswith(name))

    return sorted(figure.findobj(is_it), key=lambda artist: artist.get_gid())


def points_of(figure, name):
    (line,) = named(figure, name)
    return line.get_xydata()


def test_arrows_lead_from_sources_by_keyframes_to_keyframes(figure):
    arrows = [(*arrow.xyann, *arrow.xy) for arrow in named(figure, "arrow-")]
    expected = [(*NOSE, *NOSE_WAY[0]), (*NOSE_WAY[0], *NOSE_WAY[1]), (*EAR, *EAR_AIM)]
    np.testing.assert_allclose(arrows, expected, atol=1e-9)
    for arrow in named(figure, "arrow-"):
        assert arrow.arrowprops["shrinkA"] == arrow.arrowprops["shrinkB"] == 0


def test_marks_are_at_their_places_in_pixels(figure, match):
    np.testing.assert_allclose(points_of(figure, "source"), [NOSE, EAR], atol=1e-9)
    np.testing.assert_allclose(points_of(figure, "keyframe"), [*NOSE_WAY, EAR_AIM], atol=1e-9)
    np.testing.assert_allclose(points_of(figure, "pin"), [PIN], atol=1e-9)
    moved = [arrival for arrival in match.arrivals if not arrival.pinned]
    came = [np.multiply(arrival.particle, WIDTH) for arrival in moved]
    np.testing.assert_allclose(points_of(figure, "reached"), came, atol=1e-9)
    np.testing.assert_allclose(points_of(figure, "reached"), [*NOSE_WAY, EAR_AIM], atol=0.5)


def test_a_point_that_moves_after_its_keyframe_has_a_mark_at_the_end(figure, match):
    np.testing.assert_allclose(points_of(figure, "at the end"), [match.tracks[-1, 1] * WIDTH], atol=1e-9)


def test_trajectories_begin_at_the_points_and_pass_their_positions(figure, match):
    lines = [line.get_xydata() for line in named(figure, "trajectory-")]
    np.testing.assert_allclose([line[0] for line in lines], [NOSE, EAR, PIN], atol=1e-4)
    np.testing.assert_allclose([line[-1] for line in lines], match.tracks[-1] * WIDTH, atol=1e-9)
    reached = points_of(figure, "reached")
    assert len(lines[0]) == 13
    np.testing.assert_allclose([lines[0][6], lines[0][12], lines[1][6]], reached, atol=1e-4)


def test_times_are_named_where_there_are_several(figure, match):
    texts = [text.get_text() for text in figure.axes[0].texts]
    assert sorted(text for text in texts if text.endswith(" s")) == ["0.125 s", "0.125 s", "0.25 s"]
    single = replace(match, arrivals=tuple(one for one in match.arrivals if one.keyframe.time == 0.25))
    assert not [text for text in figure_of(single).axes[0].texts if text.get_text().endswith(" s")]


def test_the_legend_names_the_marks_drawn(figure, match):
    names = ["source", "arrow", "keyframe", "reached", "at the end", "pin", "trajectory"]
    assert [text.get_text() for text in figure.axes[0].get_legend().get_texts()] == names
    unpinned = replace(match, arrivals=tuple(one for one in match.arrivals if not one.pinned))
    legend = figure_of(unpinned).axes[0].get_legend()
    assert "pin" not in [text.get_text() for text in legend.get_texts()]


def test_pictures_are_shown_upright_in_their_pixels(figure, match):
    *_, last = match.animation.frames()
    for axes, shown in zip(figure.axes, (match.animation.picture, last.picture), strict=False):
        (image,) = axes.get_images()
        assert tuple(image.get_extent()) == (0, WIDTH, HEIGHT, 0)
        assert axes.get_xlim() == (0, WIDTH) and axes.get_ylim() == (HEIGHT, 0)
        assert axes.get_aspect() == 1
        colours, light = np.asarray(image.get_array())[..., :3], shown.pixels[..., :3].clip(0, 1)
        order = np.corrcoef(colours.ravel(), light.ravel())[0, 1]
        assert order > 0.95, f"the shown picture is another: correlation {order:.3f}"


def test_grid_lines_follow_the_map(figure, match):
    """Along a grid line one coordinate of the source is constant, a multiple of the spacing."""
    *_, last = match.animation.frames()
    side = max(WIDTH, HEIGHT)
    for n, (name, size) in enumerate((("x", WIDTH), ("y", HEIGHT))):
        (lines,) = named(figure, f"lines-{name}-white")
        paths = [path.vertices for path in lines.get_paths() if len(path.vertices)]
        assert len(paths) == size * LINES // side - 1
        for number, path in enumerate(paths, start=1):
            sources = last.map.source_at(path / side)[:, n] * side
            np.testing.assert_allclose(sources, number * side / LINES, atol=0.05)
        bent = max(np.ptp(path[:, n]) for path in paths)
        assert bent > 1, f"no line is bent by more than {bent:.2g} px"


def test_the_curves_are_the_history_of_the_search(figure, match):
    history = match.history
    misfits = [one.worst * WIDTH if one.worst > 0 else np.nan for one in history]
    at = [one.iteration for one in history]
    np.testing.assert_allclose(points_of(figure, "worst misfit"), np.stack([at, misfits], axis=1))
    values = [one.value for one in history]
    np.testing.assert_allclose(points_of(figure, "objective"), np.stack([at, values], axis=1))
    assert [axes.get_yscale() for axes in figure.axes[2:]] == ["log", "log"]
    np.testing.assert_allclose(points_of(figure, "tolerance")[:, 1], 0.5)


def test_stages_are_tinted_over_their_iterations(match):
    pytest.importorskip("matplotlib")
    stages = [MARCH, MARCH, COARSE, FINE, FINE, FINE, COARSE]
    history = tuple(Progress(stage, n + 1, n + 1, 1e-3, 20.0 + n) for n, stage in enumerate(stages))
    figure = figure_of(replace(match, history=history))
    spans = {}
    for stage in (MARCH, COARSE, FINE):
        for span in named(figure, f"{stage}-"):
            edges = span.get_window_extent()
            to_data = span.axes.transData.inverted()
            left, right = (to_data.transform((x, 0))[0] for x in (edges.x0, edges.x1))
            spans[span.get_gid()] = round(left, 3), round(right, 3)
    assert spans == {
        "march-1": (0.5, 2.5),
        "coarse-3": (2.5, 3.5),
        "fine-4": (3.5, 6.5),
        "coarse-7": (6.5, 7.5),
    }
    least, greatest = figure.axes[2].get_ylim()
    assert least < 0.5 and greatest > 20.0 * 1.3, "the tolerance or the misfit is out of sight"
    texts = [text.get_text() for text in figure.axes[2].get_legend().get_texts()]
    assert texts == [MARCH, COARSE, FINE, "allowed"]


def test_a_search_without_iterations_is_drawn(match, tmp_path):
    pytest.importorskip("matplotlib")
    plot_match(replace(match, history=()), tmp_path / "nothing.png")
    assert "nothing was left to find" in [
        text.get_text() for text in figure_of(replace(match, history=())).axes[2].texts
    ]


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize(("width", "height", "channels"), [(12, 96, 1), (96, 12, 4), (2500, 40, 2)])
def test_panels_fit_any_picture(match, width, height, channels):
    """Artists neither overlap nor leave the figure; large pictures are reduced."""
    pytest.importorskip("matplotlib")
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    pixels = np.full((height, width, channels), 0.5, dtype=np.float32)
    picture = Picture(pixels, alpha={2: 1, 4: 3}.get(channels))
    animation = replace(match.animation, picture=picture, cells=16)
    figure = figure_of(replace(match, animation=animation, status="unreachable"))
    renderer = FigureCanvasAgg(figure).get_renderer()
    figure.canvas.draw()
    boxes = [axes.get_tightbbox(renderer) for axes in figure.axes[:2]]
    boxes.append(figure.axes[2].get_tightbbox(renderer).union(
        [axes.get_tightbbox(renderer) for axes in figure.axes[2:]]
    ))  # fmt: skip
    assert boxes[0].x1 < boxes[1].x0 and boxes[1].x1 < boxes[2].x0
    for box in boxes:
        assert box.x0 >= 0 and box.y0 >= 0 and box.x1 <= figure.bbox.x1 and box.y1 <= figure.bbox.y1
    for name, size in (("x", width), ("y", height)):
        assert len(named(figure, f"lines-{name}-white")) == (size * LINES > max(width, height))
    for axes in figure.axes[:2]:
        (image,) = axes.get_images()
        assert max(image.get_array().shape) <= 1200
        assert abs(axes.bbox.width / axes.bbox.height / (width / height) - 1) < 0.01


@pytest.mark.parametrize(
    ("name", "begin"),
    [("a.png", b"\x89PNG"), ("b.PDF", b"%PDF"), ("c.svg", b"<?xml version"), ("d.PNG", b"\x89PNG")],
)
def test_a_figure_has_the_format_of_its_ending_and_equal_bytes_each_time(match, tmp_path, name, begin):
    pytest.importorskip("matplotlib")
    path = tmp_path / name
    plot_match(match, str(path))
    first = path.read_bytes()
    assert first.startswith(begin)
    plot_match(match, path)
    assert path.read_bytes() == first
    assert [one.name for one in tmp_path.iterdir()] == [name]


def test_the_users_settings_of_matplotlib_are_ignored_and_kept(match, tmp_path):
    matplotlib = pytest.importorskip("matplotlib")
    plot_match(match, tmp_path / "a.png")
    with matplotlib.rc_context({"font.size": 20.0, "savefig.bbox": "tight"}):
        plot_match(match, tmp_path / "b.png")
        assert matplotlib.rcParams["font.size"] == 20.0
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()


def test_a_figure_that_fails_leaves_the_old_one(match, tmp_path, monkeypatch):
    pytest.importorskip("matplotlib")
    from matplotlib.figure import Figure

    def fail(self, file, **settings):
        file.write(b"half")
        raise RuntimeError("no font")

    monkeypatch.setattr(Figure, "savefig", fail)
    path = tmp_path / "a.png"
    path.write_bytes(b"old")
    with pytest.raises(RuntimeError, match="no font"):
        plot_match(match, path)
    assert path.read_bytes() == b"old"
    assert [one.name for one in tmp_path.iterdir()] == ["a.png"]


def test_an_invalid_path_is_refused_before_drawing(tmp_path):
    with pytest.raises(FileError, match=r"a\.gif: plots are written as \.png, \.pdf, \.svg$"):
        plot_match(None, tmp_path / "a.gif")
    with pytest.raises(FileError, match=r"none: no such folder; make it first$"):
        plot_match(None, tmp_path / "none" / "a.png")


def test_without_matplotlib_one_line_says_what_to_install(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    for ask in (check_plot, lambda path: plot_match(None, path)):
        with pytest.raises(ValueError) as refusal:
            ask(tmp_path / "a.png")
        expected = "plots need matplotlib; install it in the clone of wfluid: pip install -e '.[plot]'"
        assert str(refusal.value) == f"{tmp_path / 'a.png'}: {expected}"
    assert not list(tmp_path.iterdir())


def test_matplotlib_is_loaded_for_a_figure_only_and_pyplot_never(tmp_path):
    pytest.importorskip("matplotlib")
    code = (
        "import sys, wfluid.keyframes.plot as k; print('matplotlib' in sys.modules); "
        "k.check_plot(sys.argv[1]); print('matplotlib.pyplot' in sys.modules)"
    )
    command = [sys.executable, "-c", code, str(tmp_path / "a.png")]
    assert subprocess.run(command, capture_output=True, text=True).stdout.split() == ["False", "False"]

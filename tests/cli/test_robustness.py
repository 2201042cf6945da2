"""Nothing breaks it: bad files, killed runs, full disks, mistakes on the command line."""

import os
import resource
import signal
import struct
import subprocess
import sys
import time
import zlib

import numpy as np
import OpenImageIO as oiio
import pytest
from command import wfluid, wfluid_process

from wfluid.pictures import reading
from wfluid.pictures.formats import PictureError
from wfluid.pictures.picture import Picture
from wfluid.pictures.stills import read_picture, write_picture
from wfluid.system.atomic import remove_leftovers

PUSH = ("--push", "30,20:5,0:radius=8")
LONG = pytest.mark.long
QUICK = ("--cells", "16", "--duration", "0.2", "--fps", "10", "--quiet")


@pytest.fixture
def small(tmp_path):
    """A 60 x 40 picture."""
    values = np.random.default_rng(0).random((40, 60, 3)).astype(np.float32)
    write_picture(tmp_path / "small.png", Picture(values, dtype="uint8"))
    return tmp_path / "small.png"


def refused(result, says, folder):
    """Exit 2, one line on stderr that says it, no traceback, nothing in the folder."""
    assert result.returncode == 2, (result.returncode, result.stderr)
    assert says in result.stderr, result.stderr
    assert result.stderr.count("\n") == 1 and "Traceback" not in result.stderr, result.stderr
    assert result.stdout == "" and list(folder.iterdir()) == []


def huge_png(side):
    """A PNG header that claims side x side pixels, with no data to speak of."""

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    header = struct.pack(">IIBBBBB", side, side, 8, 2, 0, 0, 0)
    data = zlib.compress(b"\0" * 100)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", data) + chunk(b"IEND", b"")


def cut_in_half(ending, tmp_path):
    values = np.random.default_rng(0).random((64, 80, 3)).astype(np.float32)
    path = tmp_path / f"whole.{ending}"
    write_picture(path, Picture(values, dtype="uint8"))
    return path.read_bytes()[: path.stat().st_size // 2]


BAD_FILES = {
    "none.png": (None, "no such picture"),
    "empty.png": (lambda _: b"", "is empty"),
    "text.jpg": (lambda _: b"this is no picture, whatever its name says\n" * 9, "not a picture"),
    "noise.png": (lambda _: np.random.default_rng(1).bytes(5000), "not a picture"),
    "huge.png": (lambda _: huge_png(100_000), "sides of 1 … 65535 can be read"),
    "large.png": (lambda _: huge_png(65_000), " GB of "),
    "cut.png": (lambda path: cut_in_half("png", path), "damaged or cut off"),
    "cut.jpg": (lambda path: cut_in_half("jpg", path), "damaged or cut off"),
    "cut.exr": (lambda path: cut_in_half("exr", path), "damaged or cut off"),
    "cut.tif": (lambda path: cut_in_half("tif", path), "cut"),
    "cut.webp": (lambda path: cut_in_half("webp", path), "not a picture"),
}


@pytest.mark.parametrize("name", BAD_FILES)
def test_bad_pictures_are_refused_by_the_command(tmp_path, name):
    content, says = BAD_FILES[name]
    (tmp_path / "out").mkdir()
    if content is not None:
        (tmp_path / name).write_bytes(content(tmp_path))
    result = wfluid_process("animate", tmp_path / name, "-o", tmp_path / "out" / "a.gif", *PUSH, *QUICK)
    refused(result, says, tmp_path / "out")
    assert name in result.stderr


def test_a_picture_beyond_the_memory_is_refused_before_it_is_taken(small, monkeypatch):

    monkeypatch.setattr(reading, "free_memory", lambda: 1000)
    with pytest.raises(PictureError, match=r"60 x 40 pixels need about 86.4 kB of memory, 1 kB are free"):
        read_picture(small)


def test_what_is_not_finite_in_a_picture_does_not_spread(tmp_path):
    values = np.full((8, 8, 3), 0.5, np.float32)
    values[4, 4] = (np.inf, np.nan, -np.inf)
    spec = oiio.ImageSpec(8, 8, 3, "float")
    out = oiio.ImageOutput.create(str(tmp_path / "a.exr"))
    assert out.open(str(tmp_path / "a.exr"), spec) and out.write_image(values) and out.close()
    assert read_picture(tmp_path / "a.exr").pixels[4, 4].tolist() == [65504.0, 0.0, -65504.0]


@pytest.mark.parametrize(
    ("options", "says"),
    [
        (("--viscocity", "1"), "did you mean --viscosity?"),
        (("--duratoin=3",), "did you mean --duration?"),
        (("--xyzzy",), "there is no flag --xyzzy"),
        (("extra.png",), "'extra.png' is one argument too many"),
        (("--cells", "8192", "--width", "30000"), "lower --cells or --width"),
        (("--cells", "3"), "--cells 3: expected a whole number from 4"),
        (("--cells", "many"), "--cells 'many': expected a whole number"),
        (("--scale", "0"), "scale 0.0"),
        (("--scale", "nan"), "scale nan"),
        (("--scale", "0.5", "--width", "9"), "give one"),
        (("--filter", "sharpest"), "expected one of nearest, bilinear, cubic, lanczos"),
        (("--edge", "torn"), "expected one of clamp, mirror, wrap, transparent"),
        (("--colorspace", "pink"), "expected one of auto, srgb, linear"),
        (("--type", "int3"), "expected one of uint8"),
        (("--quality", "0"), "--quality 0: expected a whole number from 1"),
        (("--compression", "gzip"), "expected one of"),
        (("--fps", "-1"), "fps -1.0"),
        (("--fps", "0.05", "--duration", "40", "--substeps", "1"), "steps of 20 s"),
        (("--fps", "0.0015", "--duration", "667"), "fps 0.0015"),
        (("--duration", "1e308"), "frames: expected 1"),
        (("--push", "3,3:1,1:period=1e-200"), "period: 1e-200: expected a number from 0.001"),
        (("--push", "3,3:1,1:end=1e-200"), "expected 0.001 s or more"),
        (("--duration", "0"), "duration 0.0"),
        (("--viscosity", "inf"), "viscosity inf"),
        (("--report", "none/r.json"), "no such folder"),
        (("--preview", "none/p.png"), "no such folder"),
    ],
)
def test_mistakes_are_one_line_with_the_remedy(small, tmp_path, options, says):
    (tmp_path / "out").mkdir()
    defaults = () if "--fps" in options or "--duration" in options or "--cells" in options else QUICK
    out = tmp_path / "out" / "a.gif"
    refused(wfluid("animate", small, "-o", out, *PUSH, *defaults, *options), says, tmp_path / "out")


@pytest.mark.parametrize(
    ("name", "options", "says"),
    [
        ("a.####.jpg", ("--type", "half"), ".jpg holds uint8, not half"),
        ("a.####.png", ("--quality", "50"), ".png has no quality"),
        ("a.####.png", ("--compression", "zip"), "not for .png"),
        ("a.####.png", ("--start", "-2"), "--start -2: expected a whole number from 0"),
        ("a.xyz", (), "cannot tell the output's kind"),
        ("a.##.xyz", (), "unknown picture format"),
        ("none/a.gif", (), "no such folder"),
        ("", (), "a folder"),
    ],
)
def test_outputs_that_cannot_be_are_refused(small, tmp_path, name, options, says):
    (tmp_path / "out").mkdir()
    refused(
        wfluid("animate", small, "-o", tmp_path / "out" / name, *PUSH, *QUICK, *options),
        says,
        tmp_path / "out",
    )


def test_a_dry_run_changes_nothing_on_the_disk(small, tmp_path):
    """Not even files that look like temporary ones of processes that are gone."""
    (tmp_path / "out").mkdir()
    names = {".a.99999999.part.gif", ".backup.2023.part.zip", ".a.wfluid-here-99999999-1.part.gif"}
    for name in names:
        (tmp_path / "out" / name).write_bytes(b"x")
    result = wfluid("animate", small, "-o", tmp_path / "out" / "a.gif", *PUSH, *QUICK, "--dry-run")
    assert result.returncode == 0, result.stderr
    assert {path.name for path in (tmp_path / "out").iterdir()} == names


def test_a_missing_verb_has_its_nearest():
    result = wfluid("animat", "x.png")
    assert result.returncode == 2 and "did you mean animate?" in result.stderr


def test_the_output_may_not_be_the_input(small):
    before = small.read_bytes()
    for flag in ("-o", "--report", "--preview"):
        output = () if flag == "-o" else ("-o", small.with_name("b.gif"))
        result = wfluid("animate", small, flag, small, *output, *PUSH, *QUICK)
        assert result.returncode == 2 and "the picture itself" in result.stderr, result.stderr
    assert small.read_bytes() == before and not small.with_name("b.gif").exists()


def test_the_output_may_not_be_the_file_of_points(small, tmp_path):
    points = tmp_path / "points.csv"
    points.write_text("30,20,32,20\n")
    flags = ("--points", points, "--track", "10,10", "--tracks", points, "--cells", "16", "--quiet")
    result = wfluid("keyframes", small, "-o", tmp_path / "a.gif", *flags)
    assert result.returncode == 2 and "the file of points" in result.stderr, result.stderr
    assert points.read_text() == "30,20,32,20\n"


def test_a_sequence_may_not_hold_the_input_nor_two_outputs_one_name(small, tmp_path):
    shot = tmp_path / "shot.1002.png"
    shot.write_bytes(small.read_bytes())
    result = wfluid("animate", shot, "-o", tmp_path / "shot.####.png", *PUSH, *QUICK)
    assert result.returncode == 2 and "the picture itself" in result.stderr
    assert shot.read_bytes() == small.read_bytes()
    result = wfluid("animate", small, "-o", tmp_path / "a.gif", "--report", tmp_path / "a.gif", *PUSH, *QUICK)
    assert result.returncode == 2 and "the output of 'picture'" in result.stderr


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write anywhere")
def test_a_folder_that_cannot_be_written_is_refused(small, tmp_path):
    (tmp_path / "locked").mkdir(mode=0o500)
    result = wfluid("animate", small, "-o", tmp_path / "locked" / "a.gif", *PUSH, *QUICK)
    assert result.returncode == 2 and "cannot be written" in result.stderr


@pytest.mark.parametrize("name", ["a.gif", "a.mp4", "a.####.exr"])
def test_a_full_disk_leaves_nothing(small, tmp_path, name):
    """Files may not grow beyond 2000 bytes: the run fails in one line and leaves no file."""
    (tmp_path / "out").mkdir()

    def limit():
        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
        resource.setrlimit(resource.RLIMIT_FSIZE, (2000, 2000))

    options = (*PUSH, "--cells", "16", "--duration", "0.2", "--fps", "10", "--quiet")
    result = wfluid_process("animate", small, "-o", tmp_path / "out" / name, *options, preexec_fn=limit)
    assert result.returncode in (1, 2), (result.returncode, result.stderr)
    assert "Traceback" not in result.stderr and "a" in result.stderr
    assert list((tmp_path / "out").iterdir()) == []


@pytest.mark.parametrize("name", ["a.####.png", *(pytest.param(n, marks=LONG) for n in ("a.gif", "a.mp4"))])
@pytest.mark.parametrize("how", [signal.SIGKILL, signal.SIGINT])
def test_a_stopped_run_leaves_whole_files_only(small, tmp_path, name, how):
    """Killed or interrupted in the middle: every file under its name can be read to its end."""
    out = tmp_path / "out"
    out.mkdir()
    command = [sys.executable, "-m", "wfluid", "animate", small, "-o", out / name, *PUSH]
    command += ["--cells", "16", "--duration", "2000", "--fps", "10", "--width", "400"]
    run = subprocess.Popen(list(map(str, command)), stderr=subprocess.PIPE, text=True)
    deadline = time.monotonic() + 60
    while time.monotonic() < deadline and not any(out.iterdir()) and name != "a.gif":
        time.sleep(0.02)
    time.sleep(4.0 if name == "a.gif" else 0.5)
    run.send_signal(how)
    message = run.communicate(timeout=120)[1]
    shown = [path for path in out.iterdir() if not path.name.startswith(".")]
    for path in shown:
        if path.suffix == ".png":
            assert read_picture(path).width == 400
    if how == signal.SIGINT:
        assert run.returncode == 130, message
        assert "interrupted; finished: " in message and "Traceback" not in message
        assert shown and not [path for path in out.iterdir() if path.name.startswith(".")]
    elif name != "a.####.png":
        assert shown == []
    for number in range(1001, 1101):
        remove_leftovers(out / name.replace("####", str(number)))
    assert sorted(out.iterdir()) == sorted(shown)


READ = """
import sys
from wfluid.pictures.formats import PictureError
from wfluid.pictures.stills import read_picture
for path in sys.argv[1:]:
    try:
        picture = read_picture(path)
        assert picture.pixels.ndim == 3
    except PictureError as error:
        assert path in str(error) and "\\n" not in str(error), str(error)
print("read", len(sys.argv) - 1)
"""


@pytest.mark.parametrize("ending", ["png", "jpg", "exr", "gif"])
def test_mutated_files_never_crash_or_hang(tmp_path, ending):
    """Fifty files of each format with a few bytes changed: read, or refused in one line."""
    rng = np.random.default_rng(sum(map(ord, ending)))
    values = rng.integers(0, 256, (48, 40, 3)).astype(np.uint8)
    spec = oiio.ImageSpec(40, 48, 3, "uint8")
    out = oiio.ImageOutput.create(str(tmp_path / f"good.{ending}"))
    assert out.open(str(tmp_path / f"good.{ending}"), spec) and out.write_image(values) and out.close()
    good = (tmp_path / f"good.{ending}").read_bytes()
    paths = []
    for n in range(50):
        data = bytearray(good)
        for at in rng.integers(0, len(data) if n % 2 else min(len(data), 300), rng.integers(1, 12)):
            data[at] = rng.integers(0, 256)
        if n % 5 == 0:
            data = data[: rng.integers(1, len(data))]
        paths.append(tmp_path / f"mutated{n}.{ending}")
        paths[-1].write_bytes(data)
    result = subprocess.run(
        [sys.executable, "-c", READ, *map(str, paths)], capture_output=True, text=True, timeout=100
    )
    assert result.returncode == 0, f"exit {result.returncode}: {result.stderr[-600:]}"
    assert result.stdout.strip() == "read 50"


def test_a_movie_read_back_has_its_frames_and_duration(small, tmp_path):
    """And its colours: a smooth picture comes back within the chroma's rounding."""
    av = pytest.importorskip("av")
    x, y = np.linspace(0, 1, 60), np.linspace(0, 1, 40)[:, None]
    smooth = np.stack(np.broadcast_arrays(x, y, 0.5 * x * y), axis=2).astype(np.float32)
    write_picture(small, Picture(smooth, dtype="uint8"))
    for name in ("a.mp4", "a.webm"):
        options = ("--cells", "16", "--duration", "0.6", "--fps", "15", "--quiet", "--width", "61")
        for copy in ("", "again."):
            assert wfluid("animate", small, "-o", tmp_path / (copy + name), *PUSH, *options).returncode == 0
        assert (tmp_path / name).read_bytes() == (tmp_path / f"again.{name}").read_bytes()
        with av.open(str(tmp_path / name)) as movie:
            frames = [frame.to_ndarray(format="rgb24") for frame in movie.decode(video=0)]
            assert len(frames) == 10 and movie.streams.video[0].average_rate == 15
            assert movie.duration / 1e6 == pytest.approx(10 / 15, abs=0.02)
        picture = read_picture(small).resized(61, 41)
        from wfluid.pictures.fitting import display_rgb

        difference = np.abs(frames[0][:41, :61].astype(int) - display_rgb(picture)).mean()
        assert difference < 3, f"{name}: colours are off by {difference}"


def test_movies_without_pyav_say_how_to_get_it(small, tmp_path):
    code = "import sys; sys.modules['av'] = None; from wfluid.cli.main import main; sys.exit(main())"
    command = [sys.executable, "-c", code, "animate", small, "-o", tmp_path / "a.mp4", *PUSH]
    result = subprocess.run(list(map(str, command)), capture_output=True, text=True)
    assert result.returncode == 2 and "pip install -e '.[video]'" in result.stderr


def test_the_preview_draws_and_runs_nothing(small, tmp_path):
    result = wfluid("animate", small, "--preview", tmp_path / "p.png", *PUSH)
    assert (result.returncode, result.stderr) == (0, "")
    drawn, plain = read_picture(tmp_path / "p.png").pixels, read_picture(small).pixels
    arrow, corner = drawn[20, 31:34], drawn[:4, :4]
    assert np.all(arrow[:, 0] > 0.9) and np.all(arrow[:, 2] < 0.1)
    np.testing.assert_allclose(corner, plain[:4, :4] * 0.8, atol=0.02)


def test_a_dry_run_says_what_it_would_do_and_writes_nothing(small, tmp_path):
    (tmp_path / "out").mkdir()
    result = wfluid("animate", small, "-o", tmp_path / "out" / "a.gif", *PUSH, "--duration", "1", "--dry-run")
    assert result.returncode == 0 and list((tmp_path / "out").iterdir()) == []
    for line in (
        "grid      256 x 171 cells",
        "steps     105 of",
        "frames    16 of 60 x 40",
        "memory    about",
    ):
        assert line in result.stdout, result.stdout


def test_a_gif_too_long_for_the_memory_is_refused(small, tmp_path):
    """It keeps its frames for the palette; a movie of the same length does not."""
    options = ("--duration", "6000", "--fps", "15", "--width", "4000", "--dry-run")
    result = wfluid("animate", small, "-o", tmp_path / "a.gif", *PUSH, *options)
    assert result.returncode == 2 and "write a movie" in result.stderr
    assert wfluid("animate", small, "-o", tmp_path / "a.####.png", *PUSH, *options).returncode == 0


def test_version_names_what_it_runs_on():
    result = wfluid_process("--version")
    assert result.returncode == 0
    for name in ("wfluid ", "warp 1.", "OpenImageIO 3.", "devices: cpu"):
        assert name in result.stdout

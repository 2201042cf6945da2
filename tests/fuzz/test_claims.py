"""Pictures whose headers claim more than can be read are refused before memory is allocated."""

import os
import resource
import struct
import subprocess
import sys
import zlib

import numpy as np
import OpenImageIO as oiio
import pytest

from wfluid.pictures.formats import PictureError
from wfluid.pictures.stills import read_picture

READ = """
import re, sys
from pathlib import Path
import OpenImageIO
import wfluid.pictures.profiles
from wfluid.pictures import reading
from wfluid.pictures.formats import PictureError
from wfluid.pictures.stills import read_picture

reading.free_memory = lambda: int(sys.argv[1])

def peak():  # of this process alone, unlike ru_maxrss
    return int(re.search(r"VmHWM:\\s+(\\d+)", Path("/proc/self/status").read_text())[1]) // 1024

before = peak()
for name in sys.argv[2:]:
    try:
        read_picture(name)
    except PictureError as error:
        print(str(error).removeprefix(name + ": "))
print(peak() - before)
"""

SIDES = "sides of 1 … 65535 can be read"
HUGE = (100_000, 100_000)
LONG = (1, 2_000_000_000)


def _png(width, height):
    def chunk(name, data):
        return struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))

    head = chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0))
    return b"\x89PNG\r\n\x1a\n" + head + chunk(b"IDAT", zlib.compress(bytes(99))) + chunk(b"IEND", b"")


def _bmp(width, height):
    head = struct.pack("<IHHIIiiHHIIiiII", 54, 0, 0, 54, 40, width, height, 1, 24, 0, 0, 0, 0, 0, 0)
    return b"BM" + head + bytes(99)


def _ppm(width, height):
    return b"P6\n%d %d\n255\n" % (width, height) + bytes(99)


def _hdr(width, height):
    return b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y %d +X %d\n" % (height, width) + bytes(99)


def _tif(width, height, channels=3):
    tags = [(256, width), (257, height), (258, 8), (259, 1), (262, 2), (273, 8), (277, channels)]
    tags += [(278, height), (279, 99)]
    entries = b"".join(struct.pack("<HHII", tag, 4, 1, value) for tag, value in tags)
    return b"II*\0" + struct.pack("<IH", 8, len(tags)) + entries + bytes(103)


def _gif(width, height):
    screen = b"GIF89a" + struct.pack("<HHBBB", width, height, 0xF0, 0, 0) + bytes(6)
    return screen + b"," + struct.pack("<HHHHB", 0, 0, width, height, 0) + b"\x02\x02\x44\x01\x00;"


def _ico(width, height):
    png = _png(width, height)
    return struct.pack("<HHHBBBBHHII", 0, 1, 1, 0, 0, 0, 0, 1, 32, len(png), 22) + png


def _exr(width, height, channels=3):
    def attribute(name, kind, data):
        return name + b"\0" + kind + b"\0" + struct.pack("<I", len(data)) + data

    names = b"".join(b"c%05d\0" % n + struct.pack("<IIII", 1, 0, 1, 1) for n in range(channels)) + b"\0"
    box = struct.pack("<iiii", 0, 0, width - 1, height - 1)
    head = attribute(b"channels", b"chlist", names) + attribute(b"compression", b"compression", b"\x03")
    head += attribute(b"dataWindow", b"box2i", box) + attribute(b"displayWindow", b"box2i", box)
    head += attribute(b"lineOrder", b"lineOrder", b"\0")
    head += attribute(b"pixelAspectRatio", b"float", struct.pack("<f", 1))
    head += attribute(b"screenWindowCenter", b"v2f", bytes(8))
    head += attribute(b"screenWindowWidth", b"float", struct.pack("<f", 1))
    return b"\x76\x2f\x31\x01\x02\0\0\0" + head + b"\0" + bytes(200)


def _psd(width, height, channels=3):
    return b"8BPS" + struct.pack(">H6xHIIHH", 1, channels, height, width, 8, 3) + bytes(200)


def _jpg(width, height):
    frame = struct.pack(">HBHHB", 17, 8, height, width, 3) + b"\1\x11\0\2\x11\0\3\x11\0"
    scan = struct.pack(">HB", 12, 3) + b"\1\0\2\0\3\0\0\x3f\0"
    return b"\xff\xd8\xff\xc0" + frame + b"\xff\xda" + scan + bytes(100) + b"\xff\xd9"


def _tga(width, height):
    return struct.pack("<BBBHHBHHHHBB", 0, 0, 2, 0, 0, 0, 0, 0, width, height, 24, 0) + bytes(99)


def _j2c(width, height):
    size = struct.pack(">HHIIIIIIIIH", 47, 0, width, height, 0, 0, width, height, 0, 0, 3) + b"\7\1\1" * 3
    return b"\xff\x4f\xff\x51" + size + bytes(100)


def _jp2(width, height):
    return b"\0\0\0\x0cjP  \r\n\x87\n\0\0\0\0jp2c" + _j2c(width, height)


CLAIMS = (
    ("png", _png(*HUGE), f"100000 x 100000 pixels; {SIDES}"),
    ("bmp", _bmp(*HUGE), f"100000 x 100000 pixels; {SIDES}"),
    ("bmp", _bmp(*LONG), f"1 x 2000000000 pixels; {SIDES}"),
    ("ppm", _ppm(*HUGE), f"100000 x 100000 pixels; {SIDES}"),
    ("ppm", _ppm(*LONG), f"1 x 2000000000 pixels; {SIDES}"),
    ("hdr", _hdr(*HUGE), f"100000 x 100000 pixels; {SIDES}"),
    ("hdr", _hdr(*LONG), f"1 x 2000000000 pixels; {SIDES}"),
    ("tif", _tif(*HUGE), f"100000 x 100000 pixels; {SIDES}"),
    ("tif", _tif(*LONG), f"1 x 2000000000 pixels; {SIDES}"),
    ("exr", _exr(*HUGE), f"100000 x 100000 pixels; {SIDES}"),
    ("ico", _ico(*HUGE), f"100000 x 100000 pixels; {SIDES}"),
    ("gif", _gif(65_535, 65_535), "65535 x 65535 pixels; sides of 1 … 32768 can be read"),
    ("tif", _tif(10, 10, 60_000), "60000 channels; at most 1024 can be read"),
    ("exr", _exr(10, 10, 60_000), "60000 channels; at most 1024 can be read"),
    ("j2c", _j2c(*HUGE), f"100000 x 100000 pixels; {SIDES}"),
    ("jp2", _jp2(*LONG), f"1 x 2000000000 pixels; {SIDES}"),
    ("psd", _psd(*HUGE), "its header names a size beyond what its format holds; it is damaged"),
    ("png", _png(60_000, 30_000), "its header claims 5.4 GB of pixels, the file has 69 bytes: damaged"),
    ("gif", _gif(32_768, 32_768), "its header claims 4.29 GB of pixels, the file has 35 bytes: damaged"),
    ("jpg", _jpg(60_000, 30_000), "its header claims 5.4 GB of pixels, the file has 137 bytes: damaged"),
    ("tga", _tga(60_000, 30_000), "its header claims 5.4 GB of pixels, the file has 99 bytes: damaged"),
)
"""Endings, files, and what is said of them."""


def test_a_picture_that_claims_too_much_is_refused_by_its_header(tmp_path):
    """In one sentence with the limit, within 20 MB, with 100 GB free."""
    paths = []
    for n, (ending, data, _) in enumerate(CLAIMS):
        paths.append(tmp_path / f"claim{n}.{ending}")
        paths[-1].write_bytes(data)
    done = subprocess.run(
        [sys.executable, "-c", READ, "100000000000", *paths], capture_output=True, text=True, timeout=60
    )
    *messages, memory = done.stdout.splitlines()
    assert messages == [says for *_, says in CLAIMS], done.stderr
    assert int(memory) < 20


def test_a_picture_larger_than_the_free_memory_is_refused(tmp_path, monkeypatch):
    """A sparse file, which holds what its header claims."""
    path = tmp_path / "large.bmp"
    path.write_bytes(_bmp(30_000, 30_000))
    os.truncate(path, 30_000 * 30_000 * 3 + 100)
    monkeypatch.setattr("wfluid.pictures.reading.free_memory", lambda: 10_000_000_000)
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    with pytest.raises(
        PictureError, match=r"30000 x 30000 pixels need about 32.4 GB of memory, 10 GB are fr"
    ):
        read_picture(path)
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 100_000


@pytest.mark.parametrize(
    ("ending", "says"),
    [
        ("jp2", "3000 x 3000 pixels need about 324 MB of memory"),
        ("gif", "its pixels need more than 108 MB of memory"),
        ("png", "its pixels need more than 80.8 MB of memory"),
        ("exr", "its pixels need more than 162 MB of memory"),
    ],
)
def test_a_small_file_of_a_large_picture_is_refused_before_it_is_decoded(tmp_path, ending, says):
    """Some formats are decoded as they are opened: there the header is read first."""
    path = tmp_path / f"black.{ending}"
    spec = oiio.ImageSpec(3000, 3000, 3, "half" if ending == "exr" else "uint8")
    out = oiio.ImageOutput.create(str(path))
    assert out.open(str(path), spec)
    assert out.write_image(np.zeros((3000, 3000, 3), np.float32)) and out.close()
    done = subprocess.run(
        [sys.executable, "-c", READ, "50000000", path], capture_output=True, text=True, timeout=60
    )
    message, memory = done.stdout.splitlines()
    assert message == f"{says}, 50 MB are free; make the picture smaller first"
    assert int(memory) < 20


def test_the_limits_of_the_process_are_left_as_they_are(tmp_path):
    path = tmp_path / "claim.png"
    path.write_bytes(_png(*HUGE))
    names = ("limits:resolution", "limits:channels", "limits:imagesize_MB")
    before = [oiio.get_int_attribute(name) for name in names]
    with pytest.raises(PictureError):
        read_picture(path)
    assert [oiio.get_int_attribute(name) for name in names] == before


def test_a_file_named_null_is_no_picture(tmp_path):
    """OpenImageIO reads a black picture from it."""
    path = tmp_path / "points.null"
    path.write_bytes(b"1,2,3,4\n")
    with pytest.raises(PictureError, match="not a picture"):
        read_picture(path)

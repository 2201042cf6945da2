"""Pictures whose headers claim more than can be read are refused before memory is allocated."""

import struct
import subprocess
import sys
import zlib

import pytest

READ = """
import resource, sys
from wfluid.pictures.formats import PictureError
from wfluid.pictures.stills import read_picture
try:
    read_picture(sys.argv[1])
except PictureError as error:
    assert "\\n" not in str(error)
    print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss // 1024, error)
"""


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


@pytest.mark.parametrize("size", [(100_000, 100_000), (1, 2_000_000_000)])
@pytest.mark.parametrize("made", [_png, _bmp, _ppm, _hdr, _tif], ids=lambda made: made.__name__[1:])
def test_a_picture_that_claims_too_much_is_refused_by_its_header(tmp_path, made, size):
    """Within a second's start and 200 MB of memory, whatever memory is free."""
    path = tmp_path / f"claims.{made.__name__[1:]}"
    path.write_bytes(made(*size))
    done = subprocess.run([sys.executable, "-c", READ, path], capture_output=True, text=True, timeout=20)
    assert done.returncode == 0, done.stderr[-400:]
    memory, _, message = done.stdout.partition(" ")
    assert int(memory) < 200
    assert message.startswith(f"{path}: ")

"""Good files of every readable kind, 40 x 48 pixels: from these, mutated ones are made."""

import gzip
import struct
from pathlib import Path

import numpy as np
import OpenImageIO as oiio

WIDTH, HEIGHT = 40, 48

WRITTEN = (
    ("png", "uint8", 4, {}),
    ("png", "uint16", 3, {}),
    ("jpg", "uint8", 3, {"Orientation": 6}),
    ("exr", "half", 4, {"compression": "zip"}),
    ("exr", "half", 3, {"compression": "piz"}),
    ("exr", "float", 3, {"compression": "dwaa"}),
    ("exr", "half", 3, {"compression": "pxr24"}),
    ("exr", "half", 3, {"compression": "b44"}),
    ("exr", "half", 3, {"compression": "rle"}),
    ("exr", "uint", 1, {"compression": "none"}),
    ("tif", "uint8", 4, {"compression": "lzw"}),
    ("tif", "uint16", 3, {"compression": "zip"}),
    ("tif", "uint8", 3, {"compression": "zstd"}),
    ("tif", "uint8", 3, {"compression": "packbits", "planarconfig": "separate"}),
    ("tif", "int", 1, {"compression": "none"}),
    ("tif", "float", 3, {"compression": "none"}),
    ("gif", "uint8", 4, {}),
    ("webp", "uint8", 4, {}),
    ("hdr", "float", 3, {}),
    ("tga", "uint8", 4, {"compression": "rle"}),
    ("bmp", "uint8", 3, {}),
    ("dpx", "uint16", 3, {}),
    ("ico", "uint8", 4, {}),
    ("jp2", "uint8", 3, {}),
    ("j2c", "uint16", 3, {}),
    ("jxl", "uint8", 3, {}),
    ("ppm", "uint8", 3, {}),
    ("pgm", "uint16", 1, {}),
    ("pfm", "float", 3, {}),
    ("sgi", "uint8", 3, {}),
    ("iff", "uint8", 4, {"tile": 64, "compression": "rle"}),
    ("rla", "uint8", 3, {}),
    ("fits", "float", 1, {}),
    ("zfile", "float", 1, {}),
    ("exr", "half", 3, {"tile": 16, "compression": "none"}),
    ("tif", "uint8", 3, {"tile": 16, "compression": "none"}),
    ("exr", "half", 3, {"pages": 3, "compression": "none"}),
    ("tif", "uint8", 3, {"pages": 3, "compression": "none"}),
    ("gif", "uint8", 4, {"pages": 3}),
)
"""Ending, type, channels and attributes of files that OpenImageIO writes; `tile` is the side of tiles, and
`pages` the number of pictures."""

TEXT_ENDINGS = (".csv", ".toml")

TEXTS = {
    "comma.csv": b"from x,from y,to x,to y,time\n20,5,30,8,1\n10,12.5,14,3e1,\n",
    "semicolon.csv": "sep=;\n20,5;20,5;30;8\n1;2;3;4\n".encode("utf-16"),
    "tab.csv": b"# points\n20\t5\t30\t8\n",
    "push.toml": b'wfluid = 1\n[picture]\nfile = "plain.png"\n[time]\nfps = 10\nduration = 0.2\n'
    b'[[force]]\nkind = "push"\ncenter = [10, 20]\nby = [3, 0]\nradius = 4.5\n',
    "keys.toml": b'wfluid = 1\npicture = {file = "plain.png", size = [40.0, 48]}\n'
    b"keyframes.move = [{from = [10, 20], to = [12, 20], time = 0.5}]\n"
    b'[fluid]\ncells = 16\nwalls = "periodic,no-slip"\n[[output]]\nfile = "x.gif"\n',
}


def write_good_files(folder: Path) -> list[Path]:
    """Write one good file of each kind, and `plain.png`, a picture that scenes animate."""
    rng = np.random.default_rng(1)
    _write(folder / "plain.png", "uint8", 3, {}, rng)
    paths = []
    for n, (ending, kind, channels, attributes) in enumerate(WRITTEN):
        paths.append(folder / f"good{n}.{ending}")
        _write(paths[-1], kind, channels, dict(attributes), rng)
    _write_deep(folder / "deep.exr")
    _write_not_finite(folder / "nan.exr", rng)
    zfile = next(path for path in paths if path.suffix == ".zfile")
    (folder / "packed.zfile").write_bytes(gzip.compress(zfile.read_bytes(), mtime=0))
    paths += [folder / "deep.exr", folder / "nan.exr", folder / "packed.zfile"]
    for name, data in {**_by_hand(rng), **TEXTS}.items():
        paths.append(folder / name)
        paths[-1].write_bytes(data)
    return paths


def _write(path: Path, kind: str, channels: int, attributes: dict, rng: np.random.Generator) -> None:
    pages, tile = attributes.pop("pages", 1), attributes.pop("tile", 0)
    spec = oiio.ImageSpec(WIDTH, HEIGHT, channels, kind)
    spec.tile_width = spec.tile_height = tile
    for key, value in attributes.items():
        spec.attribute(key, value)
    out = oiio.ImageOutput.create(str(path))
    opened = out.open(str(path), spec) if pages == 1 else out.open(str(path), (spec,) * pages)
    assert opened, (path.name, out.geterror())
    for page in range(pages):
        assert page == 0 or out.open(str(path), spec, "AppendSubimage"), (path.name, out.geterror())
        numbers = rng.random((HEIGHT, WIDTH, channels), dtype=np.float32)
        assert out.write_image(numbers), (path.name, out.geterror())
    assert out.close(), (path.name, out.geterror())
    out.geterror()


def _write_deep(path: Path) -> None:
    spec = oiio.ImageSpec(WIDTH, HEIGHT, 5, "half")
    spec.deep, spec.channelnames = True, ("R", "G", "B", "A", "Z")
    deep = oiio.DeepData()
    deep.init(WIDTH * HEIGHT, 5, oiio.TypeDesc("half"), spec.channelnames)
    for pixel in range(0, WIDTH * HEIGHT, 3):
        deep.set_samples(pixel, 2)
        deep.set_deep_value(pixel, 4, 1, 2.0)
    out = oiio.ImageOutput.create(str(path))
    assert out.open(str(path), spec) and out.write_deep_image(deep) and out.close(), out.geterror()


def _write_not_finite(path: Path, rng: np.random.Generator) -> None:
    numbers = rng.random((HEIGHT, WIDTH, 4), dtype=np.float32)
    numbers[::7, ::5, 1], numbers[3, :, 0], numbers[9, 9, 3] = np.nan, np.inf, -np.inf
    out = oiio.ImageOutput.create(str(path))
    spec = oiio.ImageSpec(WIDTH, HEIGHT, 4, "float")
    assert out.open(str(path), spec) and out.write_image(numbers) and out.close(), out.geterror()


def _by_hand(rng: np.random.Generator) -> dict[str, bytes]:
    """Files of formats that OpenImageIO reads and does not write, after the formats' descriptions."""
    pixels = rng.integers(0, 256, (HEIGHT, WIDTH, 3), dtype=np.uint8).tobytes()
    padded = rng.bytes(WIDTH * HEIGHT * 4)
    psd = b"8BPS" + struct.pack(">H6xHIIHH", 1, 3, HEIGHT, WIDTH, 8, 3) + bytes(12) + b"\0\0" + pixels
    dds = b"DDS " + struct.pack("<7I44x", 124, 0x100F, HEIGHT, WIDTH, WIDTH * 3, 0, 0)
    dds += struct.pack("<8I5I", 32, 0x40, 0, 24, 0xFF0000, 0xFF00, 0xFF, 0, 0x1000, 0, 0, 0, 0) + pixels
    bc1 = b"DDS " + struct.pack("<7I44x", 124, 0x81007, HEIGHT, WIDTH, WIDTH * HEIGHT // 2, 0, 0)
    bc1 += struct.pack("<2I4s5I5I", 32, 4, b"DXT1", *bytes(5), 0x1000, *bytes(4)) + padded[: 20 * 48]
    cineon = bytearray(2048)
    struct.pack_into(">6I4s", cineon, 0, 0x802A5FD7, 2048, 1024, 256, 0, 2048 + len(padded), b"V4.5")
    cineon[192:194] = bytes([0, 3])
    for n in range(3):
        struct.pack_into(">BBBBIIffff", cineon, 196 + 28 * n, 0, n + 1, 10, 0, WIDTH, HEIGHT, 0, 0, 1023, 2)
    struct.pack_into(">BBBBII", cineon, 680, 0, 5, 0, 0, 0, 0)
    softimage = bytes.fromhex("5380F634") + struct.pack(">f80s4sHHfHH", 3.7, b"", b"PICT", 40, 48, 1, 3, 0)
    softimage += bytes([0, 8, 0, 0xE0]) + pixels
    packed = bytes.fromhex("5380F634") + struct.pack(">f80s4sHHfHH", 3.7, b"", b"PICT", 40, 48, 1, 3, 0)
    packed += bytes([0, 8, 2, 0xE0]) + bytes([WIDTH - 1 + 128, 1, 2, 3]) * HEIGHT
    return {
        "hand.psd": psd,
        "hand.dds": dds,
        "bc1.dds": bc1,
        "hand.cin": bytes(cineon) + padded,
        "hand.pic": softimage,
        "packed.pic": packed,
    }

"""Mutated files: bytes changed in header or body, with checksums made good, cut ends, wrong endings."""

import struct
import zlib
from pathlib import Path

import numpy as np
from fuzz_files import TEXT_ENDINGS, write_good_files

HEADER = 300
"""Bytes at the start of a file that hold its header, in most formats."""

_WORDS = (*"09-.,;\"'[]{=#\n\t \0é", "e9", "nan")
"""What is put into a text."""

_PNG = b"\x89PNG\r\n\x1a\n"


def mutated_files(folder: Path, count: int, start: int = 0) -> list[Path]:
    """Mutated files, each made with its number as the seed; one of 16 has the ending of another kind."""
    good = [(path.suffix, path.read_bytes()) for path in write_good_files(folder)]
    endings = sorted({ending for ending, _ in good if ending not in TEXT_ENDINGS})
    paths = []
    for n in range(start, start + count):
        rng = np.random.default_rng(n)
        ending, data = good[n % len(good)]
        if ending not in TEXT_ENDINGS and rng.random() < 1 / 16:
            ending = str(rng.choice(endings))
        paths.append(folder / f"mutated{n}{ending}")
        paths[-1].write_bytes((mutated_text if ending in TEXT_ENDINGS else mutated)(data, rng))
    return paths


def mutated(data: bytes, rng: np.random.Generator) -> bytes:
    """The bytes of a file with flips, runs replaced, put in or taken out, extreme lengths, or its end cut.

    Half of the files keep their header and change behind it; in half of these, all bytes stay in their
    places. Of half of the PNGs the checksums are made good, of a quarter the compressed rows are changed.
    """
    if data.startswith(_PNG) and rng.random() < 0.25:
        return _png_of_rows(data, rng)
    start, end, moves = 0, len(data), True
    if rng.random() < 0.5 and len(data) > 2 * HEADER:
        start, moves = HEADER, rng.random() < 0.5
    elif rng.random() < 0.7:
        end = min(end, HEADER)
    found = bytearray(data)
    for _ in range(_count(rng)):
        _change(found, start, min(end, len(found)), moves, rng)
    return with_checksums(bytes(found)) if data.startswith(_PNG) and rng.random() < 0.7 else bytes(found)


def mutated_text(data: bytes, rng: np.random.Generator) -> bytes:
    """The bytes of a text with a few characters changed, put in or taken out, or as by `mutated`."""
    if rng.random() < 0.3:
        return mutated(data, rng)
    encoding = "utf-16" if data[:2] in (b"\xff\xfe", b"\xfe\xff") else "utf-8"
    text = data.decode(encoding)
    for _ in range(rng.integers(1, 3)):
        at, size = int(rng.integers(0, len(text) + 1)), int(rng.integers(0, 3))
        text = text[:at] + str(rng.choice(_WORDS)) * int(rng.integers(0, 3)) + text[at + size :]
    return text.encode(encoding)


def _count(rng: np.random.Generator) -> int:
    """The number of changes: one in half of the files, otherwise up to five."""
    return 1 if rng.random() < 0.5 else int(rng.integers(2, 6))


def _change(data: bytearray, start: int, end: int, moves: bool, rng: np.random.Generator) -> None:
    """Change one place between `start` and `end`; with `moves` bytes may be put in or taken out."""
    at, size = int(rng.integers(start, max(end, start + 1))), int(rng.integers(1, 16))
    match rng.integers(0, 6 if moves else 3):
        case 0 if at < len(data):
            data[at] ^= 1 << int(rng.integers(0, 8))
        case 1:
            size = min(size, len(data) - at)
            data[at : at + size] = rng.bytes(max(size, 0))
        case 2:
            size = min(int(rng.choice([2, 4, 8])), len(data) - at)
            data[at : at + size] = bytes([rng.choice([0, 1, 0x7F, 0x80, 0xFF])]) * max(size, 0)
        case 3:
            data[at:at] = rng.bytes(size)
        case 4:
            del data[at : at + size]
        case 5 if rng.random() < 0.3:
            del data[at:]


def _chunks(png: bytes) -> list[tuple[bytes, bytes]]:
    """Name and data of the chunks of a PNG, as far as they can be told apart; the rest is the last one's."""
    found, at = [], len(_PNG)
    while at + 12 <= len(png):
        (size,) = struct.unpack(">I", png[at : at + 4])
        found.append((png[at + 4 : at + 8], png[at + 8 : at + 8 + size]))
        at += 12 + size
    return found


def _png(chunks: list[tuple[bytes, bytes]]) -> bytes:
    return _PNG + b"".join(
        struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))
        for name, data in chunks
    )


def with_checksums(png: bytes) -> bytes:
    """A PNG with right lengths and checksums."""
    return _png(_chunks(png))


def _png_of_rows(png: bytes, rng: np.random.Generator) -> bytes:
    """A PNG whose rows are changed before they are compressed again."""
    chunks = _chunks(png)
    rows = bytearray(zlib.decompress(b"".join(data for name, data in chunks if name == b"IDAT")))
    moves = rng.random() < 0.3
    for _ in range(_count(rng)):
        _change(rows, 0, len(rows), moves, rng)
    last = [(b"IDAT", zlib.compress(bytes(rows))), (b"IEND", b"")]
    return _png([chunk for chunk in chunks if chunk[0] not in (b"IDAT", b"IEND")] + last)

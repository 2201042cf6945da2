"""Mutated and cut files of every readable kind: read with finite values, or refused in one line.

`--fuzz N` sets the number of files. Files are read in processes of their own with limits of time and memory,
so that a native library that ends or blocks the process is found, with the file that did it.
"""

import resource
import subprocess
import sys
from pathlib import Path

import numpy as np
import OpenImageIO as oiio

BATCH = 250
"""Files a process reads."""

WORKER = """
import sys
from pathlib import Path
import numpy as np
from wfluid.files.points import read_points
from wfluid.pictures import reading
from wfluid.pictures.stills import read_picture
from wfluid.scene.schema import SceneError
from wfluid.scene.toml_file import read_scene
from wfluid.system.errors import FileError

reading.free_memory = lambda: 1 << 29
for name in sys.argv[1:]:
    print(name, end=" ", flush=True)
    try:
        if name.endswith(".csv"):
            rows = read_points(name)
            assert rows and np.isfinite([(*row.source, *row.target) for row in rows]).all()
        elif name.endswith(".toml"):
            read_scene(name)
        else:
            stored = read_picture(name)
            assert stored.pixels.ndim == 3 and stored.pixels.dtype == np.float32
        print("read")
    except (FileError, SceneError, reading.PictureError) as error:
        assert "\\n" not in str(error), repr(error)
        print("refused")
"""

PICTURES = (
    ("png", "uint8", 4, {}),
    ("png", "uint16", 3, {}),
    ("jpg", "uint8", 3, {}),
    ("exr", "half", 4, {"compression": "zip"}),
    ("exr", "half", 3, {"compression": "piz"}),
    ("exr", "float", 3, {"compression": "dwaa"}),
    ("exr", "half", 3, {"compression": "pxr24"}),
    ("exr", "half", 3, {"compression": "b44"}),
    ("exr", "half", 3, {"compression": "rle"}),
    ("tif", "uint8", 4, {"compression": "lzw"}),
    ("tif", "uint16", 3, {"compression": "zip"}),
    ("tif", "uint8", 3, {"compression": "zstd"}),
    ("tif", "int32", 1, {}),
    ("tif", "float", 3, {}),
    ("gif", "uint8", 4, {}),
    ("webp", "uint8", 4, {}),
    ("hdr", "float", 3, {}),
    ("tga", "uint8", 4, {"compression": "rle"}),
    ("bmp", "uint8", 3, {}),
    ("dpx", "uint16", 3, {}),
    ("ico", "uint8", 4, {}),
    ("jp2", "uint8", 3, {}),
    ("jxl", "uint8", 3, {}),
    ("heic", "uint8", 3, {}),
    ("ppm", "uint8", 3, {}),
    ("pfm", "float", 3, {}),
    ("sgi", "uint8", 3, {}),
    ("iff", "uint8", 3, {}),
)
"""Ending, type, channels and attributes of the good files; formats that cannot be written are left out."""

TEXTS = {
    "comma.csv": b"from x,from y,to x,to y,time\n20,5,30,8,1\n10,12.5,14,-3e1,\n",
    "semicolon.csv": "sep=;\n20,5;20,5;30;8\n1;2;3;4\n".encode("utf-16"),
    "tab.csv": b"# points\n20\t5\t30\t8\n",
    "scene.toml": b'picture = "a.png"\n[frames]\nfps = 10\n[[forces]]\nat = [1, 2]\nradius = 0.1\n',
}


def good_files(folder: Path) -> list[Path]:
    """One good file of each kind."""
    rng = np.random.default_rng(1)
    paths = []
    for n, (ending, kind, channels, attributes) in enumerate(PICTURES):
        path = folder / f"good{n}.{ending}"
        spec = oiio.ImageSpec(40, 48, channels, kind)
        for key, value in attributes.items():
            spec.attribute(key, value)
        out = oiio.ImageOutput.create(str(path))
        numbers = rng.random((48, 40, channels), dtype=np.float32)
        if out and out.open(str(path), spec) and out.write_image(numbers) and out.close():
            paths.append(path)
    oiio.geterror()
    for name, data in TEXTS.items():
        (folder / name).write_bytes(data)
        paths.append(folder / name)
    return paths


def mutated(data: bytes, rng: np.random.Generator) -> bytes:
    """The bytes of a file with flips, runs replaced, put in or taken out, extreme lengths, or its end cut."""
    data = bytearray(data)
    for _ in range(rng.integers(1, 6)):
        end = min(len(data), 300) if rng.random() < 0.6 else len(data)
        at, size = int(rng.integers(0, max(end, 1))), int(rng.integers(1, 16))
        match rng.integers(0, 6):
            case 0 if data:
                data[at] ^= 1 << int(rng.integers(0, 8))
            case 1:
                data[at : at + size] = rng.bytes(size)
            case 2:
                data[at:at] = rng.bytes(size)
            case 3:
                del data[at : at + size]
            case 4:
                size = int(rng.choice([2, 4, 8]))
                data[at : at + size] = bytes([rng.choice([0, 0x7F, 0x80, 0xFF])]) * size
            case 5 if rng.random() < 0.3:
                del data[at:]
    return bytes(data)


def limited() -> None:
    """Limit the memory of a process, and leave no core file."""
    resource.setrlimit(resource.RLIMIT_AS, (6 << 30, 6 << 30))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))


def test_mutated_files_are_read_or_refused(tmp_path, request):
    """Each file is named with its number, which repeats it: the generator is seeded by it."""
    good = [(path.suffix, path.read_bytes()) for path in good_files(tmp_path)]
    paths = []
    for n in range(request.config.getoption("--fuzz")):
        ending, data = good[n % len(good)]
        paths.append(tmp_path / f"mutated{n}{ending}")
        paths[-1].write_bytes(mutated(data, np.random.default_rng(n)))
    faults, counts = [], {"read": 0, "refused": 0}
    while paths:
        batch, paths = paths[:BATCH], paths[BATCH:]
        command = [sys.executable, "-c", WORKER, *map(str, batch)]
        try:
            done = subprocess.run(command, capture_output=True, text=True, timeout=60, preexec_fn=limited)
            out, why = done.stdout, f"exit {done.returncode}: {done.stderr.strip()[-400:]}"
            failed = done.returncode != 0
        except subprocess.TimeoutExpired as error:
            out, why, failed = (error.stdout or b"").decode(), "no end after 60 s", True
        lines = [line.split() for line in out.splitlines()]
        for line in lines:
            if line[-1] in counts:
                counts[line[-1]] += 1
        if failed:
            last = sum(line[-1] in counts for line in lines)
            faults.append(f"{batch[last] if last < len(batch) else batch[-1]}: {why}")
            paths = batch[last + 1 :] + paths
    print(counts, len(faults))
    assert not faults, "\n".join(faults)

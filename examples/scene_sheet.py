"""The force scenes of examples/scenes, small and side by side: what each control does.

A scene is one TOML file; `wfluid render examples/scenes/vortex.toml -o vortex.gif` runs one of them.

    python examples/scene_sheet.py --output scenes.gif
"""

import argparse
import sys
from pathlib import Path

import numpy as np
import OpenImageIO as oiio

from wfluid import Frame, Picture, read_scene, stage, write_animation

SCENES = Path(__file__).parent / "scenes"

COLUMNS = 5

FPS = 12.0

LABEL = 14
"""Height of a name below its picture [px]."""


def animations(cells=128, width=160, device=None):
    """The scenes by name, each an `Animation` of frames `width` pixels wide."""
    found = {}
    for path in sorted(SCENES.glob("*.toml")):
        settings = [f"fluid.cells={cells}", f"frames.width={width}", f"time.fps={FPS}"]
        scene = read_scene(path).with_values(settings)
        if "keyframes" not in scene.tables:  # their forces are searched for, on a fine grid
            found[path.stem] = stage(scene, device)
    return found


def sheet(pictures, height):
    """Named pictures of one width in rows of `COLUMNS`, cut or padded to one height, names below."""
    tiles = []
    for name, picture in pictures.items():
        tile = np.zeros((height + LABEL, picture.width, 3), dtype=np.float32)
        part = picture.pixels[:height, :, :3]
        top = (height - part.shape[0]) // 2
        tile[top : top + part.shape[0]] = part
        image = oiio.ImageBuf(tile)
        oiio.ImageBufAlgo.render_text(image, 3, height + LABEL - 4, name, LABEL - 3, "", (0.8, 0.8, 0.8))
        tiles.append(image.get_pixels(oiio.FLOAT).reshape(tile.shape))
    tiles += [np.zeros_like(tiles[0])] * (-len(tiles) % COLUMNS)
    rows = [np.concatenate(tiles[n : n + COLUMNS], axis=1) for n in range(0, len(tiles), COLUMNS)]
    return Picture(np.concatenate(rows), dtype="uint8")


def check(frames):
    """Everything moves, nothing folds, and areas change only in scenes that grow or shrink.

    `frames` are the lists of frames by scene. Returns the longest displacement of each [longer side].
    """
    figures = {}
    for name, shown in frames.items():
        quality = [frame.quality for frame in shown]
        figures[name] = round(max(q.displacement_max for q in quality), 3)
        assert figures[name] > 0.005, (name, figures[name])
        least, most = min(q.jacobian_min for q in quality), max(q.jacobian_max for q in quality)
        assert least > 0.1, (name, least)
        if name == "grow":
            assert most > 2.5 and least < 0.4, (least, most)  # 1 / 0.55^2 is 3.3, 1 / 1.8^2 is 0.31
        if name in ("vortex", "wind", "noise"):
            assert 0.9 < least and most < 1.1, (name, least, most)
    return figures


def main():
    """Write the sheet and check it."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--output", default="scenes.gif", help="x.gif or x.####.png (scenes.gif)")
    parser.add_argument("--frames", type=int, default=24, help="frames to make, at 12 a second (24)")
    parser.add_argument("--cells", type=int, default=128, help="cells along the longer side (128)")
    parser.add_argument("--width", type=int, default=160, help="width of each scene [px] (160)")
    parser.add_argument("--device", default=None, help="cpu (default), cuda, …")
    options = parser.parse_args()
    if options.frames < 2:
        parser.error("--frames: expected 2 or more")
    frames = {
        name: list(made.frames())
        for name, made in animations(options.cells, options.width, device=options.device).items()
    }
    height = round(options.width * 0.75)

    def sheets():
        for n in range(options.frames):
            shown = {name: made[n * len(made) // options.frames] for name, made in frames.items()}
            picture = sheet({name: frame.picture for name, frame in shown.items()}, height)
            first = shown[next(iter(shown))]
            yield Frame(n, n / FPS, picture, first.map, first.quality, None)

    written = write_animation(options.output, sheets(), fps=FPS)
    print(f"{written[-1]}: {', '.join(frames)}")
    print(check(frames))
    return 0


if __name__ == "__main__":
    sys.exit(main())

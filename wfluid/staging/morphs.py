"""The morph of a scene: its two pictures, its settings, and points of the second picture."""

from __future__ import annotations

from wfluid.domain.paths import Place
from wfluid.morphing.settings import MorphSettings
from wfluid.pictures.pairing import PicturePair, paired
from wfluid.scene.keyframes import Curve, MorphTable
from wfluid.scene.scene import Scene
from wfluid.scene.schema import blame
from wfluid.staging.drawing import Drawing
from wfluid.staging.images import SceneImages, frame_size, read_noted


def pair_of(scene: Scene, morph: MorphTable, images: SceneImages) -> PicturePair:
    """The two pictures of a morph.

    Raises:
        PictureError: the second cannot be read.
        SchemaError: a size of another aspect.
    """
    other = read_noted(scene.folder, morph.to, images.note, scene.picture.colorspace)
    pair = paired(images.picture, other, morph.fit)
    for text in pair.notes:
        images.note(text)
    frame_size(morph.size, "morph", other)
    return pair


def settings_of(scene: Scene, morph: MorphTable, images: SceneImages) -> MorphSettings:
    """Timing, curves and blending of a morph.

    Raises:
        SchemaError: keys of a curve at one time, a mask that cannot be used.
        ValueError: a delay without a mask.
    """
    if morph.timing is None and morph.gives("delay"):
        raise ValueError("delay needs a timing mask: give timing, or leave delay out")
    with blame("morph", "warp_curve"):
        warp_curve = _curve(morph.warp_curve)
    with blame("morph", "blend_curve"):
        blend_curve = _curve(morph.blend_curve)
    with blame("morph", "timing"):
        mask = None if morph.timing is None else images.painted(morph.timing)
    return MorphSettings(
        scene.timeline,
        warp_curve=warp_curve,
        blend_curve=blend_curve,
        blend=morph.blend,
        mask=mask,
        delay=morph.delay,
        reverse=morph.reverse,
        pingpong=morph.pingpong,
    )


def _curve(curve: Curve) -> str | dict[float, float]:
    """A curve's name, or its values by time."""
    if isinstance(curve, str):
        return curve
    keys = dict(curve)
    if len(keys) < len(curve):
        raise ValueError("two keys have one time")
    return keys


def place_in_second(place: Place, morph: MorphTable, pair: PicturePair, drawing: Drawing) -> Place:
    """The place in the frame [longer side] of a point of the second picture [px of `morph.size`]."""
    (width, height), size = pair.size, morph.size or pair.size
    return pair.place((place[0] / size[0] * width, place[1] / size[1] * height), drawing.extent)

"""Layers, mattes and points follow the picture's map; densities are composited over it."""

import numpy as np
import pytest

from wfluid.animation.animation import Animation
from wfluid.domain.timeline import Timeline
from wfluid.model.densities import Density, Source
from wfluid.model.fluid import Fluid
from wfluid.model.gaussian_forces import GaussianForce, VortexForce
from wfluid.pictures.picture import Picture
from wfluid.pictures.stills import read_picture, write_picture
from wfluid.staging.images import SceneImages
from wfluid.view.densities import composite_densities, upsample


def picture(height=48, width=64, channels=3, seed=0, **settings):
    pixels = np.random.default_rng(seed).random((height, width, channels)).astype(np.float32)
    return Picture(pixels, settings.get("alpha"), "uint8", None)


def test_a_layer_is_warped_by_the_same_map(device):
    """The picture as a layer gives the frames bit for bit; other sizes are resized to the frames."""
    source = picture()
    force = VortexForce((0.5, 0.35), 8.0, 0.1)
    layers = {"same": source, "coarse": picture(24, 32, seed=1), "grey": picture(48, 64, 1)}
    made = Animation(
        source, Fluid(), [force], Timeline(0.4, 10), cells=32, layers=layers, device=device.alias
    )
    frames = list(made.frames())
    for frame in frames:
        np.testing.assert_array_equal(frame.layers["same"].pixels, frame.picture.pixels)
        assert frame.layers["coarse"].pixels.shape == (48, 64, 3)
        assert frame.layers["grey"].pixels.shape == (48, 64, 1)
    assert np.abs(frames[-1].picture.pixels - source.pixels).max() > 0.1


def test_a_matte_stays_on_its_object(device):
    """The warped matte of a disc fits the edge of the warped disc."""
    y, x = np.mgrid[:96, :96]
    disc = ((x - 44) ** 2 + (y - 48) ** 2 < 20**2).astype(np.float32)[..., None]
    made = Animation(
        Picture(np.repeat(disc, 3, axis=2), None, "uint8", None),
        Fluid(),
        [GaussianForce((0.46, 0.5), (4.0, 2.0), 0.15)],
        Timeline(0.4, 10),
        cells=48,
        layers={"matte": Picture(disc, None, "uint8", None, data=True)},
        device=device.alias,
    )
    last = list(made.frames())[-1]
    assert np.abs(last.picture.pixels[..., :1] - disc).max() > 0.9
    np.testing.assert_allclose(last.layers["matte"].pixels[..., 0], last.picture.pixels[..., 0], atol=1e-6)


def test_points_follow_the_picture(device):
    """A bright dot at p moves with the tracked point that starts at p."""
    pixels = np.zeros((96, 128, 3), dtype=np.float32)
    y, x = np.mgrid[:96, :128] + 0.5
    pixels[:] = np.exp(-((x - 70) ** 2 + (y - 40) ** 2) / (2 * 1.3**2))[..., None]
    made = Animation(
        Picture(pixels, None, "uint8", None),
        Fluid(),
        [GaussianForce((0.55, 0.32), (3.0, 2.0), 0.1)],
        Timeline(0.5, 10),
        cells=64,
        points=[(70 / 128, 40 / 128)],
        device=device.alias,
    )
    last = list(made.frames())[-1]
    light = last.picture.pixels[..., 0]
    seen = np.array([(light * x).sum(), (light * y).sum()]) / light.sum()
    assert np.hypot(*(seen - (70, 40))) > 10
    np.testing.assert_allclose(last.points[0] * 128, seen, atol=0.4)


def test_a_data_layer_keeps_its_numbers(tmp_path):
    """A grey matte keeps its codes; a colour layer is a picture in linear light."""
    matte, colours = tmp_path / "matte.png", tmp_path / "colours.png"
    codes = (np.arange(64 * 48).reshape(48, 64, 1) % 256 / 255).astype(np.float32)
    write_picture(matte, Picture(codes, None, "uint8", None, data=True))
    write_picture(colours, picture())
    paintings = SceneImages(read_picture(colours), tmp_path)
    layer = paintings.layer("matte.png", None)
    assert layer.data
    np.testing.assert_allclose(layer.pixels, codes, atol=1e-6)
    write_picture(tmp_path / "again.png", layer)
    assert (tmp_path / "again.png").read_bytes() == matte.read_bytes()
    assert not paintings.layer("colours.png", None).data and paintings.layer("colours.png", True).data


def test_ink_lets_through_a_power_of_its_colour():
    """The Beer-Lambert law: color^rho, in linear light."""
    source = picture()
    rho = np.full((12, 16), 2.0)
    shown = composite_densities(source, [Density(color=(0.5, 0.25, 1.0))], [rho])
    np.testing.assert_allclose(shown.pixels, source.pixels * (0.25, 0.0625, 1.0), rtol=1e-5)
    assert composite_densities(source, [Density()], [0 * rho]).pixels is source.pixels


def test_smoke_covers_and_is_visible_over_transparent_places():
    """Smoke covers the picture with opacity 1 - exp(-rho), and gives it to transparent places."""
    pixels = np.zeros((8, 8, 4), dtype=np.float32)
    pixels[:4] = (0.2, 0.4, 0.6, 1.0)
    density = Density(color=(1.0, 0.5, 0.0), look="smoke")
    shown = composite_densities(Picture(pixels, 3, "uint8", None), [density], [np.full((4, 4), 0.7)]).pixels
    cover = 1 - np.exp(-0.7)
    np.testing.assert_allclose(
        shown[0, 0], (0.2 + 0.8 * cover, 0.4 + 0.1 * cover, 0.6 - 0.6 * cover, 1), atol=1e-6
    )
    np.testing.assert_allclose(shown[7, 7], (cover, 0.5 * cover, 0, cover), atol=1e-6)


@pytest.mark.parametrize("periodic", [(False, False), (True, True)])
def test_stretching_keeps_constants_lines_and_the_range(periodic):
    """A cubic B-spline reproduces lines inside and stays within the range of its values."""
    assert np.allclose(upsample(np.full((5, 7), 3.0), 40, 31, periodic), 3.0)
    line = np.broadcast_to(np.arange(16.0), (12, 16))
    across = upsample(line, 64, 48, periodic)[24]
    np.testing.assert_allclose(across[12:52], ((np.arange(64) + 0.5) / 4 - 0.5)[12:52], atol=1e-5)
    values = np.random.default_rng(0).random((9, 11))
    assert values.min() <= upsample(values, 50, 70, periodic).min()
    wave = np.sin(2 * np.pi * (np.arange(16) + 0.5) / 16)
    if periodic[0]:
        wide = upsample(np.broadcast_to(wave, (4, 16)), 160, 4, periodic)[0]
        assert abs((wide[0] - wide[-1]) - (wide[1] - wide[0])) < 0.01


def test_the_densities_of_an_animation_are_visible(device):
    fluid = Fluid(
        densities=[Density("fog", sources=[Source((0.5, 0.35), 20.0, 0.1)], look="smoke", color=(1, 1, 1))]
    )
    dark = Picture(np.zeros((48, 64, 3), dtype=np.float32), None, "uint8", None)
    frames = list(Animation(dark, fluid, [], Timeline(0.3, 10), cells=32, device=device.alias).frames())
    assert frames[0].picture.pixels.max() == 0
    assert frames[-1].densities["fog"].max() == pytest.approx(6.0, rel=0.02)
    assert frames[-1].picture.pixels[22, 32].min() > 0.95 and frames[-1].picture.pixels[0, 0].max() < 0.05

"""Blends of two pictures, in linear light or in display values."""

import numpy as np
import pytest

from wfluid import Picture
from wfluid.domain.limits import BLEND_SPACES
from wfluid.pictures.blend import blended, check_light

HALF_GREY = ((0.5 + 0.055) / 1.055) ** 2.4
"""Linear light of the sRGB value 0.5 (IEC 61966-2-1)."""


def noise(seed, channels=3, alpha=None):
    """Random premultiplied colours: alpha 0.2 … 1, colours 0.1 … 0.9 of alpha."""
    rng = np.random.default_rng(seed)
    pixels = rng.uniform(0.1, 0.9, (6, 9, channels)).astype(np.float32)
    if alpha is not None:
        pixels[..., alpha] = 1
        pixels *= rng.uniform(0.2, 1, (6, 9, 1)).astype(np.float32)
    return Picture(pixels, alpha=alpha)


def shown(light):
    """sRGB of light, by its definition, in double precision."""
    light = np.asarray(light, np.float64)
    return np.where(light <= 0.0031308, 12.92 * light, 1.055 * light ** (1 / 2.4) - 0.055)


def flatten(value, channels=3, **settings):
    return Picture(np.full((2, 3, channels), value, np.float32), **settings)


@pytest.mark.parametrize("alpha", [None, 3])
def test_linear_light_is_mixed_by_weights(alpha):
    """(1 - w) a + w b, of premultiplied colours and of alpha alike."""
    a, b = noise(0, 4, alpha), noise(1, 4, alpha)
    for weight in (0.25, 0.7):
        wanted = (1 - weight) * a.pixels.astype(float) + weight * b.pixels.astype(float)
        np.testing.assert_allclose(blended(a, b, weight).pixels, wanted, rtol=0, atol=2e-7)


def test_half_black_half_white_is_half_the_light_or_half_the_code():
    black, white = flatten(0), flatten(1)
    np.testing.assert_allclose(blended(black, white, 0.5, "linear").pixels, 0.5, rtol=1e-6)
    np.testing.assert_allclose(blended(black, white, 0.5, "display").pixels, HALF_GREY, rtol=1e-6)


def test_display_values_are_mixed_by_weights():
    a, b = noise(0), noise(1)
    mixed = shown(blended(a, b, 0.3, "display").pixels)
    np.testing.assert_allclose(mixed, 0.7 * shown(a.pixels) + 0.3 * shown(b.pixels), rtol=0, atol=1e-6)


def test_display_values_are_of_straight_colours_and_alpha_is_mixed_linearly():
    """Transparent white and opaque black: sRGB codes weighted by alpha, as in a display's compositor."""
    a, b = noise(0, 4, 3), noise(1, 4, 3)
    mixed = blended(a, b, 0.3, "display").pixels.astype(float)
    codes = [shown(one.pixels[..., :3] / one.pixels[..., 3:]) * one.pixels[..., 3:] for one in (a, b)]
    alpha = 0.7 * a.pixels[..., 3] + 0.3 * b.pixels[..., 3]
    np.testing.assert_allclose(mixed[..., 3], alpha, atol=1e-6)
    np.testing.assert_allclose(
        shown(mixed[..., :3] / alpha[..., None]) * alpha[..., None],
        0.7 * codes[0] + 0.3 * codes[1],
        atol=2e-6,
    )


@pytest.mark.parametrize("light", BLEND_SPACES)
def test_transparent_pixels_contribute_no_colour(light):
    """A transparent pixel reduces the other's alpha and keeps its straight colour."""
    clear, red = np.zeros((2, 3, 4), np.float32), np.zeros((2, 3, 4), np.float32)
    red[..., [0, 3]] = 1
    mixed = blended(Picture(clear, alpha=3), Picture(red, alpha=3), 0.25, light).pixels
    np.testing.assert_allclose(mixed, red * 0.25, atol=1e-6)


@pytest.mark.parametrize("light", BLEND_SPACES)
@pytest.mark.parametrize("alpha", [None, 3])
def test_a_weight_of_0_or_1_gives_a_picture_bit_for_bit(light, alpha):
    a, b = noise(0, 4, alpha), noise(1, 4, alpha)
    for zero, one in ((0, 1), (0.0, 1.0), (np.zeros((6, 9)), np.ones((6, 9)))):
        np.testing.assert_array_equal(blended(a, b, zero, light).pixels, a.pixels)
        np.testing.assert_array_equal(blended(a, b, one, light).pixels, b.pixels)


@pytest.mark.parametrize("light", BLEND_SPACES)
def test_every_pixel_has_its_own_weight(light):
    """Each pixel is blended by its own weight."""
    a, b, weight = noise(0), noise(1), np.random.default_rng(2).random((6, 9))
    weight[0, :2] = 0, 1
    mixed = blended(a, b, weight, light).pixels
    for row, column in np.ndindex(weight.shape):
        alone = blended(a, b, float(weight[row, column]), light).pixels[row, column]
        np.testing.assert_allclose(mixed[row, column], alone, rtol=0, atol=1e-6)


def test_both_spaces_give_the_same_for_equal_pictures():
    """To the accuracy of the transfer function and its inverse in single precision."""
    a = noise(0)
    for light in BLEND_SPACES:
        np.testing.assert_allclose(blended(a, a, 0.37, light).pixels, a.pixels, rtol=2e-6)


def test_data_is_mixed_without_display_values():
    a, b = flatten(0.0, data=True), flatten(1.0, data=True)
    np.testing.assert_allclose(blended(a, b, 0.5, "display").pixels, 0.5, rtol=1e-6)


def test_a_blend_has_the_type_and_metadata_of_the_first_picture():
    a, b = flatten(0.2, dtype="uint8"), flatten(0.4, dtype="half")
    for weight in (0, 0.5, 1):
        assert blended(a, b, weight).dtype == "uint8"


def test_an_unknown_space_is_refused():
    with pytest.raises(ValueError, match="blend in 'gamma' light: expected one of linear, display"):
        check_light("gamma")

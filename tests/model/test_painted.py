"""Painted quantities: intensity, resampling, freeze masks, values over time."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from wfluid import Fluid, Freeze, Grid, Keyed, Painted, Picture, read_picture, write_picture
from wfluid.model.painted import sample_at
from wfluid.pictures.color import to_linear
from wfluid.pictures.picture import intensity

GRID = Grid(8, 6, 1.0, 0.75)


def shown(values, dtype="uint8", alpha=None):
    """A picture whose file has the given numbers, 0 … 1."""
    values = np.asarray(values, dtype=np.float32)
    return Picture(to_linear(values) if dtype in ("uint8", "uint16") else values, alpha, dtype)


def test_intensity_is_the_luminance_relative_to_the_range_of_the_type(tmp_path):
    """Rec. 709 weights on display values; half of the range is 1/2, independent of the other pixels."""
    colours = np.array([[[1, 0, 0], [0, 1, 0]], [[0, 0, 1], [0.5, 0.5, 0.5]]], dtype=np.float32)
    np.testing.assert_allclose(intensity(shown(colours)), [[0.2126, 0.7152], [0.0722, 0.5]], atol=1e-6)
    flat = np.full((2, 2, 1), 128 / 255)
    for dtype, name in (("uint8", "a.png"), ("uint16", "b.png"), ("float", "c.exr"), ("half", "d.exr")):
        write_picture(tmp_path / name, shown(flat, dtype))
        np.testing.assert_allclose(intensity(read_picture(tmp_path / name)), 128 / 255, atol=3e-4)
    linear = read_picture(tmp_path / "a.png", colorspace="linear")  # the same numbers, read as light
    np.testing.assert_allclose(intensity(linear), 128 / 255, atol=1e-6)


def test_transparent_places_have_intensity_0():
    straight = np.array([[[1.0, 1.0], [1.0, 0.25], [0.5, 0.0]]])  # grey and alpha
    premultiplied = straight * np.array([[[1.0], [0.25], [0.0]]])
    picture = Picture(np.dstack([premultiplied[..., 0], straight[..., 1]]).astype(np.float32), 1, "uint8")
    np.testing.assert_allclose(intensity(picture), [[1.0, 0.25, 0.0]], atol=1e-6)


def test_values_above_the_range_are_clamped():
    np.testing.assert_allclose(intensity(shown([[[4.0], [0.5]]], "float")), [[1.0, 0.5]])


@given(arrays(np.float64, (12, 16), elements=st.floats(0, 1)))
def test_a_painting_keeps_its_mean_and_its_range_at_any_size(values):
    """Averaged onto fewer cells or interpolated onto more, values do not overshoot and keep their mean."""
    for grid in (Grid(8, 6), Grid(16, 12), Grid(37, 23)):
        on = Painted(values).sample(grid)
        assert on.shape == (grid.ny, grid.nx)
        assert values.min() - 1e-6 <= on.min() and on.max() <= values.max() + 1e-6
    constant = Painted(np.full((5, 9), 0.3)).sample(GRID)
    np.testing.assert_allclose(constant, 0.3, rtol=1e-6)


def test_shrinking_does_not_alias():
    """A checkerboard of single pixels becomes grey, not stripes."""
    board = np.indices((120, 160)).sum(axis=0) % 2.0
    np.testing.assert_allclose(Painted(board).sample(GRID)[1:-1, 1:-1], 0.5, atol=0.02)


def test_values_stay_at_their_place():
    """A square over three by three cells has its full value in the middle and 0 two cells away."""
    values = np.zeros((60, 80))
    values[10:40, 40:70] = 1.0
    on = Painted(values, scale=3.0).sample(GRID)
    assert np.unravel_index(on.argmax(), on.shape) == (2, 5) and on[2, 5] == pytest.approx(3.0)
    assert on[:, :3].max() == 0 and on[5].max() == 0


def test_scale_floor_and_inversion():
    values = np.array([[0.0, 0.25], [0.5, 1.0]])
    np.testing.assert_allclose(Painted(values, 4.0).values, [[0, 1], [2, 4]])
    np.testing.assert_allclose(Painted(values, 4.0, invert=True).values, [[4, 3], [2, 0]])
    np.testing.assert_allclose(Painted(values, 4.0, floor=2.0).values, [[2, 2.5], [3, 4]])


def test_freezing_is_drag_on_a_logarithmic_scale():
    """Drag is (1 + strength)^m - 1: 0 for m = 0, the strength for m = 1, equal ratios for equal steps."""
    mask = np.array([[0.0, 0.25], [0.5, 1.0]])
    drag = Freeze(mask, 9999.0).sample(Grid(4, 4))[::3, ::3]
    np.testing.assert_allclose(drag[0, 0], 0.0, atol=1e-9)
    np.testing.assert_allclose(drag[1, 1], 9999.0, rtol=1e-6)
    np.testing.assert_allclose((1 + drag[0, 1]) ** 2, 1 + drag[1, 0], rtol=1e-5)


def test_keys_are_interpolated_linearly_and_constant_outside():
    low, high = np.zeros((6, 8)), np.ones((6, 8))
    keyed = Keyed({1.0: high, 0.5: low, 3.0: 0.25})
    for t, expected in ((0.0, 0.0), (0.5, 0.0), (0.625, 0.25), (1.0, 1.0), (2.0, 0.625), (9.0, 0.25)):
        np.testing.assert_allclose(sample_at(keyed, GRID, t), expected)


def test_a_function_of_time_may_return_any_quantity():
    for given_back in (0.5, np.full((3, 3), 0.5), Painted(np.ones((2, 2)), 0.5), Keyed({0.0: 0.5})):
        np.testing.assert_allclose(sample_at(lambda t, g=given_back: g, GRID, 1.0), 0.5)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Fluid(viscosity=-0.1), "viscosity -0.1: expected 0 … 1000"),
        (lambda: Fluid(viscosity=float("nan")), "viscosity nan"),
        (lambda: Fluid(viscosity=np.array([[0.1, -0.2]])), "-0.2: expected finite numbers from 0 on"),
        (lambda: Fluid(viscosity=np.array([[0.1, np.inf]])), "inf: expected finite"),
        (lambda: Fluid(viscosity=np.array([[0.1, np.nan]])), "nan: expected finite"),
        (lambda: Fluid(viscosity=np.array([[0.1, 2000.0]])), "viscosity up to 2000: expected 0 … 1000"),
        (lambda: Fluid(viscosity=np.zeros((2, 2, 3))), r"shape \(2, 2, 3\)"),
        (lambda: Fluid(viscosity=np.zeros((0, 4))), r"shape \(0, 4\)"),
        (lambda: Painted(np.ones((2, 2)), scale=-1.0), "scale with -1.0"),
        (lambda: Painted(np.full((2, 2), 2.0), invert=True), "cannot be inverted"),
        (lambda: Painted(np.ones((2, 2)), scale=0.1, floor=0.2), "above scale"),
        (lambda: Painted(shown([[[-0.5]]], "float")), "-0.5 has no intensity"),
        (lambda: Painted(shown([[[np.nan]]], "float")), "nan has no intensity"),
        (lambda: Freeze(np.full((3, 3), 1.0)), "painted all over"),
        (lambda: Freeze(np.array([[0.0, 1.5]])), "up to 1.5: expected 0 … 1"),
        (lambda: Freeze(np.array([[0.0, -0.5]])), "-0.5"),
        (lambda: Freeze(np.array([[0.0, 1.0]]), strength=-1.0), "strength -1.0"),
        (lambda: Freeze(np.array([[0.0, 1.0]]), strength=float("nan")), "strength nan"),
        (lambda: Keyed({}), "expected values at one finite time"),
        (lambda: Keyed({float("inf"): 0.1}), "finite time"),
        (lambda: Keyed({0.0: -0.1}), "keyed value -0.1"),
        (lambda: sample_at(lambda t: -t, GRID, 2.0), "viscosity at 2 s -2.0"),
    ],
)
def test_invalid_viscosities_and_masks_are_refused(make, message):
    with pytest.raises(ValueError, match=message):
        make()


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Fluid(viscosity="thick"), "expected a number, an array"),
        (lambda: Fluid(viscosity=shown([[[0.5]]])), "a picture needs a scale"),
        (lambda: Fluid(freeze=np.zeros((2, 2))), r"expected Freeze\(mask\)"),
    ],
)
def test_other_things_are_a_type_error(make, message):
    with pytest.raises(TypeError, match=message):
        make()


def test_a_viscosity_that_becomes_invalid_stops_the_run_with_its_time(make_solver):
    solver = make_solver(8, 6, viscosity=lambda t: 0.1 - t)
    a, b = solver.rest(), solver.rest()
    solver.step(a, b, [], 0.0, 0.05)
    with pytest.raises(ValueError, match=r"viscosity at 0\.15 s -0\.0"):
        solver.step(b, a, [], 0.05, 0.1)

"""Drawn forces are checked as a scene's are."""

import pytest

from wfluid.scene.forces import NoiseTable, PushTable
from wfluid.staging.drawing import Drawing

PUSH = {"kind": "push", "center": [30, 20], "by": [5, 0]}


@pytest.mark.parametrize(
    ("keys", "says"),
    [
        ({"raduis": 3}, "raduis: no such key; did you mean radius?"),
        ({"period": -1}, "period: -1: expected a number from 0.001"),
        ({"start": -1}, "start: -1: expected a number from 0"),
        ({"kind": "psuh"}, "kind: 'psuh': expected one of push, vortex"),
        ({"at": 0.1, "rise": 0}, "at= is an impulse: leave out"),
        ({"phase": 0.25}, "phase= needs period="),
    ],
)
def test_a_dictionary_of_a_force_is_checked(keys, says):
    with pytest.raises(ValueError) as error:
        Drawing(60, 40, duration=1.0).force({**PUSH, **keys})
    assert says in str(error.value)


def test_a_dictionary_draws_what_its_table_draws():
    drawing = Drawing(60, 40, duration=1.0)
    assert drawing.force(PUSH) == drawing.force(PushTable(center=(30, 20), by=(5, 0)))


def test_noise_that_names_no_seed_has_the_one_that_is_given():
    drawing = Drawing(60, 40, duration=1.0)
    assert drawing.force(NoiseTable(amount=3), 7).seed == 7
    assert drawing.force(NoiseTable(amount=3, seed=0), 7).seed == 0


def test_a_force_with_a_picture_needs_the_reader_of_pictures():
    """A drawing has one only if it is given."""
    with pytest.raises(ValueError, match=r"needs Drawing\(…, images=SceneImages\(…\)\)"):
        Drawing(60, 40, 1.0).force({"kind": "image", "file": "a.png"})
    with pytest.raises(ValueError, match="with a picture or a mask"):
        Drawing(60, 40, 1.0).force({"kind": "wind", "by": [1, 0], "mask": "a.png"})

"""Checks of a user's values."""

import pytest

from wfluid.domain.checks import check_word
from wfluid.pictures.formats import Encoding, PictureError
from wfluid.system.errors import FileError


def test_known_words_are_accepted_and_others_refused():
    check_word("fit", "fill", ("fill", "fit"))
    with pytest.raises(ValueError, match=r"^fit 'full': expected one of fill, fit$"):
        check_word("fit", "full", ("fill", "fit"))


def test_the_type_of_the_error_can_be_chosen():
    with pytest.raises(PictureError, match="type 'int': expected one of uint8"):
        Encoding(type="int")
    assert issubclass(PictureError, FileError)

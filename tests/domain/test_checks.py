"""Checks of what a user gives."""

import pytest

from wfluid.domain.checks import check_word
from wfluid.pictures.formats import Encoding, PictureError
from wfluid.system.errors import FileError


def test_a_word_is_one_of_those_known():
    check_word("fit", "fill", ("fill", "fit"))
    with pytest.raises(ValueError, match=r"^fit 'full': expected one of fill, fit$"):
        check_word("fit", "full", ("fill", "fit"))


def test_a_word_of_a_file_is_refused_as_one_of_it():
    with pytest.raises(PictureError, match="type 'int': expected one of uint8"):
        Encoding(type="int")
    assert issubclass(PictureError, FileError)

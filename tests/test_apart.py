"""What is marked float64 or beside runs in processes of its own: precision is chosen once a process."""

import pytest


@pytest.mark.parametrize("mark", ["float64", "beside"])
def test_what_is_marked_holds_in_its_own_process(apart, mark):
    code, said = apart.result(mark)
    assert code == 0, said[-4000:]
    assert " passed" in said or "[100%]" in said, f"no test marked {mark} ran"

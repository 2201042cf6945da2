"""What needs double precision runs in a process of its own: precision is chosen once a process."""


def test_what_is_marked_float64_holds_in_double_precision(double_precision):
    code, said = double_precision.result()
    assert code == 0, said[-4000:]
    assert " passed" in said or "[100%]" in said, "no test ran in double precision"

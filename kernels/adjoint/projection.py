"""The adjoint of projection (`projection`): D and G are each other's transposes but for the sign, so it is
made of the same programs. Only the pressure that is kept from one step to the next needs one of its own.
"""

from wfluid.kernels.cell.native import inside
from wfluid.kernels.cell.program import adjoint_cells
from wfluid.kernels.cell.real import Field, Uniform


@adjoint_cells
def take(
    i: int,
    j: int,
    k: int,
    q_bar: Field,
    # outputs
    b: Field,
):
    """Take q_bar, the gradient of the pressure found, off b, in place."""
    k = inside(k)
    b[k] = b[k] - q_bar[k]


@adjoint_cells
def kept_difference(
    i: int,
    j: int,
    k: int,
    q_bar: Field,
    minus_div: Field,
    kept: Uniform,
    # outputs
    out: Field,
):
    """Out = kept (q_bar - minus_div): transposes v - kept grad q, and q_new = q_projected + kept q."""
    k = inside(k)
    out[k] = kept * (q_bar[k] - minus_div[k])

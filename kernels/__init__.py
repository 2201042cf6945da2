"""Device code only: one file a stage, each a program per cell. See README.md for the cell.

Importing the package registers every program, so that each module is built once, with all its programs.
"""

from wfluid.kernels import adjoint, solve, step, view

__all__ = ["adjoint", "solve", "step", "view"]

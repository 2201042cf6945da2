"""Operators, sweeps, transfers and sums of linear solves."""

from wfluid.kernels.solve import algebra, dense, five_point, krylov, stress, sums, transfer

__all__ = ["algebra", "dense", "five_point", "krylov", "stress", "sums", "transfer"]

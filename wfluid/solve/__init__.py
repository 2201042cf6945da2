"""Linear solves: multigrid, Chebyshev sweeps, conjugate gradients, Jacobi."""

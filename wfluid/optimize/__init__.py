"""L-BFGS and its line search: a library of its own."""

"""L-BFGS and its line search, independent of the other packages."""

"""Forces that take points to their targets."""

"""One step of the fluid and its adjoint."""

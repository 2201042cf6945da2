"""Arrays on a device: fields, ghosts, state, captured graphs."""

"""Space and time as descriptions: grid, walls, timeline, envelopes, paths. NumPy only."""

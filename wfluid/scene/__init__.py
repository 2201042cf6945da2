"""Scene files: their tables and keys, reading, checking and writing."""

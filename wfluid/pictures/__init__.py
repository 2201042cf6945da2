"""Pictures: read, written, encoded, paired and blended."""

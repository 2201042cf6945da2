"""From a fluid and its forces to frames."""

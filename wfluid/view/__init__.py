"""The picture seen through a map."""

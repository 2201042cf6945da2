"""A scene made into objects."""

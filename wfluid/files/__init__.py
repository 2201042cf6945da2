"""Animations, tracks and points as files."""

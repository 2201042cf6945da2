"""Morphs: one picture flows into another."""

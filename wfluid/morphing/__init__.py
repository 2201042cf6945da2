"""One picture flows into another."""

"""Scenes made into animations: files read, pixels turned into domain units."""

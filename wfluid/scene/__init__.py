"""What a scene file says, and how it is checked."""

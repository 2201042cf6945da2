"""What moves and resists, as descriptions: fluid, densities, forces."""

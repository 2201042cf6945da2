"""The physical model as frozen descriptions: fluid, densities, forces."""

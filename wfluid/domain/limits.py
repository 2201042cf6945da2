"""Choices, limits and defaults that the engine, scenes and the command line share. Loads no numpy.

Those of time are in `timeline`, those of the grid in `grid`, of walls in `walls`.
"""

from __future__ import annotations

# Fluid

SCHEMES = ("standard", "paper")
"""How the equations are discretised."""

SOLVERS = ("multigrid", "jacobi")
"""What solves for pressure and diffusion."""

CYCLES, CYCLES_LIMIT = 3, 100
"""Multigrid cycles a projection, and the most that a scene may ask for."""

VISCOSITY = 0.001
"""Viscosity of a fluid that names none [longer side^2/s]."""

PAINTED_VISCOSITY = 0.1
"""Viscosity of a white place where nothing says it: over 6 % of the longer side it stops a motion in
1/30 s."""

KEYFRAME_VISCOSITY = 0.005
"""Viscosity of `wfluid keyframes` where none is given [longer side^2/s]: strains spread wider."""

MORPH_VISCOSITY = 0.03
"""Of a morph's fluid where none is given [longer side^2/s]: what lies around points goes with them, so that
features keep their shape."""

VISCOSITY_LIMIT = 1e3
"""Largest viscosity the solver is tested with [longer side^2/s]."""

DRAG, DRAG_LIMIT = 1e4, 1e6
"""Drag of full paint [1/s]: at 24 steps a second what is painted moves 1/400 of what is around it; and the
largest the solver is tested with."""

# Densities

LOOKS = ("ink", "smoke")
"""How a density is seen: it colours the light, or covers what is behind."""

INK, INK_CODE = (0.02, 0.02, 0.08), "#27274f"
"""Colour of a density that names none, in linear light; and the nearest that a scene can write."""

# Forces

IMAGE_FORCES = ("gradient", "contour", "vectors")
"""What a force from a picture follows."""

RADIUS = 0.06
"""Radius of a drawn force that names none [longer side]."""

NOISE_SCALE = 0.2
"""Mean wavelength of drawn noise that names none [longer side]."""

IMAGE_LENGTH = 0.02
"""How far a force from a picture carries its strongest place where nothing says it [longer side]."""

IMAGE_BLUR = 0.01
"""Sigma of the blur before slopes are taken [longer side]: about three pixels of a grid of 256."""

LEAST_TIME = 0.001
"""Shortest period or window of a drawn force [s]."""

AMOUNT_LIMIT = 1000.0
"""Most density that a source may pour, or a picture paint."""

# Frames

SIZE_LIMIT = 32768
"""Longest side of a frame [px]."""

FIRST_FRAME = 1001
"""Number of the first frame of a sequence (the convention of film work)."""

# Keyframes and morphs

TOLERANCE = 0.25 / 512
"""Residual of a keyframe that is good enough [longer side]: a quarter of a pixel of a picture of 512."""

MORPH_TOLERANCE = 0.5 / 512
"""The same of a morph's points."""

LINEAR, EASE = "linear", "ease"

CURVES = (LINEAR, EASE)
"""Curves with a name."""

DELAY, DELAY_LIMIT = 0.5, 0.9
"""By how much of the time black of a timing mask is behind white, and the most it may."""

BLEND_SPACES = ("linear", "display")
"""What is mixed: light, or the numbers that a display is sent (sRGB)."""

FITS = ("fill", "fit", "stretch")
"""How a second picture covers the frame: cut off what is over; leave bars; change the aspect."""

"""Choices, limits and defaults that the engine, scenes and the command line share. Loads no numpy.

The command line shows them as defaults, so this file imports nothing.
"""

from __future__ import annotations

# Grid and walls

LEAST_CELLS = 4
"""Cells along an axis below which a cubic stencil no longer fits."""

CELLS, CELLS_LIMIT = 256, 8192
"""Default number of cells along the longer side, and the largest: indices are 32-bit."""

WALLS = ("free-slip", "no-slip", "periodic")
"""Boundary conditions of an axis."""

# Time

STEPS_PER_SECOND = 96
"""Steps a second when `substeps` is not given: a step of 1/96 s keeps the splitting error small."""

KEYFRAME_STEPS = 48
"""Default steps a second, at least, of a scene with keyframes."""

FPS = 24.0
"""Default frame rate of a `Timeline`, and of `animate` [1/s]: the cinema's."""

SCENE_FPS = 15.0
"""Default frame rate of scenes and command lines [1/s]: the size of a GIF grows with every frame."""

LEAST_FPS, FPS_LIMIT = 0.01, 1000.0
"""Smallest and largest frame rate [1/s]."""

SUBSTEPS_LIMIT = 100_000
"""Most steps a frame that a scene may ask for."""

LOOPS = ("oscillate", "pingpong", "crossfade")
"""Ways to close a loop."""

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

# Pictures and frames

COLORSPACES = ("auto", "srgb", "linear", "data")
"""Colour spaces of a picture's numbers."""

TYPES = ("uint8", "uint16", "half", "float")
"""Number types a picture is written with."""

QUALITY_LIMIT = 100
"""Best quality of a lossy format; 1 is the poorest."""

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

"""Choices, limits and defaults shared by the library, scenes and the command line. Loads no numpy.

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
"""Discretisations of the equations."""

SOLVERS = ("multigrid", "jacobi")
"""Solvers for pressure and diffusion."""

CYCLES, CYCLES_LIMIT = 3, 100
"""Default and largest number of multigrid cycles per projection."""

VISCOSITY = 0.001
"""Default viscosity [longer side^2/s]."""

PAINTED_VISCOSITY = 0.1
"""Default viscosity of white in a painted viscosity [longer side^2/s]: it stops a motion that is 6 % of the
longer side wide within 1/30 s."""

KEYFRAME_VISCOSITY = 0.005
"""Default viscosity of `wfluid keyframes` [longer side^2/s]: higher, so that strain spreads wider."""

MORPH_VISCOSITY = 0.03
"""Default viscosity of morphs [longer side^2/s]: high, so that the neighbourhood of a point moves with it and
features keep their shape."""

CREEPING_REACH = 0.3
"""Distance over which a force is felt in a creeping fluid [longer side]."""

DIFFUSION_TOLERANCE = 7e-3
"""Default relative error of the viscous change of a step."""

DIFFUSION_LOSS = 0.1 / 512
"""Default of what the map may lose in a second by the diffusion's solves [longer side]: 0.1 px of 512."""

VISCOSITY_LIMIT = 1e3
"""Largest viscosity that the solver is tested with [longer side^2/s]."""

DRAG, DRAG_LIMIT = 1e4, 1e6
"""Default drag of white in a freeze mask [1/s], with which a frozen place moves 1/400 as far as its
surroundings at 24 steps per second; and the largest drag that the solver is tested with."""

# Densities

LOOKS = ("ink", "smoke")
"""Renderings of a density: ink colours the light, smoke covers the picture behind it."""

INK, INK_CODE = (0.02, 0.02, 0.08), "#27274f"
"""Default colour of a density in linear light, and the nearest colour in a scene's notation."""

# Forces

IMAGE_FORCES = ("gradient", "contour", "vectors")
"""Kinds of forces from a picture: along its gradient or its contours, or vectors in its channels."""

RADIUS = 0.06
"""Default radius of a drawn force [longer side]."""

NOISE_SCALE = 0.2
"""Default mean wavelength of drawn noise [longer side]."""

IMAGE_LENGTH = 0.02
"""Default distance over which a force from a picture moves its strongest place [longer side]."""

IMAGE_BLUR = 0.01
"""Default sigma of the blur before a gradient is taken [longer side]: 2.6 cells of a grid of 256."""

LEAST_TIME = 0.001
"""Shortest period or window of a drawn force [s]."""

AMOUNT_LIMIT = 1000.0
"""Largest density that a source may add or a picture may paint."""

# Pictures and frames

COLORSPACES = ("auto", "srgb", "linear", "data")
"""Colour spaces of a picture's numbers."""

TYPES = ("uint8", "uint16", "half", "float")
"""Number types a picture is written with."""

QUALITY_LIMIT = 100
"""Best quality of a lossy format; 1 is the poorest."""

SIDE_LIMIT, CHANNEL_LIMIT = 65_535, 1024
"""Longest side of a picture that is read [px], limited by most formats and by 32-bit indices; and the largest
number of channels."""

SIZE_LIMIT = 32768
"""Longest side of a frame [px]."""

FIRST_FRAME = 1001
"""Number of the first frame of a sequence, as is usual in film work."""

# Keyframes and morphs

TOLERANCE = 0.25 / 512
"""Default tolerance for residuals of keyframes [longer side]: a quarter of a pixel for 512 pixels."""

MORPH_TOLERANCE = 0.5 / 512
"""Default tolerance for residuals of a morph's points [longer side]: half a pixel for 512 pixels."""

LINEAR, EASE = "linear", "ease"

CURVES = (LINEAR, EASE)
"""Names of timing curves."""

DELAY, DELAY_LIMIT = 0.5, 0.9
"""Default and largest delay of black against white in a timing mask, as a fraction of the duration."""

BLEND_SPACES = ("linear", "display")
"""Spaces to blend in: linear light, or sRGB values as sent to a display."""

FITS = ("fill", "fit", "stretch")
"""Fits of a second picture to the frame: cropped, with bars, or with its aspect changed."""

"""The public names of wfluid and the module that each comes from.

Type checkers read this file; so does wfluid/__init__.py, which imports a name when it is first used.
"""

from wfluid.animation.animation import Animation as Animation
from wfluid.animation.animation import animate as animate
from wfluid.animation.frame import Frame as Frame
from wfluid.animation.loops import Seam as Seam
from wfluid.animation.run import Run as Run
from wfluid.domain.envelopes import Arbitrary as Arbitrary
from wfluid.domain.envelopes import Constant as Constant
from wfluid.domain.envelopes import Envelope as Envelope
from wfluid.domain.envelopes import Fade as Fade
from wfluid.domain.envelopes import Instantaneous as Instantaneous
from wfluid.domain.grid import Grid as Grid
from wfluid.domain.oscillator import Oscillator as Oscillator
from wfluid.domain.paths import Path as Path
from wfluid.domain.timeline import Timeline as Timeline
from wfluid.domain.walls import Wall as Wall
from wfluid.domain.walls import Walls as Walls
from wfluid.fields.state import State as State
from wfluid.files.output import write_animation as write_animation
from wfluid.gradient.functional import Functional as Functional
from wfluid.gradient.objectives import Effort as Effort
from wfluid.gradient.objectives import ParticleFunction as ParticleFunction
from wfluid.gradient.objectives import ParticleMisfit as ParticleMisfit
from wfluid.gradient.picture_misfit import PictureMisfit as PictureMisfit
from wfluid.gradient.state_objectives import DensityMisfit as DensityMisfit
from wfluid.gradient.state_objectives import MapMisfit as MapMisfit
from wfluid.gradient.state_objectives import WarpObjective as WarpObjective
from wfluid.gradient.variables import Free as Free
from wfluid.gradient.variables import Setup as Setup
from wfluid.keyframes.keyframes import ParticleKeyframe as ParticleKeyframe
from wfluid.keyframes.match import Match as Match
from wfluid.keyframes.match import match_keyframes as match_keyframes
from wfluid.model.densities import Density as Density
from wfluid.model.densities import PaintedSource as PaintedSource
from wfluid.model.densities import Source as Source
from wfluid.model.fluid import Fluid as Fluid
from wfluid.model.force import Group as Group
from wfluid.model.gaussian_forces import GaussianForce as GaussianForce
from wfluid.model.gaussian_forces import Growth as Growth
from wfluid.model.gaussian_forces import VortexForce as VortexForce
from wfluid.model.image_force import ImageForce as ImageForce
from wfluid.model.noise_force import NoiseForce as NoiseForce
from wfluid.model.painted import Freeze as Freeze
from wfluid.model.painted import Keyed as Keyed
from wfluid.model.painted import Painted as Painted
from wfluid.model.stroke import Stroke as Stroke
from wfluid.model.uniform_forces import Buoyancy as Buoyancy
from wfluid.model.uniform_forces import Wind as Wind
from wfluid.morphing.morph import Morph as Morph
from wfluid.morphing.morph import morph as morph
from wfluid.pictures.formats import Encoding as Encoding
from wfluid.pictures.formats import PictureError as PictureError
from wfluid.pictures.picture import Picture as Picture
from wfluid.pictures.stills import read_picture as read_picture
from wfluid.pictures.stills import write_picture as write_picture
from wfluid.scene.scene import Scene as Scene
from wfluid.scene.schema import SceneError as SceneError
from wfluid.scene.short_forms import parse_force as parse_force
from wfluid.scene.toml_file import read_scene as read_scene
from wfluid.scene.toml_file import write_scene as write_scene
from wfluid.staging.build import stage as stage
from wfluid.staging.drawing import Drawing as Drawing
from wfluid.step.solver import Solver as Solver
from wfluid.step.solver import SolveReport as SolveReport
from wfluid.system.errors import FileError as FileError
from wfluid.system.errors import WriteError as WriteError
from wfluid.view.coordinate_map import CoordinateMap as CoordinateMap
from wfluid.view.lookup import LookUp as LookUp
from wfluid.view.quality import MapQuality as MapQuality

__version__: str

"""Optimal geometry and pose of parallel robots for a motion: the public names, and where each is."""

from . import models as models
from . import nlp as nlp
from .models import AxisAngle as AxisAngle
from .models import Dimension as Dimension
from .models import Displacement as Displacement
from .models import Model as Model
from .models import ModelError as ModelError
from .models import RobotError as RobotError
from .models import Screw as Screw
from .models import UnknownModelError as UnknownModelError
from .models import axis_angle_from_matrix as axis_angle_from_matrix
from .models import axis_from_screw as axis_from_screw
from .models import hexapod as hexapod
from .models import legged_platform as legged_platform
from .models import matrix_from_axis_angle as matrix_from_axis_angle
from .models import model_names as model_names
from .models import reciprocal_product as reciprocal_product
from .models import robot as robot
from .models import robot_function as robot_function
from .models import screw_from_axis as screw_from_axis
from .models import stewart_gough as stewart_gough
from .models import three_upu as three_upu
from .nlp import *  # noqa: F403 - the names of the stub beside nlp
from .nlp import __version__ as __version__

"""Restarts, threads and orientations: what must hold to the last digit or nearly."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from sandmould.dem import pairs
from sandmould.dem.grains import Grains
from sandmould.dem.motion import NONE, Damping
from sandmould.dem.solver import Solver
from sandmould.dem.steps import Scene
from sandmould.dem.surfaces import Surfaces
from sandmould.engines.choosing import engine_of
from sandmould.engines.model import Law
from tests.verification.cases.bench import Bench, Measured, case

"""The tables that kernels read and write: numpy records, whose columns `model.tables` makes of a world's dataclasses.

A kernel takes a row (`table[i]`) and reads its fields by name.
"""

from typing import Any, Final

import numpy as np
import numpy.typing as npt

Table = npt.NDArray[np.void]
Waves = Table | npt.NDArray[np.float64]
"""`WAVE`, or `wave_columns` of it. numba knows which, and leaves out what is for the other."""
OwnWaves = npt.NDArray[np.float64] | None
"""What rows of a batch have of their own, where their waves are else those of one `WAVE`.

A factor of all heights, then (n,) phases [rad] of the waves at the origin at time 0, then (n,) factors of their
heights: as much of it as rows differ in. An empty array, or None, is for the waves of the table.
"""
Record = Any
"""One row of a `Table`."""
Views = Any
"""All tables of a run and MuJoCo's arrays, by name: `runtime.views.Views`."""

BOX, SPHERE, CYLINDER = 0, 1, 2
"""Values of `ELEMENT.shape`."""

LINEAR: Final = 0
GLF: Final = 1
RUDDER: Final = 2
NEWTONS: Final = 3
SAIL: Final = 4
"""Values of `THRUSTER.mapping`: a share of the largest force, the generalised logistic function of one, no propeller
but a rudder, the force itself, or no propeller but a sail."""
BLADES: Final = (RUDDER, SAIL)
"""Values of `THRUSTER.mapping` of rudders and sails, which take an angle alone."""

VRX: Final = 0
VRX3: Final = 1
MARINE: Final = 2
"""Values of `HULL.profile` and `FLOAT.profile`: whose list of effects acts, VRX classic's, VRX 3's, or our own."""

MESH: Final = 0
MATRIX: Final = 1
"""Values of `VESSEL.hydrostatics`: pressure on a mesh, or a stiffness."""

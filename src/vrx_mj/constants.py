"""Constants of names, time and VRX's physics. Its four values of g differ, and each is kept where VRX uses it."""

PHYSICS_VERSION = 2
"""Rises when equal worlds, seeds and commands give other bits than before.

2: energies of spectra are drawn, hulls and floats touch with prisms, ties of half turns round to even."""

GRAVITY = 9.8
"""Gravity of weights, and of the buoyancy of objects [m/s2]. Gazebo's default, |(0, 0, -9.8)|."""

STANDARD_GRAVITY = 9.80665
"""Gravity of worlds that are not VRX's [m/s2]: the standard acceleration of ISO 80000-3."""

WAVE_GRAVITY = 9.8
"""Gravity in the dispersion relation omega^2 = g k [m/s2]. VRX: wave_gazebo_plugins, PhysicalConstants.cc."""

SPECTRUM_GRAVITY = 9.81
"""Gravity in the Pierson-Moskowitz spectrum [m/s2]. VRX: wave_gazebo_plugins, Wavefield.cc."""

HULL_GRAVITY = 9.815
"""Gravity in the buoyancy of hulls [m/s2]. VRX: usv_gazebo_dynamics_plugin.cc, a literal."""

WATER_DENSITY = 1000.0
"""Density [kg/m3] of the water for objects whose files give none. VRX: buoyancy_gazebo_plugin, its models' files."""

SEA_WATER_DENSITY = 1025.0
"""Density [kg/m3] of the water of seas that are not VRX's. ITTC 7.5-02-01-03: 1026 at 15 C and 35 g/kg."""

DOCK_CELL = 2.0
"""Edge of a dock's cell [m]. VRX: dock_generator.erb."""

SHORTEST_STEP, LONGEST_STEP = 1e-6, 0.02
"""Bounds of a world's physics step [s]: a hull's roll, of period 0.42 s, diverges at longer ones."""

EARLY = 1e-6
"""Tolerance with which a time counts as reached [s]: time is a sum of steps, each rounded, 1e-8 s off after 700 s."""

ANGLE_SUFFIX = "_angle"
"""Suffix of the command that turns a thruster, a rudder or a sail: `left_angle` turns `left`."""

"""The Kingfisher's thrust is the fit to the odd runs that its file says."""

import numpy as np
import pytest
import yaml
from scipy.optimize import least_squares

from vrx_mj.packages import root
from vrx_mj.validation.case import rows


def test_its_thrust_ahead_is_fitted_to_the_odd_runs_alone():
    robot = yaml.safe_load((root() / "assets" / "robots" / "kingfisher" / "robot.yaml").read_text(encoding="utf-8"))
    damping = robot["hull"]["damping_quadratic"][0]
    ahead = [pair for pair in robot["propellers"]["left"]["thrust"] if pair[0] >= 0.0]
    commands, thrusts = np.array(ahead).T
    assert commands.tolist() == [0.0, 0.1, 0.2, 0.65, 1.0]
    runs = rows("lake_runs")[::2]
    assert {row["run"] % 2 for row in runs} == {1}
    given, speeds = np.array([(row["port_command_end"], row["speed_end_m_s"]) for row in runs]).T

    def differences(free):
        """Steady speeds of 2 T = d u^2 less those measured [m/s], with one thrust at 0.1 and 0.2."""
        return np.sqrt(2.0 * np.interp(given, commands, [0.0, free[0], *free]) / damping) - speeds

    fit = least_squares(differences, [0.5, 18.0, 18.0], bounds=(1e-3, 40.0)).x
    assert thrusts[1:] == pytest.approx([fit[0], *fit], abs=0.005)

"""Tolerated error of a step: one length, from which the tolerances of all states follow by their effect on the motion.

The tolerance of a position in a step is ``atol + rtol`` times `LENGTH`, in all directions and at any distance along the
track. Other tolerances follow from it:

* A velocity: `RATE` times as much. It is smaller for wheelsets at low speed, where velocity is creepage: its error then
  turns a wheelset off its course as the position's error at half the gauge does, at the speed in this step.
* An angle: the same displacement at the body's radius of gyration. An angular velocity: the same velocity there, so
  that their energies are equal.
* A body lighter than the lightest wheelset: larger, such that the energy of its error is at most that of the wheelset.
  1 kg on a stiff bushing hardly moves a wheel, and must not limit the steps.

A step's error is the maximum over all bodies, so that a wheelset in a train is as accurate as a single wheelset. The
size of a component has no effect. In a curve, components along fixed axes pass through zero, and weights by their size
would limit the step there. The travelled distance is no measure for forces of springs and contacts.

`LENGTH` and `RATE` were chosen by measurement, 20 scenes with each method: wheelsets, coach and metro car, 0.2 to
80 m/s, straight and R = 300 to 3000 m, smooth and irregular. With ``rtol`` 1e-4 wheelsets have errors below 1 µm if the
motion is stable, and contact forces have root mean square errors below 1 %.
"""

import numpy as np

from wrcore.bodies.body import EULER, OMEGA, STATE_SIZE, VELOCITY
from wrcore.equations.model import internal_states
from wrcore.equations.pace import HALF_GAUGE
from wrcore.integrate.tableaus import EXPLICIT
from wrcore.track.flexible_track import RAILS, track_places

LENGTH = 0.01
"""Reference length of ``rtol``, m: about the play of a wheelset between the flanges."""

SHARE = {"rodas5": 12.0, "rodas4": 3.0, "rodas4p2": 1.5, "ros34pw2": 0.1, "rk4": 5.0}
"""Factor on the tolerances of a method whose error estimate differs from the error of the run. Methods of the RODAS
type estimate the error of their embedded method; their error is smaller, and that of Kutta's method much smaller.
Errors of ROS34PW2 with an old Jacobian accumulate."""


PRESSED = 0.1
"""Tolerance of rails without mass relative to that of a wheelset, for explicit methods. At the stability bound these
rails oscillate, and 1 µm of a loaded rail means up to 2 kN."""


def step_tolerances(model, rtol, atol=0.0, method=""):
    """Return the tolerated error of a step for each component of the state, shape (2, size).

    Row 0 is independent of speed, row 1 is multiplied by `pace` (1/s). ``rtol`` is relative to `LENGTH`, ``atol`` (m)
    is added; the sum is multiplied by the method's `SHARE`. Units of the products: m, 1, m/s, rad/s, and m for internal
    states (rad/s for independently rotating wheels, m/s for velocities of a flexible track; its sleeper's roll is
    measured by the displacement at the rails).
    """
    n = len(model.bodies.mass)
    weights, lever = np.ones(STATE_SIZE * n + internal_states(model)), gyration(model.bodies)[:, None]
    fast, bodies = np.zeros(weights.shape, bool), weights[: STATE_SIZE * n].reshape(n, STATE_SIZE)
    bodies[:, EULER:VELOCITY] = 0.5 / lever  # a turn by theta changes p by theta/2
    bodies[:, OMEGA:] = 1.0 / lever
    bodies *= lightness(model.bodies)[:, None]
    fast[: STATE_SIZE * n].reshape(n, STATE_SIZE)[:, VELOCITY:] = True
    for wheelset, state in model.bodies.independent:
        weights[STATE_SIZE * n + state] = 1.0 / lever[model.bodies.wheelsets[wheelset], 0]
        fast[STATE_SIZE * n + state] = True
    freedoms = len(model.flexible_track.mass)
    if freedoms:
        places = track_places(model)
        fast[places[:, freedoms:]] = True
        if freedoms > RAILS:  # roll of the sleeper
            weights[places[:, RAILS + 2 :: freedoms]] /= HALF_GAUGE
        if method in EXPLICIT and model.flexible_track.mass[0] == 0.0:
            weights[places] *= PRESSED
    return (atol + rtol * LENGTH) * SHARE.get(method, 1.0) * weights * np.array([~fast, fast])


def lightness(bodies):
    """Return the factor (n,) on each body's tolerances: equal energy if lighter than the lightest wheelset, else 1."""
    return np.sqrt(np.maximum(1.0, min(bodies.mass[bodies.wheelsets], default=0.0) / bodies.mass))


def gyration(bodies):
    """Return the maximum radius of gyration of each body, shape (n,), m."""
    return np.sqrt(bodies.inertia.max(axis=1) / bodies.mass)

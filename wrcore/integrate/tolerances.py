"""What a step may err: one number, the same for every kind of state in what it does to the motion.

A position may err by ``atol + rtol`` times `LENGTH` in a step, in any direction and however far down the track. All
else follows from that. A velocity may err by `RATE` times as much; under wheels less at low speed, where it is a
creepage: by what turns a wheelset off its course as the position's error at half the gauge does. The speed is that of
the wheelsets in this very step. An angle may err by what moves a point at the body's radius of gyration as far, an
angular velocity by what moves it as fast (so that their shares of the energy are alike). A step's error is that of the
body that errs most: a train's wheelset is as accurate as one that runs alone. A body lighter than the lightest wheelset
may err by more, so that its error has no greater energy than one of that wheelset: 1 kg that swings on a stiff bushing
hardly moves a wheel, and shall not dictate the steps.

No size of any component enters. In a curve the components along resting axes go through zero in turn, and weights by
their size would bound the step there; and the travelled distance is no measure of what springs and contacts feel.

`LENGTH` and `RATE` were chosen by measurement, 20 scenes with each method: wheelsets, coach and metro car, 0.2 to
80 m/s, straight and R = 300 to 3000 m, smooth and irregular. With ``rtol`` 1e-4 wheelsets err by less than 1 um where
the motion is not unstable, and contact forces by less than 1 % in the root mean square.
"""

import numpy as np

from wrcore.bodies.body import EULER, OMEGA, STATE_SIZE, VELOCITY
from wrcore.equations.model import internal_states
from wrcore.equations.pace import HALF_GAUGE
from wrcore.integrate.tableaus import EXPLICIT
from wrcore.track.flexible_track import RAILS, track_places

LENGTH = 0.01
"""Travel that ``rtol`` refers to, m: about the play of a wheelset between the flanges."""

SHARE = {"rodas5": 12.0, "rodas4": 3.0, "rodas4p2": 1.5, "ros34pw2": 0.1, "rk4": 5.0}
"""What a method's estimate of its error is allowed, where that is no good measure of what the run errs by: methods of
RODAS' kind estimate the error of their embedded method and err less, Kutta's method much less; those of ROS34PW2 with
an old Jacobian pile up."""


PRESSED = 0.1
"""What rails without mass may err by, over what a wheelset may, by an explicit method: at its stability bound these
swing, and 1 um of a rail that a wheel presses is up to 2 kN."""


def step_tolerances(model, rtol, atol=0.0, method=""):
    """Errors (2, size) of a step that each component of the state is allowed: what it is at any speed, and per 1/s of
    `pace`.

    ``rtol`` is the part of `LENGTH`, ``atol`` (m) comes on top; a method in `SHARE` counts with that. Units: m, 1, m/s,
    rad/s, and m for the states that belong to no body (rad/s for wheels that turn independently, m/s for the velocities
    of a flexible track; its sleeper's roll counts at the rails).
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
    """Factor (n,) on what each body may err by: equal energy for those lighter than the lightest wheelset, else 1."""
    return np.sqrt(np.maximum(1.0, min(bodies.mass[bodies.wheelsets], default=0.0) / bodies.mass))


def gyration(bodies):
    """Largest radius of gyration of each body, shape (n,), m."""
    return np.sqrt(bodies.inertia.max(axis=1) / bodies.mass)

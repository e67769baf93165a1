"""What a step may err: one number, the same for every kind of state in what it does to the motion.

A position may err by ``atol + rtol`` times `LENGTH` in a step, in any direction and however far down the track. All
else follows from that. A velocity may err by `RATE` times as much; under wheels less at low speed, where it is a
creepage: by what turns a wheelset off its course as the position's error at half the gauge does. An angle may err by
what moves a point at the body's radius of gyration as far, an angular velocity by what moves it as fast (so that their
shares of the energy are alike). A step's error is that of the body that errs most: a train's wheelset is as accurate
as one that runs alone.

No size of any component enters. In a curve the components along resting axes go through zero in turn, and weights by
their size would bound the step there; and the travelled distance is no measure of what springs and contacts feel.

`LENGTH` and `RATE` were chosen by measurement, 20 scenes with each method: wheelsets, coach and metro car, 0.2 to
80 m/s, straight and R = 300 to 3000 m, smooth and irregular. With ``rtol`` 1e-4 wheelsets err by less than 1 um where
the motion is not unstable, and contact forces by less than 1 % in the root mean square.
"""

import numpy as np

from wrcore.dynamics.body import EULER, OMEGA, POSITION, STATE_SIZE, VELOCITY
from wrcore.dynamics.support import RAILS, support_places
from wrcore.dynamics.system import own_states

LENGTH = 0.01
"""Travel that ``rtol`` refers to, m: about the play of a wheelset between the flanges."""

HALF_GAUGE = 0.75
"""m."""

RATE = 30.0
"""Velocities' tolerance over that of positions, 1/s. Above 100 explicit methods at their stability bound let forces
swing by per cents; much below 30 it is velocities alone that count."""

SHARE = {"rodas4": 3.0, "ros34pw2": 0.1}
"""What a method's estimate of its error is allowed, where that is no good measure of what the run errs by: Rodas4
estimates the error of its embedded method and errs less itself; errors of ROS34PW2 with an old Jacobian pile up."""


def step_tolerances(model, rtol, atol=0.0, method=""):
    """Error of a step that each component of the state is allowed.

    Parameters
    ----------
    model : Model
    rtol : float
        Part of `LENGTH`.
    atol : float
        That comes on top, m.
    method : str
        Where its name stands in `SHARE`, that counts.

    Returns
    -------
    numpy.ndarray, shape (size,)
        m, 1, m/s, rad/s, and m for the states that belong to no body (rad/s for wheels that turn independently, m/s
        for the velocities of a track that gives; its sleeper's roll counts at the rails).
    """
    n, rate = len(model.bodies.mass), RATE
    if len(model.bodies.wheelsets):  # a driven vehicle does not keep its speed, and may come to a standstill
        rate = min(RATE, (model.contact.least_speed if len(model.drive.rows) else model.speed) / HALF_GAUGE)
    weights = np.ones(STATE_SIZE * n + own_states(model))
    bodies, lever = weights[: STATE_SIZE * n].reshape(n, STATE_SIZE), gyration(model.bodies)[:, None]
    bodies[:, POSITION:EULER] = 1.0
    bodies[:, EULER:VELOCITY] = 0.5 / lever  # a turn by theta changes p by theta/2
    bodies[:, VELOCITY:OMEGA] = rate
    bodies[:, OMEGA:] = rate / lever
    for wheelset, state in model.bodies.independent:
        weights[STATE_SIZE * n + state] = rate / lever[model.bodies.wheelsets[wheelset], 0]
    freedoms = len(model.support.mass)
    if freedoms:
        places = support_places(model)
        weights[places[:, freedoms:]] = rate
        if freedoms > RAILS:  # roll of the sleeper
            weights[places[:, RAILS + 2 :: freedoms]] /= HALF_GAUGE
    return (atol + rtol * LENGTH) * SHARE.get(method, 1.0) * weights


def gyration(bodies):
    """Largest radius of gyration of each body, shape (n,), m."""
    return np.sqrt(bodies.inertia.max(axis=1) / bodies.mass)

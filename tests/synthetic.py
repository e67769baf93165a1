"""A run with the documented channels and a motion known in closed form."""

import numpy as np

from wrcore.run.simulate import Run

BODY = ("x_m", "y_m", "z_m", "roll_rad", "yaw_rad", "vx_m_per_s", "vy_m_per_s", "vz_m_per_s") + (
    "wx_rad_per_s",
    "wy_rad_per_s",
    "wz_rad_per_s",
)
CONTACT = ("u_wheel_m", "s_wheel_rad", "u_rail_m", "x_m", "y_m", "z_m", "contact_angle_rad", "penetration_m") + (
    "a_m",
    "b_m",
    "N_N",
    "Fx_N",
    "Fy_N",
    "Mz_Nm",
    "xi",
    "eta",
    "phi_per_m",
)


def hunting_run(detection="planar", growth=0.1, frequency=2.6, duration=4.0, flange_at=None, sign=1.0, wall_s=0.5):
    """Hunting with amplitude 2 mm exp(growth t), speed 20 m/s; a flange patch on the left from `flange_at` on."""
    t = np.arange(int(round(duration * 200)) + 1) / 200
    y = sign * 2e-3 * np.exp(growth * t) * np.cos(2 * np.pi * frequency * t)
    body = {name: np.zeros_like(t) for name in BODY} | {"x_m": 20 * t, "y_m": y, "z_m": np.full_like(t, 0.46)}
    sides = {side: {name: np.full((t.size, 3), np.nan) for name in CONTACT} for side in ("left", "right")}
    for side, out in (("left", 1.0), ("right", -1.0)):
        for name in CONTACT:
            sides[side][name][:, 0] = 0.0
        sides[side]["u_wheel_m"][:, 0] = 3e-3 - 4 * out * y
        sides[side]["u_rail_m"][:, 0] = 2e-3 - 3 * out * y
        sides[side]["y_m"][:, 0] = out * (0.75 + 2e-3) - 3 * y
        sides[side]["z_m"][:, 0] = -0.1 * out * y  # a conicity of 0.1
        sides[side]["N_N"][:, 0] = 8.9e3
        sides[side]["contact_angle_rad"][:, 0] = 0.03
    if flange_at is not None:
        late = t >= flange_at
        sides["left"]["contact_angle_rad"][late, 1] = 1.2
        sides["left"]["u_wheel_m"][late, 1] = -39e-3
        sides["left"]["u_rail_m"][late, 1] = -34e-3
    return Run(
        scene={"name": "synthetic", "speed": 20.0, "contact": {"detection": detection}},
        status="completed",
        reason="",
        t=t,
        groups={"wheelset": body, "wheelset/left": sides["left"], "wheelset/right": sides["right"]},
        counters={"steps": 900, "rejected": 10, "rhs_evaluations": 6000, "wall_s": wall_s, "compile_s": 1.5},
        settings={"method": "rk45", "rtol": 1e-6, "atol": 1e-9, "wrcore_version": "0"},
    )

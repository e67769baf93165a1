"""Units and descriptions of the channels of a run; the end of a channel's name states its unit.

A body's channels are in the axes of the track at its centre of mass, at the arc length x: t ahead, n left in the canted
plane, b up. Its angles are relative to these axes. Its velocity, angular velocity and acceleration are relative to
inertial space and have components along these axes.
"""

UNIT_SUFFIXES = {
    "_m3_per_m": "m^2",
    "_m3": "m^3",
    "_m_per_s2": "m/s^2",
    "_m_per_s": "m/s",
    "_rad_per_s": "rad/s",
    "_per_m": "1/m",
    "_Nm": "N m",
    "_rad": "rad",
    "_Hz": "Hz",
    "_Pa": "Pa",
    "_J": "J",
    "_W": "W",
    "_N": "N",
    "_m": "m",
    "_s": "s",
}
"""Unit by the end of a channel's name, longest ends first; a name without one of these is a pure number."""

DESCRIPTIONS = {
    "t": "time",
    "x_m": "place along the track (body: arc length of its centre of mass; contact: contact point, from its wheelset's"
    " cross-section), forward positive",
    "s_m": "arc length along the track's centre line, the same as x (tracks that are not tangent)",
    "y_m": "lateral position in the track's axes, left positive",
    "z_m": "height above the plane of the rails' highest points",
    "roll_rad": "roll about the track's x, right-handed",
    "pitch_rad": "pitch about y, right-handed (bodies that do not spin)",
    "yaw_rad": "yaw about the track's z, right-handed",
    "vx_m_per_s": "velocity, along the track's x",
    "vy_m_per_s": "velocity, along the track's y",
    "vz_m_per_s": "velocity, along the track's z",
    "ax_m_per_s2": "acceleration of the centre of mass in inertial space, along the track's x",
    "ay_m_per_s2": "acceleration of the centre of mass in inertial space, along the track's y",
    "az_m_per_s2": "acceleration of the centre of mass in inertial space, along the track's z",
    "wx_rad_per_s": "angular velocity in inertial space, about the track's x",
    "wy_rad_per_s": "angular velocity in inertial space, about the track's y",
    "wz_rad_per_s": "angular velocity in inertial space, about the track's z",
    "rolling_rate_left_rad_per_s": "rate at which a left wheel turns that does so independently of the right one",
    "rolling_rate_right_rad_per_s": "rate at which a right wheel turns that does so independently of the left one",
    "rail_y_left_m": "displacement of the left rail under the wheelset, to the left (track that gives)",
    "rail_z_left_m": "displacement of the left rail under the wheelset, upwards (track that gives)",
    "rail_y_right_m": "displacement of the right rail under the wheelset, to the left (track that gives)",
    "rail_z_right_m": "displacement of the right rail under the wheelset, upwards (track that gives)",
    "sleeper_y_m": "displacement of the sleeper under the wheelset, to the left (track that gives)",
    "sleeper_z_m": "displacement of the sleeper under the wheelset, upwards (track that gives)",
    "sleeper_roll_rad": "roll of the sleeper under the wheelset (track that gives)",
    "check_rail_left_N": "force of a check rail on the back of the left wheel",
    "check_rail_right_N": "force of a check rail on the back of the right wheel",
    "planar_error_left_m": "bound of the penetration that planar detection misses, left wheel",
    "planar_error_right_m": "bound of the penetration that planar detection misses, right wheel",
    "spatial_left": "1 where detection auto chose spatial for the left wheel, else 0",
    "spatial_right": "1 where detection auto chose spatial for the right wheel, else 0",
    "on_rail_y_m": "lateral position of the wheelset's centre in the rail's frame: the rail as it lies under the wheel",
    "on_rail_z_m": "height of the wheelset's centre in the rail's frame",
    "on_rail_axle_x": "direction of the axle, pointing left, in the rail's frame: its part along the rail",
    "on_rail_axle_y": "the part of the axle's direction to the left",
    "on_rail_axle_z": "the part of the axle's direction upwards",
    "on_rail_vx_m_per_s": "velocity of the wheelset's centre, along the rail",
    "on_rail_vy_m_per_s": "velocity of the wheelset's centre, to the left in the rail's frame",
    "on_rail_vz_m_per_s": "velocity of the wheelset's centre, upwards in the rail's frame",
    "on_rail_wx_rad_per_s": "angular velocity of the wheel in the rail's frame, about the rail",
    "on_rail_wy_rad_per_s": "angular velocity of the wheel in the rail's frame, about the lateral axis",
    "on_rail_wz_rad_per_s": "angular velocity of the wheel in the rail's frame, about the vertical axis",
    "on_rail_bend_y_per_m": "curvature of the rail's line, towards the left",
    "on_rail_bend_z_per_m": "curvature of the rail's line, upwards",
    "on_rail_friction": "coefficient of friction of the rail under the wheel, at no slip",
    "u_wheel_m": "lateral coordinate of the contact point on the wheel profile, field side positive",
    "s_wheel_rad": "angular coordinate of the contact point on the wheel",
    "u_rail_m": "lateral coordinate of the contact point on the rail profile, field side positive",
    "contact_angle_rad": "angle of the contact plane to the track plane in the cross-section",
    "penetration_m": "penetration along the contact normal, positive in contact",
    "a_m": "semi-axis of the contact ellipse along rolling",
    "b_m": "semi-axis of the contact ellipse across rolling",
    "N_N": "normal force on the wheel",
    "Fx_N": "longitudinal creep force on the wheel",
    "Fy_N": "lateral creep force on the wheel, in the contact plane",
    "Mz_Nm": "spin moment on the wheel about the contact normal",
    "xi": "longitudinal creepage, wheel relative to rail",
    "eta": "lateral creepage, wheel relative to rail",
    "phi_per_m": "spin creepage, wheel relative to rail",
    "p_max_Pa": "greatest pressure in the patch",
    "Q_N": "vertical force of the wheel on its rail, downwards positive",
    "Y_N": "lateral force of the wheel on its rail, to the field side positive",
    "Y_over_Q": "Y over Q, absent where the wheel carries less than 1 kN",
    "T_gamma_N": "wear number, |Fx xi + Fy eta| summed over the patches",
    "T_gamma_spin_N": "wear number with spin, |Fx xi + Fy eta + Mz phi| summed over the patches",
    "creep_power_W": "power that the wheel's creep dissipates",
    "sum_Y_N": "lateral force of the wheelset on the track, left positive",
    "rolling_radius_m": "distance of the wheel's contact points from the axle, by their normal forces",
    "rolling_radius_difference_m": "rolling radius of the left wheel less that of the right one",
    "effective_conicity": "rolling radius difference over twice the displacement from the middle of the rails",
    "torque_Nm": "torque of a motor or brake on its wheelset, driving ahead positive",
    "power_W": "power of a motor (negative: of a brake)",
    "force_N": "force at the wheels' rims that the speed controller asks its motors for",
    "wanted_m_per_s": "speed that the controller is to keep",
    "input_by_motors_W": "power of the motors",
    "dissipated_by_brakes_W": "power lost in the brakes",
    "kinetic_J": "kinetic energy of all bodies, and of a track that gives",
    "gravitational_J": "gravitational energy of all bodies, from z = 0",
    "springs_J": "energy of all springs, those in series with dampers and under rails too, from nominal position",
    "elastic_contact_J": "2/5 of elastic normal force times penetration, all patches",
    "input_by_frame_W": "power of the moving frame through the elements that lead to it",
    "input_by_joints_W": "power of the joints' reactions: what they drive, and what holds them together against drift",
    "dissipated_by_dampers_W": "power lost in dampers and friction elements, those under rails too",
    "dissipated_by_creep_W": "power lost in the contact patches by creep forces and spin moments",
    "dissipated_by_contact_damping_W": "power lost by the damping of the normal forces",
    "stored_by_springs_W": "power that goes into the springs' energy",
    "stored_by_gravity_W": "power that goes into the gravitational energy",
    "stored_by_elastic_contact_W": "power against the elastic normal forces",
}


def unit_of(channel: str) -> str:
    """Return the unit that a channel's name states, ``1`` for a pure number.

    Examples
    --------
    >>> unit_of("Fy_N"), unit_of("vx_m_per_s"), unit_of("xi")
    ('N', 'm/s', '1')
    """
    if channel == "t":
        return "s"
    return next((unit for end, unit in UNIT_SUFFIXES.items() if channel.endswith(end)), "1")

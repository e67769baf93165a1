"""The track: where the rails stand."""

from dataclasses import dataclass

import numpy as np

GAUGE_DEPTH = 0.014
"""Height below the rail top at which the gauge is measured, m (EN 13848-1; Manchester contact benchmark)."""


@dataclass(frozen=True)
class Track:
    """A tangent track with two rails of the same profile.

    Parameters
    ----------
    gauge : float
        Distance between the innermost points of the rails within ``GAUGE_DEPTH`` of their tops, m.
    """

    gauge: float = 1.435

    def rail_distance(self, rail):
        """Distance from the track's centre line to the origin (highest point) of a rail's profile, m.

        Parameters
        ----------
        rail : ProfileCurve
            Rail profile in the pose in which it lies in the track.
        """
        return 0.5 * self.gauge + rail.gauge_offset(GAUGE_DEPTH)


def rotation(roll, yaw):
    """Rotation matrix of a wheelset's frame: first roll about x, then yaw about z, shape (3, 3).

    The second column is the axle's direction, (-sin yaw cos roll, cos yaw cos roll, sin roll). The wheelset's
    pitch is left out: it does not move the wheel's surface.
    """
    cr, sr, cy, sy = np.cos(roll), np.sin(roll), np.cos(yaw), np.sin(yaw)
    return np.array([[cy, -sy * cr, sy * sr], [sy, cy * cr, -cy * sr], [0.0, sr, cr]])

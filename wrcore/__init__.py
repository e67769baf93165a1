"""wrcore: wheel-rail contact in railway dynamics.

Axes and signs (everywhere in the package)::

            z up                        x  forward along the track
            |   x forward               y  to the left
            |  /                        z  up, zero in the plane of the canted rails' highest points
            | /
    y ------o                           roll, pitch, yaw: right-handed about x, y, z
    left

Profiles use a lateral coordinate u, positive to the field side on both wheels and both rails, and an ordinate f,
positive up; for a wheel f(u) = -r(u) with r the rolling radius. ``left`` is y > 0 and comes first in arrays over
sides. Penetration is positive in contact. Creepages are velocities of the wheel relative to the rail over the
rolling speed; forces act on the wheel. Units are SI throughout.
"""

__version__ = "0.1.0"

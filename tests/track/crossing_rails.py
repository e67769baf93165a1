"""Rails of slices for tests, as points over arc length."""

import numpy as np

from wrcore.geometry.profiles.standards import named_profile

SIDE = 6e-3  # m


def circle(u, radius=0.3):
    """A rail's circular head."""
    return np.sqrt(radius**2 - u**2) - radius


def with_sides(u, f):
    """Points with sides below a head's ends."""
    u = np.concatenate([u[:1] - 3e-4, u, u[-1:] + 3e-4])
    return u, np.concatenate([f[:1] - SIDE, f, f[-1:] - SIDE])


def write_rail(folder, arc_lengths, height, head=None):
    """Write a rail of one head that is ``height(s)`` (m) higher at each arc length; the path of its table."""
    plain = head or named_profile("circle:0.3", "rail", 0.0)
    u = np.linspace(plain.u[0], plain.u[-1], 161)
    rows = ["s_m,profile"]
    for k, s in enumerate(arc_lengths):
        points = np.column_stack(with_sides(u, plain(u) + height(s)))
        np.savetxt(folder / f"{k}.csv", points, fmt="%.12g", delimiter=",", header="u_m,f_m", comments="")
        rows.append(f"{s:.12g},{k}.csv")
    path = folder / "rail.csv"
    path.write_text("\n".join(rows))
    return path

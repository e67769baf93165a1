"""Spring and damper against relative roll."""

from wrcore.forces.kind import AT, Kind, Turning, ends_of, number


def parts(item):
    """Return one part, spring and damper about x."""
    stiffness, damping = ([value, 0.0, 0.0] for value in (item["stiffness"], item.get("damping", 0.0)))
    return [Turning(ends_of(item), stiffness, damping, anywhere=True)]


KIND = Kind(
    {"stiffness": number("a stiffness in N m/rad"), "at": AT, "damping": number("a damping in N m s/rad")},
    ("stiffness",), {"marker": "v", "color": "#CC79A7"}, parts,
)  # fmt: skip

"""Trains: one vehicle file's bodies, elements and joints several times, one behind the other."""

FRAME_NAME = "frame"


def repeated(data, count, spacing):
    """The content of a vehicle file for several equal vehicles.

    Parameters
    ----------
    data : dict
        Content of a vehicle file, checked and with defaults.
    count : int
    spacing : float
        Distance from one vehicle to the next one behind it, m.

    Returns
    -------
    dict
        Unchanged for one vehicle; else the names of bodies, elements and joints begin with ``vehicle_1_`` (the leading
        one), ``vehicle_2_``, and so on. Elements that act between a vehicle and the moving frame do so for each.
    """
    if count == 1:
        return data
    train = {**data, "bodies": {}, "elements": [], "joints": []}
    for k in range(count):
        prefix, shift = f"vehicle_{k + 1}_", -k * spacing
        for name, part in data["bodies"].items():
            moved = {**part, "position": _moved(part["position"], shift)}
            if "wheelset" in part:
                moved["wheelset"] = prefix + part["wheelset"]
            train["bodies"][prefix + name] = moved
        for group in ("elements", "joints"):
            for item in data[group]:
                ends = [end if end == FRAME_NAME else prefix + end for end in item["bodies"]]
                moved = {**item, "name": prefix + item["name"], "bodies": ends}
                if "at" in item:
                    moved["at"] = _moved(item["at"], shift)
                train[group].append(moved)
    return train


def _moved(at, shift):
    """A point, or a list of points, moved along the track."""
    if isinstance(at[0], list):
        return [_moved(point, shift) for point in at]
    return [at[0] + shift, *at[1:]]

"""Scenes on which contact from the table of exact patches is measured."""

ROUGH = {"track.irregularity": {"spectrum": {"level": "low", "seed": 1, "length": 2000.0, "begin": 20.0}}}
CURVE = {"track.path": [{"tangent": 5}, {"transition": 30}, {"curve": 60, "radius": 300, "cant": 0.1}]}
SCENES = {
    "suspended wheelset, 20 m/s": ("suspended_wheelset", {"integration.duration": 5.0}),
    "suspended wheelset, 60 m/s": ("suspended_wheelset", {"integration.duration": 5.0, "speed": 60.0}),
    "trailer vehicle, rough track, 60 m/s": ("trailer_vehicle", {"integration.duration": 2.0, "speed": 60.0, **ROUGH}),
    "trailer vehicle, R 300 m, 16.7 m/s": ("trailer_vehicle", {"integration.duration": 4.0, "speed": 16.7, **CURVE}),
}
"""Example scenes and what is set in them."""

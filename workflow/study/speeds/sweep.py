"""Sweeps over speed: many runs of one vehicle in one process with common imports, kernels and creep table."""

from wrcore.run.simulate import simulate_many
from wrcore.scene.description import load_scene

DETECTIONS = ("planar", "spatial")
CHANNELS = "output.channels=[pose, velocity, acceleration, contact]"


def sweep_speeds(source, overrides, speeds, tracks, progress=None):
    """Run a scene at several speeds (m/s) on several tracks with planar and spatial detection.

    ``tracks`` are further changes to the scene, by name. Returns runs by detection and track, in the order of the
    speeds. ``progress`` wraps the scenes.
    """
    keys = [(detection, track) for detection in DETECTIONS for track in tracks]
    scenes = [
        load_scene(
            source, [*overrides, CHANNELS, *tracks[track], f"contact.detection={detection}", f"speed={float(speed)}"]
        )
        for detection, track in keys
        for speed in speeds
    ]
    runs = iter(simulate_many(scenes, progress))
    return {key: [next(runs) for _ in speeds] for key in keys}

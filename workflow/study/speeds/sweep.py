"""Sweeps over speed: many runs of one vehicle in one process, which share imports, kernels and creep table."""

from wrcore.run.simulate import simulate_many
from wrcore.scene.description import load_scene

DETECTIONS = ("planar", "spatial")
CHANNELS = "output.channels=[pose, velocity, acceleration, contact]"


def sweep_speeds(source, overrides, speeds, tracks, progress=None):
    """Run a scene at several speeds on several tracks, planar and spatial.

    Parameters
    ----------
    source : str, Path or dict
        Scene.
    overrides : sequence of str
        Changes to the scene that hold for all runs, as :func:`wrcore.load_scene` takes them.
    speeds : sequence of float
        m/s.
    tracks : dict of str to sequence of str
        Further changes to the scene by name of the track, such as its irregularity and where the vehicle starts.
    progress : callable, optional
        Wraps the list of scenes, e.g. ``tqdm.tqdm``.

    Returns
    -------
    dict of (str, str) to list of Run
        Runs by detection and name of the track, in the order of the speeds.
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

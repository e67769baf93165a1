"""Bad input, fuzzed: whatever is handed in, there is a result or one line that says what was expected where.

``make test`` tries 600 inputs, the same ones every time. ``WRCORE_FUZZ=10000 pytest tests/test_fuzz.py
tests/test_fuzz_files.py`` tries as many as it says; those of a smaller number need not be among them.
"""

import json
import random
from functools import cache

import pytest
import yaml
from fuzzing import (
    base_scene,
    bounded,
    check_command,
    examples,
    junk,
    numbers,
    run_command,
    simulate_text,
    spoiled,
    spoiled_text,
    texts,
)
from hypothesis import given
from hypothesis import strategies as st

from tests.conftest import ROOT
from wrcore.errors import InputError
from wrcore.errors.checked_yaml import read_yaml
from wrcore.sweep.plan import load_sweep
from wrcore.vehicle.description import build_vehicle

pytestmark = pytest.mark.usefixtures("no_new_tables")

POSES = "pose_id,y_m,yaw_rad,roll_rad,z_m\n1,0.001,0.002,,\n2,-0.003,0.0,0.0001,\n3,0.002,0.001,0,0.4599\n"
VEHICLES = ("wheelset", "suspended_wheelset", "trailer_vehicle", "metro_car")
TRACK = {
    "gauge": 1.435, "rounding": 4.0,
    "path": [{"tangent": 5.0}, {"transition": 30.0, "shape": "bloss"},
             {"curve": 100.0, "radius": 400.0, "cant": 0.1, "widening": 0.0}],
    "cant_about": "lower_rail", "gauge_depth": 0.014,
    "gradients": [{"gradient": 0.0, "length": 60.0}, {"gradient": 0.01, "radius": 2000.0}],
    "irregularity": {"spectrum": {"level": "low", "seed": 3, "length": 200.0, "begin": -20.0}, "fade_in": 5.0},
}  # fmt: skip


@examples(300)
@given(data=st.deferred(lambda: spoiled(base_scene())))
def test_scenes(folder, data):
    simulate_text(folder, yaml.dump(bounded(data)))


@cache
def within_schema():
    """Values between the bounds that the schema allows, and at them."""
    found = {"vehicle.axle_boxes": st.booleans(), "rail.inclination": st.sampled_from([0, 0.2, -0.2, "1/20"])}
    schema = yaml.safe_load((ROOT / "wrcore" / "scene" / "schemas" / "scene.yaml").read_text())

    def collect(path, part):
        for key, inner in part.get("properties", {}).items():
            collect(f"{path}{key}.", inner)
        if "enum" in part:
            found[path[:-1]] = st.sampled_from([value for value in part["enum"] if value != "cvode"])
        elif part.get("type") == "number":
            low = float(part.get("minimum", part.get("exclusiveMinimum")))
            high = float(part["maximum"])
            bounds = [high] + ([low] if "minimum" in part else [1e-300, 1e-12])
            found[path[:-1]] = st.one_of(
                st.sampled_from(bounds), st.floats(low, high, exclude_min="minimum" not in part)
            )

    collect("", schema)
    for key in ("integration.duration", "output.rate", "vehicle.spacing", "contact.creep.table"):
        found.pop(key, None)
    return found


@examples(60)
@given(data=st.data(), keys=st.lists(st.sampled_from(sorted(within_schema())), min_size=1, max_size=6, unique=True))
def test_scenes_at_the_bounds_of_what_is_allowed(folder, data, keys):
    values = {key: data.draw(within_schema()[key], key) for key in keys}
    if values.get("integration.step"):
        values["integration.step"] = max(values["integration.step"], 1e-7)
    (folder / "scene.yaml").write_text(yaml.dump(base_scene()))
    sets = [f"--set={key}={json.dumps(value)}" for key, value in values.items()]
    out = folder / "out" / "run.h5"
    bound = ["--set=integration.most_steps=300"]
    check_command(["simulate", folder / "scene.yaml", *bound, *sets, "--out", out], folder / "out", out)


@examples(100)
@given(track=spoiled(TRACK))
def test_tracks(folder, track):
    simulate_text(folder, yaml.dump(base_scene() | {"track": track}))


ONE_SIDED = {
    "wheel": {"profile": "S1002", "left": {"profile": "cone:1/20", "rolling_radius": 0.4595},
              "wheelsets": {"wheelset": {"right": {"rolling_radius": 0.46}}}},
    "rail": {"profile": "UIC60-MBench", "inclination": "1/40", "right": {"profile": "60E1", "inclination": "1/20"}},
}  # fmt: skip


@examples(50)
@given(pairs=spoiled(ONE_SIDED))
def test_wheels_and_rails_that_differ(folder, pairs):
    simulate_text(folder, yaml.dump(base_scene() | pairs))


PATHOLOGIES = [
    b"", b"\n", b"# nothing\n", b"\t- a\n", b"a:\n\tb: 1\n", b"- 1\n- 2\n", b"just text\n", b"1.5\n",
    b"\xff\xfe\x00n\x00", b"name: \xe9\n", b"a: &a [*a]\n", b"&a a: *a\n", b"&a {b: *a}\n", b"a: &a {b: *a}\n",
    b"a: *nowhere\n", b"a: 1\na: 2\n", b"? [1, 2]\n: 3\n", b"? {a: 1}\n: 2\n", b"--- 1\n--- 2\n",
    b"!!python/object:os.system {}\n", b"%YAML 9.9\n---\na: 1\n", b"a: !!binary x\n", b"a: 2001-99-99\n",
    b"a: !!int x\n", b"<<: 1\n", b"<<: [1]\n", b"1: 2\n", b"a: !!float ''\n", b"a: 1:99:99\n", b"a: 0o9\n", b"a: 0b\n",
    b"[" * 3000, b"{a: " * 3000, b"a: " + b"9" * 5000 + b"\n",
    b"a: &a [x,x,x,x,x,x,x,x,x]\nb: &b [*a,*a,*a,*a,*a,*a,*a,*a,*a]\nc: &c [*b,*b,*b,*b,*b,*b,*b,*b,*b]\n", b"\x00",
    b"a: \x07", b"!!set {a, b}\n", b"!!omap [a: 1]\n", b"? \n", b": \n", b"null: 1\n", b"=: 1\n", b"a: =\n",
    b"name: x\n<<: {speed: 1}\n",
]  # fmt: skip


@pytest.mark.parametrize("text", PATHOLOGIES)
def test_yaml_that_is_no_scene(folder, text):
    assert simulate_text(folder, text) == 2
    (folder / "vehicle.yaml").write_bytes(text)
    assert simulate_text(folder, yaml.dump(base_scene() | {"vehicle": {"parameters": "vehicle.yaml"}})) == 2


def test_a_document_that_contains_itself_is_refused(folder):
    text = yaml.dump(base_scene())
    assert simulate_text(folder, text.replace("initial:\n", "initial: &i\n  y: *i\n")) == 2


def test_whole_numbers_may_be_written_with_a_point(folder):
    spectrum = TRACK["irregularity"]["spectrum"] | {"seed": 3.0}
    changes = {"track": TRACK | {"irregularity": {"spectrum": spectrum, "fade_in": 5.0}}}
    changes["vehicle"] = {"parameters": "vehicles/suspended_wheelset.yaml", "count": 2.0, "spacing": 3.0}
    changes["integration"] = base_scene()["integration"] | {"most_steps": 1000.0}
    changes["initial"] = {"y": 0.001}  # and no drive: bodies of a train have other names
    train = {key: value for key, value in (base_scene() | changes).items() if key not in ("track", "drive")}
    assert simulate_text(folder, yaml.dump(train)) == 0
    assert simulate_text(folder, yaml.dump(base_scene() | {"track": changes["track"]})) == 0


@examples(60)
@given(text=st.one_of(st.binary(max_size=60), st.deferred(lambda: spoiled_text(yaml.dump(base_scene())))))
def test_text_of_scenes(folder, text):
    try:
        data = yaml.safe_load(text)
        long = isinstance(data, dict) and bounded(json.loads(json.dumps(data, default=str))) != data
    except Exception:  # whatever the parser or a constructor of the text objects to: the command must not
        long = False
    if not long:
        simulate_text(folder, text)


@cache
def vehicle_data(name):
    return read_yaml(ROOT / "config" / "vehicles" / f"{name}.yaml")


@examples(150)
@given(data=st.sampled_from(VEHICLES).flatmap(lambda name: spoiled(vehicle_data(name))))
def test_vehicles(data):
    try:
        build_vehicle(data, "vehicle.yaml", random.Random(0).random() < 0.5)
    except InputError as error:
        assert "\n" not in str(error)


@examples(60)
@given(data=st.sampled_from(VEHICLES[:2]).flatmap(lambda name: spoiled(vehicle_data(name))))
def test_runs_of_spoiled_vehicles(folder, data):
    (folder / "vehicle.yaml").write_text(yaml.dump(data))
    simulate_text(folder, yaml.dump(base_scene() | {"vehicle": {"parameters": "vehicle.yaml"}}))


@examples(50)
@given(
    overrides=st.lists(
        st.one_of(
            texts,
            st.builds("{}={}".format, texts, texts),
            st.builds(
                "{}={}".format,
                st.sampled_from(
                    ["speed", "contact.friction", "integration.rtol", "output.channels", "track", "initial.y"]
                ),
                st.one_of(texts, numbers, junk),
            ),
        ),
        min_size=1,
        max_size=3,
    )
)
def test_overrides(folder, overrides):
    (folder / "scene.yaml").write_text(yaml.dump(base_scene()))
    out = folder / "out" / "run.h5"
    sets = [word for override in overrides for word in ("--set", override)]
    check_command(["simulate", folder / "scene.yaml", *sets, "--out", out], folder / "out", out)


SWEEP = {
    "name": "fuzz", "scene": "scene.yaml", "set": {"output.rate": 500.0}, "sampling": {"kind": "grid"},
    "keys": {"speed": {"from": 20.0, "to": 30.0, "steps": 2}, "contact.detection": {"values": ["planar", "spatial"]}},
    "measures": ["y_rms_m", "Q_min_N", "steps"], "begin": 0.0, "window": 0.002, "batch": 3,
}  # fmt: skip


def test_a_grid_beyond_reason_is_refused(folder):
    (folder / "scene.yaml").write_text(yaml.dump(base_scene()))
    axis = {"from": 1.0, "to": 2.0, "steps": 100_000}
    keys = {"speed": axis, "contact.friction": axis | {"from": 0.1, "to": 0.5}}
    (folder / "sweep.yaml").write_text(yaml.dump(SWEEP | {"keys": keys}))
    out = folder / "out" / "sweep.csv"
    assert check_command(["sweep", folder / "sweep.yaml", "--out", out], folder / "out", out) == 2


@examples(50)
@given(data=spoiled(SWEEP))
def test_sweeps(folder, data):
    (folder / "scene.yaml").write_text(yaml.dump(base_scene()))
    path, out = folder / "sweep.yaml", folder / "out" / "sweep.csv"
    path.write_text(yaml.dump(data))
    try:
        sweep = load_sweep(path)
    except InputError as error:
        assert "\n" not in str(error)
    else:
        changed = {key.split(".")[0] for key in (*data["keys"], *data.get("set", ()))}
        if len(sweep.runs) < 50 and "integration" not in changed:  # which might last
            check_command(["sweep", path, "--out", out], folder / "out", out)


OPTIONS = {
    "--wheel": "S1002", "--rail": "UIC60-MBench", "--inclination": "1/40", "--gauge": "1.435",
    "--rolling-radius": "0.46",
    "--tape-circle-half-distance": "0.75", "--shear-modulus": "8.2e10", "--poisson-ratio": "0.28",
    "--wheel-load": "1e4", "--detection": "planar", "--patch": "moment",
}  # fmt: skip
CONICITY = {
    "--wheel": "S1002", "--rail": "UIC60-MBench", "--inclination": "1/40", "--gauge": "1.435",
    "--rolling-radius": "0.46",
    "--right-rolling-radius": "0.46", "--tape-circle-half-distance": "0.75", "--amplitudes-from": "0.002",
    "--to": "0.003", "--step": "0.001",
}  # fmt: skip


def spoiled_options(options):
    values = st.one_of(texts, numbers.map(str), st.sampled_from(["S1002", "cone:1/20", "circle:0.3", "cone:", "x.csv"]))
    return st.dictionaries(st.sampled_from([*options, "--nothing"]), values, min_size=1, max_size=2).map(
        lambda wrong: [f"{key}={value}" for key, value in (options | wrong).items()]
    )


@examples(50)
@given(options=spoiled_options(OPTIONS))
def test_options_of_contact(folder, options):
    (folder / "poses.csv").write_text(POSES)
    out = folder / "out" / "patches.csv"
    check_command(["contact", "--poses", folder / "poses.csv", *options, "--out", out], folder / "out", out)


@examples(30)
@given(options=spoiled_options(CONICITY))
def test_options_of_conicity(folder, options):
    out = folder / "out" / "conicity.csv"
    check_command(["conicity", *options, "--out", out], folder / "out", out)


@examples(20)
@given(
    words=st.lists(
        st.one_of(texts, st.sampled_from(["simulate", "creep", "table", "build", "info", "--out", "--set"])), max_size=5
    )
)
def test_words(words):
    status, _, err = run_command(words)
    assert status in (0, 2) and (status == 0 or err.count("\n") == 1), err

"""Spoiled documents and options: there is a whole result, or one line that says what was expected where.

``WRCORE_ATTACK=10 pytest tests/attacks`` tries ten times as many inputs.
"""

import json
import random
from functools import cache

import numpy as np
import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from tests.attacks.generator import (
    allowed,
    examples,
    junk,
    numbers,
    part_at,
    schema_of,
    spoiled,
    spoiled_options,
    spoiled_text,
    texts,
)
from tests.attacks.outcomes import (
    ONE_SIDED,
    TRACK,
    base_scene,
    bounded,
    check_command,
    run_command,
    simulate_text,
)
from tests.conftest import ELLIPTIC, ROOT
from wrcore.analysis.wear.evolve import load_wear_plan
from wrcore.errors import InputError
from wrcore.errors.checked_yaml import read_yaml
from wrcore.integrate.integrator import STALL_ATTEMPTS
from wrcore.run.simulate import simulate
from wrcore.scene.description import load_scene
from wrcore.sweep.plan import load_sweep
from wrcore.vehicle.description import build_vehicle

pytestmark = pytest.mark.usefixtures("no_new_tables")

VEHICLES = ("wheelset", "suspended_wheelset", "trailer_vehicle", "metro_car")


@cache
def vehicle_data(name):
    return read_yaml(ROOT / "config" / "vehicles" / f"{name}.yaml")


@cache
def scenes():
    """The base scene, also on a track, with profiles that differ by side, and with its vehicle inside."""
    base = base_scene()
    inside = base["vehicle"] | {"parameters": vehicle_data("suspended_wheelset")}
    return [base, base, base | {"track": TRACK}, base | ONE_SIDED, base | {"vehicle": inside}]


@examples(120)
@given(data=st.deferred(lambda: st.sampled_from(scenes()).flatmap(lambda one: spoiled(one, schema_of("scene")))))
def test_spoiled_scene_is_refused_or_run(folder, data):
    simulate_text(folder, yaml.dump(bounded(data)))


@examples(40)
@given(data=st.sampled_from(VEHICLES).flatmap(lambda name: spoiled(vehicle_data(name), schema_of("vehicle"))))
def test_spoiled_vehicle_is_refused_or_built(data):
    try:
        build_vehicle(data, "vehicle.yaml", random.Random(0).random() < 0.5)
    except InputError as error:
        assert "\n" not in str(error)


SWEEP = {
    "name": "fuzz", "scene": "scene.yaml", "set": {"output.rate": 500.0}, "sampling": {"kind": "grid"},
    "keys": {"speed": {"from": 20.0, "to": 30.0, "steps": 2}, "contact.detection": {"values": ["planar", "spatial"]}},
    "measures": ["y_rms_m", "Q_min_N", "steps"], "begin": 0.0, "window": 0.002, "batch": 3,
}  # fmt: skip


@examples(20)
@given(data=spoiled(SWEEP, schema_of("sweep")))
def test_spoiled_sweep_is_refused_or_run(folder, data):
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


def test_a_grid_beyond_reason_is_refused(folder):
    (folder / "scene.yaml").write_text(yaml.dump(base_scene()))
    axis = {"from": 1.0, "to": 2.0, "steps": 100_000}
    keys = {"speed": axis, "contact.friction": axis | {"from": 0.1, "to": 0.5}}
    (folder / "sweep.yaml").write_text(yaml.dump(SWEEP | {"keys": keys}))
    out = folder / "out" / "sweep.csv"
    assert check_command(["sweep", folder / "sweep.yaml", "--out", out], folder / "out", out) == 2


PLAN = {
    "name": "p", "scene": str(ELLIPTIC / "suspended_wheelset.yaml"), "distance": 1e4, "begin": 0.0, "rate": 100.0,
    "set": {"integration.duration": 0.4, "contact.friction": 0.3}, "limits": {"Sh": 0.035}, "law": "energy",
    "scenes": [{"share": 1.0}, {"share": 2.0, "set": {"speed": 30.0}}],
}  # fmt: skip


@examples(30)
@given(data=spoiled(PLAN, schema_of("wear")))
def test_spoiled_wear_plan_is_refused_or_read(data):
    try:
        load_wear_plan(data)
    except InputError as error:
        assert "\n" not in str(error)


PATHOLOGIES = [
    b"", b"\n", b"# nothing\n", b"\t- a\n", b"a:\n\tb: 1\n", b"- 1\n- 2\n", b"just text\n", b"1.5\n",
    b"\xff\xfe\x00n\x00", b"name: \xe9\n", b"a: &a [*a]\n", b"&a a: *a\n", b"&a {b: *a}\n", b"a: &a {b: *a}\n",
    b"a: *nowhere\n", b"a: 1\na: 2\n", b"? [1, 2]\n: 3\n", b"? {a: 1}\n: 2\n", b"--- 1\n--- 2\n",
    b"!!python/object:os.system {}\n", b"%YAML 9.9\n---\na: 1\n", b"a: !!binary x\n", b"a: 2001-99-99\n",
    b"a: !!int x\n", b"<<: 1\n", b"<<: [1]\n", b"1: 2\n", b"a: !!float ''\n", b"a: 1:99:99\n", b"a: 0o9\n", b"a: 0b\n",
    b"a: &a [x,x,x,x,x,x,x,x,x]\nb: &b [*a,*a,*a,*a,*a,*a,*a,*a,*a]\nc: &c [*b,*b,*b,*b,*b,*b,*b,*b,*b]\n", b"\x00",
    b"a: \x07", b"!!set {a, b}\n", b"!!omap [a: 1]\n", b"? \n", b": \n", b"null: 1\n", b"=: 1\n", b"a: =\n",
    b"name: x\n<<: {speed: 1}\n",
]  # fmt: skip
GROWING = [
    lambda n: "a: " + "[" * n, lambda n: "a: " + "{a: " * n, lambda n: "- " * n, lambda n: "? " * n,
    lambda n: "".join(" " * min(k, 900) + "a:\n" for k in range(min(n, 2000))), lambda n: "a: " + '"' * n,
    lambda n: "".join(f"k{k}: 1\n" for k in range(n)), lambda n: "a: [" + "1," * n, lambda n: "!" * n,
    lambda n: "b0: &b0 [x]\n" + "".join(f"b{k}: &b{k} [*b{k - 1}, *b{k - 1}]\n" for k in range(1, min(n, 5000))),
    lambda n: "b0: &b0 {x: 1}\n" + "".join(
        f"b{k}: &b{k} {{<<: [{', '.join(9 * [f'*b{k - 1}'])}]}}\n" for k in range(1, min(n, 40))),
    lambda n: "a: " + "9" * n, lambda n: "a: 1" + ":30" * n, lambda n: "a: 0." + "0" * n, lambda n: "%TAG ! x\n" * n,
    lambda n: "--- {}\n" * n, lambda n: "a: |\n" + " x\n" * n, lambda n: "a: '" + "\n" * n, lambda n: "\t" * n,
    lambda n: "# " * n, lambda n: "&a " * n,
]  # fmt: skip
"""Documents that grow with a number: in depth, in length, in what their references mean."""


@pytest.mark.parametrize("size", [30, 100_000])
def test_yaml_that_is_no_scene_is_refused(folder, size):
    for text in (*PATHOLOGIES, *(grow(size).encode() for grow in GROWING)):
        assert simulate_text(folder, text) == 2
        if size == 30:
            (folder / "vehicle.yaml").write_bytes(text)
            assert simulate_text(folder, yaml.dump(base_scene() | {"vehicle": {"parameters": "vehicle.yaml"}})) == 2


def test_a_document_that_contains_itself_is_refused(folder):
    text = yaml.dump(base_scene())
    assert simulate_text(folder, text.replace("initial:\n", "initial: &i\n  y: *i\n")) == 2


@pytest.mark.parametrize("change", [lambda text: "\ufeff" + text, lambda text: text.replace("\n", "\r\n"),
                                    lambda text: text.replace("\n", "\r")])  # fmt: skip
def test_scene_of_another_editor_is_the_same(tmp_path, change):
    text = yaml.dump(base_scene() | {"vehicle": {"parameters": vehicle_data("suspended_wheelset")}})
    (tmp_path / "scene.yaml").write_bytes(change(text).encode())
    (tmp_path / "plain.yaml").write_text(text)
    assert load_scene(tmp_path / "scene.yaml").data == load_scene(tmp_path / "plain.yaml").data


@pytest.mark.parametrize("speed", ["1:30", "1e5x", "2001-02-03", "yes", "'20'", "20 m/s", "20,5", "1/40", "nan", "-",
                                   "020", "0x10", "0b1", "1_000"])  # fmt: skip
def test_speed_that_is_no_plain_number_is_refused(folder, speed):
    text = (ELLIPTIC / "suspended_wheelset.yaml").read_text()
    assert "speed: 20.0" in text
    assert simulate_text(folder, text.replace("speed: 20.0", f"speed: {speed}")) == 2


def test_whole_numbers_may_be_written_with_a_point(folder):
    spectrum = TRACK["irregularity"]["spectrum"] | {"seed": 3.0}
    changes = {"track": TRACK | {"irregularity": {"spectrum": spectrum, "fade_in": 5.0}}}
    changes["vehicle"] = {"parameters": "vehicles/suspended_wheelset.yaml", "count": 2.0, "spacing": 3.0}
    changes["integration"] = base_scene()["integration"] | {"most_steps": 1000.0}
    changes["initial"] = {"y": 0.001}  # and no drive: bodies of a train have other names
    train = {key: value for key, value in (base_scene() | changes).items() if key not in ("track", "drive")}
    assert simulate_text(folder, yaml.dump(train)) == 0
    assert simulate_text(folder, yaml.dump(base_scene() | {"track": changes["track"]})) == 0


@examples(40)
@given(text=st.one_of(st.binary(max_size=60), st.deferred(lambda: spoiled_text(yaml.dump(base_scene())))))
def test_spoiled_text_is_refused_or_run(folder, text):
    try:
        data = yaml.safe_load(text)
        long = isinstance(data, dict) and bounded(json.loads(json.dumps(data, default=str))) != data
    except Exception:  # whatever the parser or a constructor of the text objects to: the command must not
        long = False
    if not long:
        simulate_text(folder, text)


KEYS = ["speed", "contact.friction", "integration.rtol", "output.channels", "track.gauge", "initial.y", "track.path"]


@examples(30)
@given(
    data=st.data(),
    key=st.sampled_from(KEYS),
    also=st.lists(st.one_of(texts, st.builds("{}={}".format, texts, texts)), max_size=2),
)
def test_spoiled_changes_are_refused_or_run(folder, data, key, also):
    part = part_at(schema_of("scene"), key.split("."))
    value = data.draw(st.one_of(texts, numbers, junk, allowed(part)))
    (folder / "scene.yaml").write_text(yaml.dump(base_scene()))
    out = folder / "out" / "run.h5"
    sets = [word for change in (f"{key}={value}", *also) for word in ("--set", change)]
    check_command(["simulate", folder / "scene.yaml", *sets, "--out", out], folder / "out", out)


PAIR = {"--wheel": "S1002", "--rail": "UIC60-MBench", "--inclination": "1/40"}
COMMANDS = {
    "contact": PAIR | {"--poses": "poses.csv", "--wheel-load": "1e4"},
    "conicity": PAIR | {"--amplitudes-from": "0.002", "--to": "0.003", "--step": "0.001"},
    "creep": {"--cases": "cases.csv", "--model": "she"},
}
POSES = "pose_id,y_m,yaw_rad,roll_rad,z_m\n1,0.001,0.002,,\n2,-0.003,0.0,0.0001,\n3,0.002,0.001,0,0.4599\n"
CASES = (
    "case_id,a_m,b_neg_m,b_pos_m,N_N,mu,G_Pa,nu,ux,uy,phi_per_m\n"
    "1,0.005,0.004,0.004,50000,0.3,8.2e10,0.28,0.001,0.0005,0.1\n"
    "2,0.006,0.003,0.003,60000,0.4,8.2e10,0.28,0.0,0.0005,-0.2\n"
)


@examples(60)
@given(words=st.sampled_from(sorted(COMMANDS)).flatmap(lambda name: spoiled_options(name, COMMANDS[name])))
def test_spoiled_options_are_refused_or_run(folder, words):
    (folder / "poses.csv").write_text(POSES)
    (folder / "cases.csv").write_text(CASES)
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        out = folder / "out" / "table.csv"
        check_command([*words, "--out", out], folder / "out", out)


@examples(10)
@given(
    words=st.lists(
        st.one_of(texts, st.sampled_from(["simulate", "creep", "table", "build", "info", "--out", "--set"])), max_size=5
    )
)
def test_words_that_are_no_command_are_refused(words):
    status, _, err = run_command(words)
    assert status in (0, 2) and (status == 0 or err.count("\n") == 1), err


# ----------------------------------------------------------------------------------------------- scenes that are legal

METHODS = (("tsit5", "rodas4"), ("rk45", "ros34pw2"), ("tsit5", "ros34pw2"), ("rk4", "rodas4"))
SAME_FOR, SAME_Y = 0.02, 5e-5
"""Runs by two methods are this close (m) for this long (s)."""


def drawn_scene(draw):
    """A scene file and changes to all its keys at random."""

    def log(low, high):
        return float(np.exp(draw.uniform(np.log(low), np.log(high))))

    source = ELLIPTIC / f"{draw.choice(('wheelset', *2 * ('suspended_wheelset',), 'trailer_vehicle'))}.yaml"
    law = draw.choice((*3 * ("table",), *2 * ("she", "polach", "linear"), "fastsim"))
    changes = {
        "speed": log(3.0, 120.0), "initial.y": draw.uniform(-0.012, 0.012), "initial.yaw": draw.uniform(-0.02, 0.02),
        "wheel.profile": draw.choice(("S1002", "S1002", "cone:1/20")),
        "rail.profile": draw.choice(("60E1", "54E1", "49E1")),
        "rail.inclination": draw.choice((0, "1/40", "1/20")), "track.gauge": draw.uniform(1.425, 1.46),
        "contact.detection": draw.choice(("planar", "spatial", "auto")), "contact.friction": log(0.01, 0.9),
        "contact.patch": draw.choice(("moment", "maximum")), "contact.creep.model": law,
        "contact.normal.damping.c_e": draw.uniform(0.3, 1.0), "contact.normal.damping.v0": log(1e-3, 1.0),
        "contact.material.shear_modulus": log(2e10, 2e11), "contact.creep.least_speed": log(1e-3, 0.1),
        "contact.material.poisson_ratio": 0.28 if law == "table" else draw.uniform(0.0, 0.5),
        "integration.baumgarte.alpha": log(1.0, 100.0), "integration.baumgarte.beta": log(1.0, 100.0),
        "integration.rtol": log(1e-6, 1e-4), "integration.atol": log(1e-9, 1e-7), "integration.duration": 0.3,
        "output.rate": draw.choice((50.0, 200.0, 1000.0)), "output.channels": ["pose"],
    }  # fmt: skip
    if draw.random() < 0.3:
        spectrum = {"level": draw.choice(("low", "high")), "seed": draw.randrange(99), "length": 100.0, "begin": 2.0}
        changes["track.irregularity"] = {"spectrum": spectrum}
    return source, changes


@examples(25)
@given(draw=st.randoms(use_true_random=False))
def test_scene_drawn_at_random_says_how_it_ends_and_begins_alike_by_two_methods(draw):
    source, changes = drawn_scene(draw)
    methods, runs, refused = draw.choice(METHODS), [], 0
    for method in methods:
        try:
            runs.append(simulate(load_scene(source, {**changes, "integration.method": method}), progress=False))
        except InputError as error:
            refused += 1
            assert "\n" not in str(error)
            continue
        run = runs[-1]
        assert run.counters["steps"] + run.counters["rejected"] <= 3 * STALL_ATTEMPTS, run.status
        assert bool(run.reason) == (run.status != "completed") and np.isfinite(run.t).all()
        assert all(np.isfinite(values).all() for group in run.groups.values() for values in group.values())
    assert refused in (0, 2)
    if runs:
        count = min(len(run.t[run.t <= SAME_FOR]) for run in runs)
        for name in runs[0].groups:
            one, two = (run[name].y_m[:count] for run in runs)
            np.testing.assert_allclose(one, two, rtol=0.0, atol=SAME_Y, err_msg=f"{methods} {name}")

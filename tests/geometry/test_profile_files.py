"""Readers of profile files: conventions, every fault, random text."""

import os
from argparse import Namespace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

from wrcore.cli import parser
from wrcore.cli.common.options import profile_of
from wrcore.errors import InputError
from wrcore.geometry.profiles.files import read_profile
from wrcore.geometry.profiles.profile import ProfileCurve
from wrcore.geometry.profiles.standards import named_profile

SHARED = Path(os.environ.get("WRCORE_SHARED", Path(__file__).parents[3] / "shared"))

U = np.linspace(-0.060, 0.055, 1151)  # m, wheel
HEADER = """header.begin
  version = 1 ! Version flag
  type = {type} ! 0=rail profile, 1=wheel profile
header.end
spline.begin
  type = 0 ! Original data file type
{keys}
  point.begin
"""
KEYS = {
    "approx.smooth": "0", "shift.y": "0", "shift.z": "0", "rotate": "0", "bound.y.min": "1", "bound.y.max": "0",
    "mirror.y": "0", "mirror.z": "0", "inversion": "0", "units.len.f": "1000", "units.ang.f": "1",
}  # fmt: skip


def wheel():
    return named_profile("S1002", "wheel")


def columns(u, f, scale=1e3, separator=","):
    return "".join(f"{scale * a:.9f}{separator}{scale * b:.9f}\n" for a, b in zip(u, f, strict=True))


def simpack(points, type_=1, **keys):
    changed = {**KEYS, **{k.replace("_", "."): v for k, v in keys.items()}}
    lines = "\n".join(f"  {k} = {v} ! comment" for k, v in changed.items() if v is not None)
    return HEADER.format(type=type_, keys=lines) + points + "point.end\nspline.end\n"


def write(folder, name, text):
    path = folder / name
    path.write_text(text)
    return path


def deviation(curve):
    """Largest difference to S1002, m; 1 nm covers the rounding of the written points."""
    return np.nanmax(np.abs(curve(U[5:-5]) - wheel()(U[5:-5])))


# --- columns ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("header", "unit", "scale", "separator"),
    [
        ("u_mm,f_mm\n", None, 1e3, ","),
        ("u_m,f_m\n", None, 1.0, ","),
        ("# S1002\nu_mm; f_mm\n", "mm", 1e3, ";"),
        ("U_mm,F_mm\n", None, 1e3, ","),
        ("% MATLAB's\n! or SIMPACK's\nu_mm\tf_mm % head\n", None, 1e3, "\t"),
        ("", "mm", 1e3, "   "),
        ("", "m", 1.0, "\t"),
        ("\ufeffu_mm,f_mm\n", None, 1e3, " , "),
        ("u,f\nmm,mm\n", None, 1e3, ","),
        ("u [mm];f [mm]\n", "mm", 1e3, ";"),
        ("u (m)  f (m)\n", None, 1.0, "  "),
        ("u_inch,f_inch\n", None, 1.0 / 0.0254, ","),
        ("# u_mm f_mm\n", None, 1e3, " "),
        ("u f\n", "mm", 1e3, " "),
    ],
)
def test_columns_in_every_accepted_form(tmp_path, header, unit, scale, separator):
    text = header + columns(U, wheel()(U), scale, separator) + "\n# end\n"
    spec = {"points": write(tmp_path, "wheel.csv", text)}
    assert deviation(read_profile(spec | ({"unit": unit} if unit else {}), "wheel")) < 0.2e-6


def test_files_of_profile_meters_have_a_head_and_directions_of_their_own(tmp_path):
    head = "ProgramName=Some meter\nDate=2020-01-01\nXYPOINT_COUNT=1151\n\n"
    rows = "".join(
        f"{-1e3 * (u - 0.07):.9f} {-1e3 * (f + 0.46):.9f} 0.1 0.0\n" for u, f in zip(U, wheel()(U), strict=True)
    )
    path = write(tmp_path, "meter.txt", head + rows)
    spec = {"points": path, "unit": "mm", "mirrored": True, "downwards": True, "shift": [0.07, -0.46]}
    assert deviation(read_profile(spec, "wheel")) < 0.2e-6
    with pytest.raises(InputError, match="inside a wheel profile"):  # far from u = 0: the origin is missing
        read_profile(spec | {"shift": [0.4, 0.0]}, "wheel")


@pytest.mark.parametrize(
    ("change", "expected"),
    [
        ({"mirrored": 1}, "mirrored: expected true or false, got 1"),
        ({"downwards": "yes"}, "downwards: expected true or false"),
        ({"shift": 0.1}, "shift: expected two distances in m, within 1"),
        ({"shift": [70, 0]}, "shift: expected two distances in m, within 1"),
        ({"shift": [float("nan"), 0]}, "shift: expected two distances in m"),
        ({"points": "wheel.prw", "mirrored": True}, "a SIMPACK file states them itself"),
    ],
)
def test_wrong_directions_are_refused(change, expected):
    with pytest.raises(InputError, match=expected):
        read_profile({"points": "wheel.txt", "unit": "mm"} | change, "wheel")


def test_a_path_alone_and_a_name_are_the_same_entrance(tmp_path):
    path = write(tmp_path, "wheel.csv", "u_mm,f_mm\n" + columns(U, wheel()(U)))
    a, b = named_profile(str(path), "wheel"), named_profile({"points": str(path)}, "wheel")
    assert np.array_equal(a.f, b.f)
    assert str(path) in a.source


def test_a_point_file_is_inclined_only_on_request(tmp_path):
    upright, inclined = named_profile("60E1", "rail", 0), named_profile("60E1", "rail", 1 / 40)
    path = str(write(tmp_path, "rail.csv", "u_mm,f_mm\n" + columns(upright.u, upright.f)))
    inside = np.linspace(-0.030, 0.020, 101)
    as_is = named_profile(path, "rail")
    turned = named_profile({"points": path, "inclined": False}, "rail", 1 / 40)
    assert np.max(np.abs(as_is(inside) - upright(inside))) < 0.2e-6
    assert np.max(np.abs(turned(inside) - inclined(inside))) < 0.2e-6


@pytest.mark.parametrize(
    ("text", "spec", "says"),
    [
        ("", {}, "header u_m,f_m or u_mm,f_mm"),
        ("1 2\n", {}, "header u_m,f_m or u_mm,f_mm"),
        ("u_mm,f_mm\n", {}, "at least 8 points, got 0"),
        ("u_mm,f_m\n1,2\n", {}, "line 1: expected one unit"),
        ("u_mm,f_mm\n1,2\n", {"unit": "m"}, "line 1: expected one unit"),
        ("u_mm,f_mm\n1,2\nx,2\n", {}, "line 3: expected two numbers, got 'x,2'"),
        ("x,y\n1,2\n", {}, "line 1: expected two numbers, got 'x,y'; a header above them is u_m,f_m or u_mm,f_mm"),
        ("x1_mm;y1_mm\n1;2\n", {}, "got 'x1_mm;y1_mm'; a header above them is u_m,f_m or u_mm,f_mm: u to"),
        (
            "u,f\nmm,m\n1,2\n",
            {"unit": "mm"},
            "one unit for both columns (m, mm, inch, cm, um), got u in mm",
        ),
        ("u_kg,f_kg\n1,2\n", {}, "line 1: expected two numbers, got 'u_kg,f_kg'; a header above them is u_m,f_m"),
        ("u_mm,f_mm,w\n1,2\n", {}, "line 2: expected 3 numbers, got '1,2'"),
        ("u_mm,f_mm\n# c\n1\n", {}, "line 3: expected two numbers, got '1'\n"),
        ("u_mm,f_mm\n1,2\nu_mm,f_mm\n", {}, "line 3: expected two numbers"),
        ("u_mm,f_mm\n" + "".join(f"{i},nan\n" for i in range(9)), {}, "line 2: expected finite"),
        ("u_mm,f_mm\n#\n" + "".join(f"{i % 7},0\n" for i in range(9)), {}, "line 10: expected strictly monotone"),
        ("1 2\n", {"unit": "feet"}, "unit: expected one of m, mm, inch, cm, um, got 'feet'"),
        ("1 2\n", {"units": "mm"}, "units: expected one of"),
        ("1 2\n", {"mirrored": "no"}, "mirrored: expected true or false"),
        ("1 2\n", {"inclined": False}, "inclined: expected this of rails only"),
        ("1 2\n", {"smoothing": "much"}, "smoothing: expected a distance"),
    ],
)
def test_faults_in_columns_name_the_line(tmp_path, text, spec, says):
    with pytest.raises(InputError) as caught:
        read_profile({"points": str(write(tmp_path, "bad.csv", text)), **spec}, "wheel")
    assert says in str(caught.value) + "\n"
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(("header", "more"), [("u_mm,f_mm,weight", ",1"), ('"U_MM","F_MM","w","n"', ",0.5,7")])
def test_a_header_names_further_columns(tmp_path, header, more):
    rows = [row + more for row in columns(U, wheel()(U)).splitlines()]
    assert deviation(read_profile(str(write(tmp_path, "wheel.csv", "\n".join([header, *rows]))), "wheel")) < 0.2e-6


def test_a_point_that_is_there_twice_counts_once(tmp_path):
    rows = columns(U, wheel()(U)).splitlines()
    for name, change in (("one.csv", rows), ("two.csv", [*rows[:200], rows[199], *rows[200:], rows[-1]])):
        write(tmp_path, name, "\n".join(["u_mm,f_mm", *change]))
    one, two = (read_profile(str(tmp_path / name), "wheel") for name in ("one.csv", "two.csv"))
    assert np.array_equal(one.f, two.f)
    write(tmp_path, "two.csv", "\n".join(["u_mm,f_mm", *rows[:200], rows[199] + "1", *rows[200:]]))
    with pytest.raises(InputError, match="line 202: expected strictly monotone u"):  # the same u at another height
        read_profile(str(tmp_path / "two.csv"), "wheel")


@pytest.mark.parametrize("encoding", ["utf-16", "utf-16-be", "utf-16-le", "latin-1"])
def test_encodings_of_text(tmp_path, encoding):
    mark = "\ufeff" if encoding in ("utf-16-be", "utf-16-le") else ""
    (tmp_path / "wheel.txt").write_bytes(f"{mark}# gemessen für\nu_mm\tf_mm\n{columns(U, wheel()(U))}".encode(encoding))
    assert deviation(read_profile(str(tmp_path / "wheel.txt"), "wheel")) < 0.2e-6


def test_a_header_may_be_in_quotes(tmp_path):
    lines = "".join(f"{1e3 * u:.6f},{1e3 * f:.6f}\n" for u, f in zip(U, wheel()(U), strict=True))
    plain, quoted = (str(write(tmp_path, name, name + "\n" + lines)) for name in ("u_mm,f_mm", '"u_mm","f_mm"'))
    assert np.array_equal(read_profile(plain, "wheel")(U[5:-5]), read_profile(quoted, "wheel")(U[5:-5]))


def test_a_unit_mistake_is_noticed(tmp_path):
    path = str(write(tmp_path, "wheel.dat", columns(U, wheel()(U))))
    with pytest.raises(InputError, match="looks like mm: declare unit: mm"):
        read_profile({"points": path, "unit": "m"}, "wheel")


@pytest.mark.parametrize("unit", ["m", "mm"])
@pytest.mark.parametrize("is_inch", [True, False])
def test_unit_guess_names_the_unit_that_is_read(tmp_path, unit, is_inch):
    scale = 1.0 / 0.0254 if is_inch else {"m": 1e3, "mm": 1.0}[unit]
    path = write(tmp_path, "wheel.txt", columns(U, wheel()(U), scale))
    with pytest.raises(InputError, match="looks like (inch|mm|m): declare unit:") as caught:
        read_profile({"points": path, "unit": unit}, "wheel")
    advised = str(caught.value).rpartition("unit: ")[2]
    assert deviation(read_profile({"points": path, "unit": advised}, "wheel")) < 0.2e-6
    with pytest.raises(InputError, match=f"as of {advised}"):
        read_profile({"points": path}, "wheel")
    header = f"u_{unit},f_{unit}\n"
    with pytest.raises(InputError, match=f"looks like {advised}: u_{advised},f_{advised} in the header"):
        read_profile(write(tmp_path, "wheel.csv", header + path.read_text()), "wheel")


def test_side_faces_at_equal_abscissae_are_left_out_of_columns(tmp_path):
    rail = named_profile("60E1", "rail", 0)
    side = np.linspace(-0.030, rail.f[0] - 1e-4, 20)
    u = np.concatenate([np.full(20, rail.u[0]), rail.u, np.full(20, rail.u[-1])])
    path = write(tmp_path, "rail.csv", "u_mm,f_mm\n" + columns(u, np.concatenate([side, rail.f, side[::-1]])))
    inside = np.linspace(-0.034, 0.034, 681)
    assert np.max(np.abs(read_profile(str(path), "rail")(inside) - rail(inside))) < 1e-6


@pytest.mark.parametrize("smoothing", [0.001, 0])
def test_smoothing_at_its_bounds_is_accepted(tmp_path, smoothing):
    path = write(tmp_path, "wheel.csv", "u_mm,f_mm\n" + columns(U, wheel()(U)))
    read = read_profile({"points": str(path), "smoothing": smoothing}, "wheel")
    assert abs(float(read(0.0))) < 1e-9 and np.max(np.abs(read(U) - wheel()(U))) < max(2.0 * smoothing, 1e-6)


@pytest.mark.parametrize("spec", [{}, {"points": 3}, {"points": ""}, "absent.csv", "a\0b.csv"])
def test_a_file_that_cannot_be_read_is_one_clear_line(spec):
    with pytest.raises(InputError):
        read_profile(spec, "wheel")


def test_bytes_that_are_no_text_are_one_clear_line(tmp_path):
    path = tmp_path / "wheel.csv"
    path.write_bytes(b"u_mm,f_mm\n\xff\xfe\x00\x01\n")
    with pytest.raises(InputError, match="line 2: expected two numbers"):
        read_profile(str(path), "wheel")


# --- SIMPACK ---------------------------------------------------------------------------------------------------------


def down(u, f):
    """y, z lines of a SIMPACK file: z down."""
    return columns(u, -f)


@pytest.mark.parametrize(
    ("points", "keys"),
    [
        (lambda u, f: down(u, f), {}),
        (lambda u, f: down(-u, f), {"mirror.y": "1"}),
        (lambda u, f: down(u, -f), {"mirror.z": "1"}),
        (lambda u, f: down(u[::-1], f[::-1]), {"inversion": "1"}),
        (lambda u, f: down(-u, f), {"mirror.y": "1", "inversion": "1"}),
        (lambda u, f: columns(u, -f, 1.0), {"units.len.f": "+1.0E+00"}),
        (lambda u, f: down(u - 0.003, f), {"shift.y": "3"}),
        (lambda u, f: "! comment\n!1 2\n\n" + down(u, f).replace("\n", " 1.0 ! weight\n"), {}),
        (lambda u, f: "-200. 0.\n" + down(u, f), {"bound.y.min": "-100", "bound.y.max": "100"}),
        (lambda u, f: down(u, f), {"rotate": None, "approx.smooth": None, "shift.y": None}),
    ],
)
def test_simpack_keys_are_applied(tmp_path, points, keys):
    path = write(tmp_path, "wheel.prw", simpack(points(U, wheel()(U)), **keys))
    assert deviation(read_profile(str(path), "wheel")) < 0.2e-6


def test_simpack_bounds_cut_the_points(tmp_path):
    path = write(tmp_path, "wheel.prw", simpack(down(U, wheel()(U)), bound_y_min="-50", bound_y_max="40"))
    curve = read_profile(str(path), "wheel")
    assert np.allclose([curve.u[0], curve.u[-1]], [-0.05, 0.04], rtol=0.0, atol=1e-4)


def test_simpack_steep_sides_are_trimmed_to_the_head(tmp_path):
    """Rail sides that turn back by rounding do not stop the reader (SIMPACK reads the head, too)."""
    rail = named_profile("60E1", "rail", 1 / 40)
    u, f = np.append(rail.u, rail.u[-1] - 1e-5), np.append(rail.f, rail.f[-1] - 0.004)
    path = write(tmp_path, "rail.prr", simpack(down(u, f), type_=0))
    curve = read_profile(str(path), "rail")
    inside = np.linspace(-0.04, 0.025, 651)
    assert np.max(np.abs(curve(inside) - rail(inside))) < 0.2e-6


@pytest.mark.parametrize(
    ("change", "says"),
    [
        (lambda t: t.replace("type = 1", "type = 0", 1), "type: expected a wheel profile, got a rail"),
        (lambda t: t.replace("type = 1", "type = 7", 1), "type: expected 0 (rail) or 1 (wheel)"),
        (lambda t: t[: t.index("point.begin")], "point.begin"),
        (lambda t: t[: t.index("point.end")], "point.end"),
        (lambda t: t[: t.rindex("\n", 0, -700) + 1], "truncated"),
        (lambda t: t.replace("units.len.f = 1000", "units.len.f = 0"), "units.len.f: expected a positive"),
        (lambda t: t.replace("units.len.f = 1000", ""), "units.len.f: expected a number, got None"),
        (lambda t: t.replace("units.len.f = 1000", "units.len.f = mm"), "units.len.f: expected a number, got 'mm'"),
        (lambda t: t.replace("units.len.f = 1000", "units.len.f = 1"), "looks like mm"),
        (lambda t: t.replace("rotate = 0", "rotate = 0.025"), "rotate: expected 0"),
        (lambda t: t.replace("approx.smooth = 0", "approx.smooth = 0.1"), "approx.smooth: expected 0"),
        (lambda t: t.replace("mirror.y = 0", "mirror.y = 1"), "flange at negative u"),
        (lambda t: t.replace("point.begin\n", "point.begin\n12.0\n"), "line 19: expected two numbers, got '12.0'"),
        (lambda t: t.replace("point.begin\n", "point.begin\n12.0 zwei\n"), "line 19: expected two numbers"),
    ],
)
def test_faults_in_simpack_files(tmp_path, change, says):
    text = change(simpack(down(U, wheel()(U))))
    with pytest.raises(InputError) as caught:
        read_profile(str(write(tmp_path, "bad.prw", text)), "wheel")
    assert says in str(caught.value)
    assert "bad.prw" in str(caught.value)


def test_own_smoothing_replaces_simpacks(tmp_path):
    path = write(tmp_path, "wheel.prw", simpack(down(U, wheel()(U)), approx_smooth="0.1"))
    assert deviation(read_profile({"points": str(path), "smoothing": 1e-9}, "wheel")) < 0.2e-6


# --- files of others -------------------------------------------------------------------------------------------------


def shared_file(*parts):
    path = SHARED.joinpath(*parts)
    if not path.exists():
        pytest.skip(f"{path.name} is not ours to distribute; set WRCORE_SHARED to the folder that holds it")
    return str(path)


def test_benchmark_wheel_file_is_the_named_wheel():
    """The file's points lie 0.35 mm apart; where the curvature jumps a spline is off by a few 0.1 um between them."""
    curve = read_profile(shared_file("reference", "MBench_S1002_v3.prw"), "wheel")
    u = np.linspace(-0.062, 0.059, 2421)
    assert np.max(np.abs(curve(u) - wheel()(u)) / np.hypot(1.0, wheel()(u, 1))) < 0.25e-6


def test_benchmark_rail_file_is_the_named_rail_6_um_aside():
    curve = read_profile(shared_file("reference", "MBench_UIC60_v3.prr"), "rail")
    rail = named_profile("UIC60-MBench", "rail", 1 / 40)
    aside = 0.3 * np.sin(np.arctan(1 / 40)) - 7.4917e-3
    u = rail.u[np.abs(rail.df) <= 5.0]
    assert np.max(np.abs(curve(u + aside) - rail(u)) / np.hypot(1.0, rail(u, 1))) < 0.2e-6
    assert curve.gauge_offset() + aside == pytest.approx(rail.gauge_offset(), abs=0.2e-6)


@pytest.mark.parametrize("name", ["RUIC519A", "RUIC519B", "RUIC519H", "RUIC519I"])
def test_en15302_wheels_are_read_as_they_are(name):
    """Flange tip at u = -55 mm, f = -28 mm, as in the files."""
    curve = read_profile({"points": shared_file("facts", "uic519", f"{name}.dat"), "unit": "mm"}, "wheel")
    assert curve.u[np.argmin(curve.f)] == pytest.approx(-0.055, abs=1e-4)
    assert curve.f.min() == pytest.approx(-0.028, abs=1e-6)


def test_en15302_rail_has_gauge_1435_16():
    """Its origin is not its top: half gauge 717.5 mm at z = -14 mm becomes 717.58 mm 14 mm below the top (FACTS 3)."""
    path = shared_file("facts", "uic519", "SUIC519A.dat")
    curve = read_profile({"points": path, "unit": "mm"}, "rail")
    top = 14.3325e-3  # highest listed point
    assert 2.0 * (0.7175 + 0.0325 + top - curve.gauge_offset()) == pytest.approx(1.43516, abs=0.2e-3)


# --- random text -----------------------------------------------------------------------------------------------------

WORDS = st.sampled_from(
    ["header.begin", "type = 1", "type=0", "point.begin", "point.end", "units.len.f = 1000", "mirror.y = 1",
     "u_mm,f_mm", "rotate = 1e999", "bound.y.min = -1", "shift.z = nan", "#", "!", "1,2", "-3.5 2", "1e308 1",
     "nan nan", "1_0;2"]
)  # fmt: skip
NUMBER = st.floats(-80.0, 80.0) | st.sampled_from([0.0, 1e-9, 1e300, float("nan"), float("-inf")])
POINTS = st.lists(st.tuples(NUMBER, NUMBER).map(lambda p: f"{p[0]!r}, {p[1]!r}"), max_size=25)
SORTED = st.lists(st.floats(-80.0, 80.0), min_size=8, max_size=25, unique=True).flatmap(
    lambda u: st.lists(st.floats(-40.0, 40.0), min_size=len(u), max_size=len(u)).map(
        lambda f: [f"{a!r}, {b!r}" for a, b in zip(sorted(u), f, strict=True)]
    )
)


@settings(deadline=None, max_examples=200, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    lines=st.lists(WORDS | st.text(max_size=20), max_size=12) | POINTS | SORTED,
    kind=st.sampled_from(["wheel", "rail"]),
    suffix=st.sampled_from([".csv", ".prw"]),
)
@example(lines=["0,0"] * 9, kind="rail", suffix=".csv")
def test_random_text_gives_a_profile_or_an_input_error(tmp_path, lines, kind, suffix):
    text = "\n".join(lines)
    if suffix == ".prw" and lines and "," in lines[0]:
        text = simpack(text.replace(",", " ") + "\n", type_=1 if kind == "wheel" else 0)
    path = tmp_path / f"random{suffix}"
    path.write_bytes(text.encode("utf-8", errors="replace"))
    try:
        curve = read_profile({"points": str(path), "unit": "mm"} if suffix == ".csv" else str(path), kind)
    except InputError as error:
        assert "\n" not in str(error)
    else:
        assert isinstance(curve, ProfileCurve)
        assert np.all(np.isfinite([curve.f, curve.df, curve.d2f]))


def test_commands_smooth_profiles_of_files(tmp_path):
    u = np.arange(-0.03, 0.0301, 2e-4)
    noise = 4e-6 * np.random.default_rng(0).standard_normal(u.size)
    points = np.column_stack([u, 0.05 * u + noise])
    np.savetxt(tmp_path / "wheel.csv", points, delimiter=",", header="u_m,f_m", comments="")
    bends = []
    for smoothing in (None, 1e-5):
        options = Namespace(unit=None, smoothing=smoothing, inclination=None)
        bends.append(np.abs(np.diff(profile_of(options, str(tmp_path / "wheel.csv"), "wheel").df)).max())
    assert bends[1] < 0.05 * bends[0]
    pair = ["--wheel", "a", "--rail", "b", "--out", "c", "--smoothing", "1"]
    for command in (["contact", "--poses", "d", "--wheel-load", "1"], ["conicity"]):
        with pytest.raises(InputError, match="smoothing"):
            profile_of(parser().parse_args([*command, *pair]), str(tmp_path / "wheel.csv"), "wheel")


@pytest.mark.parametrize(("step", "told"), [(20, False), (80, True)])
def test_points_that_leave_the_shape_open_are_told(tmp_path, capfd, step, told):
    """Every 2 mm of a wheel nothing is said; of points 8 mm apart the flange's shape lies between."""
    u = U[5:-5:step]
    read_profile({"points": write(tmp_path, "wheel.csv", "u_mm,f_mm\n" + columns(u, wheel()(u)))}, "wheel")
    assert ("the curve may be wrong by as much" in capfd.readouterr().err) == told

"""Measured signals are read from text, MATLAB and HDF5 files as programs write them; damaged files name the fault."""

import h5py
import numpy as np
import pytest
import scipy.io

import wrcore as wr
from wrcore.signals import hdf5_file
from wrcore.signals.mat_file import read_mat5

T = np.round(np.arange(0.0, 0.05, 0.005), 6)
AY = np.round(np.sin(40.0 * T), 4)  # m/s^2
Q = 50e3 + 1e3 * np.round(np.cos(30.0 * T), 4)  # N
WANTED = {"Acc Y": "car_body.ay_m_per_s2", "Q11": "wheelset/left.Q_N"}


def text(header, row, separator="\n", end="\n"):
    """Lines of a file: header, then a row a sample, made of time (s), acceleration (m/s^2) and force (kN)."""
    return separator.join([*header, *(row(t, a, q / 1e3) for t, a, q in zip(T, AY, Q, strict=True))]) + end


def comma(*numbers):
    return ";".join(f"{value:.6f}".replace(".", ",") for value in numbers)


def clock(t, a, q):
    """A row whose time passes midnight."""
    return (
        f"23:59:59,{980 + 1e3 * t:03.0f};{comma(a, q)}" if t < 0.02 else f"00:00:00,{1e3 * t - 20:03.0f};{comma(a, q)}"
    )


def with_thousands(t, a, q):
    return f"{t:,.3f};{1e3 * a:,.1f};{1e3 * q:,.1f}".translate(str.maketrans(",.", ".,"))


TITLES = "Acc Y [m/s2]{0}Q11 [kN]"
FILES = {
    "comma": text(["time [s]," + TITLES.format(",")], lambda *row: "{:.3f},{:.4f},{:.4f}".format(*row)),
    "spreadsheet": text(["sep=;", "Zeit [s];Acc Y [m/s²];Q11 [kN]"], comma),
    "units_row": text(["Time;Acc Y;Q11", "s;m/s^2;kN"], comma),
    "units_row_in_brackets": text(
        ["Time\tAcc Y\tQ11", "[ms]\t[mm/s2]\t[N]"], lambda t, a, q: f"{1e3 * t}\t{1e3 * a}\t{1e3 * q}"
    ),
    "quoted": text(['"Time (s)","Acc Y (m/s/s)","Q11 (kN)"'], lambda *row: ",".join(f'"{v:.5f}"' for v in row)),
    "quoted_decimal_commas": text(
        ['"Time (s)","Acc Y (m/s2)","Q11 (kN)"'], lambda *row: ",".join(f'"{v:.5f}"'.replace(".", ",") for v in row)
    ),
    "blanks": text(
        ["# test drive 4", "# Time/s   Acc_Y/(m/s2)   Q11/kN"], lambda *row: " {:9.4f} {:9.4f}  {:9.4f}".format(*row)
    ),
    "logger": text(
        ["Logger 7;serial;0815", "Operator;A. B.", "Sampling rate;200;Hz", "", "Acc Y;Q11", "m/s2;kN"],
        lambda t, a, q: comma(a, q),
    ),
    "rate_with_equals": text(["fs = 0.2 kHz", TITLES.format("\t")], lambda t, a, q: f"{a:.4f}\t{q:.4f}"),
    "interval": text(['"Sample interval","5","ms"', '"Acc Y [m/s2]","Q11 [kN]"'], lambda t, a, q: f"{a:.4f},{q:.4f}"),
    "clock": text(["Uhrzeit;" + TITLES.format(";")], clock),
    "date": text(
        ["Timestamp," + TITLES.format(",")], lambda t, a, q: f"2026-05-01T12:00:00.{1e3 * t:03.0f},{a:.4f},{q:.4f}"
    ),
    "german_date": text(
        ["Datum;" + TITLES.format(";")], lambda t, a, q: f"01.05.2026 12:00:00,{1e3 * t:03.0f};{comma(a, q)}"
    ),
    "text_column": text(["Time [s],Status," + TITLES.format(",")], lambda t, a, q: f"{t:.3f},OK,{a:.4f},{q:.4f}"),
    "g_and_separators_at_the_end": text(
        ["Time [s];Acc Y [g];Q11 [kN];"], lambda t, a, q: comma(t, a / 9.80665, q) + ";"
    ),
    "carriage_returns": text(
        ["time [s]," + TITLES.format(",")], lambda *row: "{:.3f},{:.4f},{:.4f}".format(*row), "\r\n", ""
    ),
    "thousands": text(["Time [s];Acc Y [mm/s2];Q11 [N]"], with_thousands),
}


def check(signal, tolerance=2e-4):
    assert signal.axis == "t_s" and signal.units == {"car_body.ay_m_per_s2": "m/s^2", "wheelset/left.Q_N": "N"}
    np.testing.assert_allclose(signal.x, T, atol=1e-9)
    np.testing.assert_allclose(signal["car_body.ay_m_per_s2"], AY, atol=tolerance)
    np.testing.assert_allclose(signal["wheelset/left.Q_N"], Q, atol=0.1)


@pytest.mark.parametrize("name", FILES)
@pytest.mark.parametrize("encoding", ["utf-8-sig", "latin-1", "utf-16"])
def test_text_files_of_all_kinds_have_the_same_signal(name, encoding, tmp_path):
    path = tmp_path / "a.csv"
    path.write_bytes(FILES[name].encode(encoding))
    check(wr.read_signal(path, WANTED))


def test_missing_values_are_nan_and_text_in_a_wanted_column_names_its_line(tmp_path):
    path = tmp_path / "a.csv"
    lines = FILES["comma"].splitlines()
    path.write_text("\n".join([*lines[:3], "0.010,,50.9", "0.015,#N/A,---", *lines[5:]]))
    signal = wr.read_signal(path, WANTED)
    assert np.flatnonzero(np.isnan(signal["car_body.ay_m_per_s2"])).tolist() == [2, 3]
    assert np.flatnonzero(np.isnan(signal["wheelset/left.Q_N"])).tolist() == [3]
    path.write_text("\n".join([*lines[:7], "0.030,broken,50.9", *lines[8:]]))
    with pytest.raises(wr.InputError, match="a.csv: line 8: expected a number in column 'Acc Y .*got 'broken'"):
        wr.read_signal(path, WANTED)


def test_columns_have_si_names_if_no_channel_is_named(tmp_path):
    path = tmp_path / "a.csv"
    path.write_text(
        "t [ms];Acc-Y [mg];v km/h;Roll rate [°/s];y_mm;Y/Q;temp [C]\n" + "0;1;36;180;2;0,3;20\n5;2;72;90;3;0,4;21\n"
    )
    signal = wr.read_signal(path)
    assert signal.x.tolist() == [0.0, 0.005]
    expected = {
        "acc_y_m_per_s2": (0.00980665, "m/s^2"), "v_m_per_s": (10.0, "m/s"), "roll_rate_rad_per_s": (np.pi, "rad/s"),
        "y_m": (0.002, "m"), "y/q": (0.3, ""), "temp": (20.0, "C"),
    }  # fmt: skip
    assert {name: (pytest.approx(values[0]), signal.units[name]) for name, values in signal.values.items()} == expected


def test_a_minus_reverses_the_sign_and_units_replace_those_of_the_file(tmp_path):
    path = tmp_path / "a.csv"
    path.write_text("time,a,y\n0,1,3\n1,2,4\n")
    signal = wr.read_signal(path, {"a": "-car.ay_m_per_s2", "Y": "wheelset.y_m"}, units={"a": "g", "y": "mm"})
    np.testing.assert_allclose(signal["car.ay_m_per_s2"], [-9.80665, -19.6133])
    np.testing.assert_allclose(signal["wheelset.y_m"], [0.003, 0.004])


def test_pure_numbers_need_no_unit(tmp_path):
    path = tmp_path / "a.csv"
    path.write_text("time,YQ,D [%]\n0,0.3,10\n1,0.4,20\n")
    signal = wr.read_signal(path, {"YQ": "wheelset/left.Y_over_Q", "D": "x.share"})
    assert signal["wheelset/left.Y_over_Q"].tolist() == [0.3, 0.4] and signal["x.share"].tolist() == [0.1, 0.2]


@pytest.mark.parametrize(
    ("header", "rows", "x"),
    [
        ("km;y [mm]", ["12,450;1", "12,451;2", "12,4525;3"], [12450.0, 12451.0, 12452.5]),
        ("Station;y [mm]", ["12+450,5;1", "12+451;2", "12+452,5;3"], [12450.5, 12451.0, 12452.5]),
        ("distance [ft];y [mm]", ["0;1", "10;2", "20;3"], [0.0, 3.048, 6.096]),
        ("km;y [mm]", ["12,450;1", "12,449;2", "12,448;3"], [0.0, 1.0, 2.0]),
        ("km;y [mm]", ["12,450;1", "12,450;9", "12,451;2", "12,452;3"], [12450.0, 12451.0, 12452.0]),
    ],
)
def test_distances_are_in_metres_and_increase(header, rows, x, tmp_path):
    path = tmp_path / "a.csv"
    path.write_text("\n".join([header, *rows]))
    signal = wr.read_signal(path)
    assert signal.axis == "s_m" and signal["y_m"].tolist() == [0.001, 0.002, 0.003]
    np.testing.assert_allclose(signal.x, x, atol=1e-9)


def test_a_clock_that_repeats_rounded_times_becomes_even(tmp_path):
    t = np.arange(1000) / 1500.0
    path = tmp_path / "a.csv"
    path.write_text("time [s],y [m]\n" + "\n".join(f"{a:.3f},{k}" for k, a in enumerate(t)))
    np.testing.assert_allclose(wr.read_signal(path).x, t, atol=6e-4)
    path.write_text("time [s],y [m]\n0,1\n1,2\n2,3\n2,3\n2,3\n2,3\n2,3\n3,3\n")
    with pytest.raises(wr.InputError, match="line 5: expected times that increase; rate="):
        wr.read_signal(path)


@pytest.mark.parametrize("form", ["5", "4"])
def test_matlab_files_have_structures_matrices_and_rates(form, tmp_path):
    path = tmp_path / "a.mat"
    content = {"time_s": T, "acc_y_g": AY / 9.80665, "q_kN": Q / 1e3}
    if form == "5":
        content = {
            "S": {"time_s": T[:, None], "acc_y_g": AY / 9.80665, "q_kN": Q[None] / 1e3, "note": "x"},
            "text": "abc",
        }
    scipy.io.savemat(path, content, format=form)
    prefix = "S." * (form == "5")
    names = {f"{prefix}acc_y": "car_body.ay_m_per_s2", f"{prefix}q": "wheelset/left.Q_N"}
    check(wr.read_signal(path, names), 1e-9)
    scipy.io.savemat(path, {"fs": 200.0, "M": np.column_stack([AY, Q])}, format=form)
    names, units = {"M.1": "car_body.ay_m_per_s2", "M.2": "wheelset/left.Q_N"}, {"M.1": "m/s2", "M.2": "N"}
    check(wr.read_signal(path, names, units=units), 1e-9)


@pytest.mark.parametrize("compressed", [False, True])
def test_matlab_arrays_are_those_of_scipy(compressed, tmp_path):
    """All types of numbers, small and empty arrays, structures in structures; cells and complex numbers are skipped."""
    types = ("i1", "u1", "i2", "u2", "i4", "u4", "i8", "u8", "f4", "f8")
    content = {f"a_{name}": np.arange(7).astype(name).reshape(1, 7) for name in types}
    content |= {"cube": np.arange(24.0).reshape(2, 3, 4), "one": np.array([[5.0]]), "none": np.zeros((0, 0))}
    content |= {"yes": np.array([[True, False]]), "long_name_of_an_array": np.ones((3, 1))}
    inner = {"x": np.arange(3.0)[None], "text": "m/s²"}
    path = tmp_path / "a.mat"
    left_out = {"cell": np.array([1, "a"], dtype=object), "z": np.array([[1 + 2j]])}
    scipy.io.savemat(path, content | left_out | {"s": {"t": {**inner}}}, do_compression=compressed)
    found = read_mat5(path)
    for name, values in content.items():
        np.testing.assert_array_equal(found[name], values)
        assert found[name].dtype.kind == (values.dtype.kind if name != "yes" else "u")
    assert found["s"]["t"]["text"] == "m/s²" and found["s"]["t"]["x"].tolist() == [[0.0, 1.0, 2.0]]
    assert found.keys() == content.keys() | {"s"}


def test_a_unit_in_a_structure_is_that_of_its_values(tmp_path):
    path = tmp_path / "a.mat"
    scipy.io.savemat(path, {"time": T, "floor": {"data": AY / 9.80665, "unit": "g"}})
    np.testing.assert_allclose(wr.read_signal(path, {"floor.data": "a.ay_m_per_s2"})["a.ay_m_per_s2"], AY, atol=1e-12)


def test_every_cut_of_a_matlab_file_is_one_line(tmp_path):
    path = tmp_path / "a.mat"
    scipy.io.savemat(path, {"time": T, "s": {"a": AY}})
    whole = path.read_bytes()
    for size in range(0, len(whole) - 8, 8):
        path.write_bytes(whole[:size])
        with pytest.raises(wr.InputError) as caught:
            wr.read_signal(path)
        assert "\n" not in str(caught.value)


def test_hdf5_files_have_units_and_rate_as_attributes(tmp_path):
    path = tmp_path / "a.h5"
    with h5py.File(path, "w") as file:
        file.attrs["fs"] = 200
        for name, values, unit in (("bogie/ay", AY / 9.80665, "g"), ("Q11", Q[:, None] / 1e3, "kN")):
            file.create_dataset(name, data=values, compression="gzip").attrs["unit"] = unit
        file["note"] = "a text"
        file["picture"] = np.zeros((3, 4, 5))
    check(wr.read_signal(path, {"bogie.ay": "car_body.ay_m_per_s2", "Q11": "wheelset/left.Q_N"}), 1e-9)


def _cut_mat(path):
    scipy.io.savemat(path, {"time": T, "a": AY})
    path.write_bytes(path.read_bytes()[:180])


def _cut_hdf5(path):
    with h5py.File(path, "w") as file:
        file["a"] = np.arange(1e4)
    path.write_bytes(path.read_bytes()[:9000])


def _linked(path):
    with h5py.File(path, "w") as file:
        file["a"] = h5py.ExternalLink("other.h5", "a")


def _unknown_filter(path):
    with h5py.File(path, "w") as file:
        file.create_dataset("a", data=np.arange(100.0), compression="lzf")


DAMAGED = {
    "empty.csv": (b"", "expected a CSV file.* got no lines"),
    "words.csv": (b"this is\nno table\nof numbers\n", "expected a CSV file.* text without rows of numbers"),
    "picture.csv": (b"\x89PNG\r\n\x1a\n" + bytes(range(256)) * 40, "expected a CSV file"),
    "book.csv": (b"PK\x03\x04" + b"\0" * 400, "expected a CSV file; save the sheet of this workbook as CSV"),
    "no_axis.csv": (b"a [m],b [m]\n1,2\n2,3\n", "expected a column of time or distance, or a sampling rate"),
    "one_row.csv": (b"time,a\n0,1\n", "expected two samples or more, got 1"),
    "back.csv": (b"time,a\n0,1\n1,2\n0.5,3\n", "line 4: expected times that increase"),
    "wide.csv": (b"time,a\n0,1\n1,2\n2,3,4,5\n3,4\n4,5\n5,6\n", "line 4: expected 2 cells"),
    "mixed.csv": (b"time;a\n0,0;1\n0.1;2\n0.2;2\n0.3;2\n0,4;2\n0,5;1\n", "one decimal mark"),
    "time_unit.csv": (b"time [kN],a\n0,1\n1,2\n2,3\n", "expected a column of time or distance"),
    "cut.mat": (_cut_mat, "expected a MATLAB file"),
    "cut.h5": (_cut_hdf5, "expected an HDF5 file"),
    "linked.h5": (_linked, "expected arrays of numbers"),
    "filter.h5": (_unknown_filter, "got a dataset with an unknown filter: a"),
}  # fmt: skip


@pytest.mark.parametrize("name", DAMAGED)
def test_a_damaged_file_is_one_line(name, tmp_path):
    content, expected = DAMAGED[name]
    path = tmp_path / name
    content(path) if callable(content) else path.write_bytes(content)
    with pytest.raises(wr.InputError, match=expected) as caught:
        wr.read_signal(path)
    assert "\n" not in str(caught.value) and name in str(caught.value)


@pytest.mark.parametrize("code", ["import os; os.abort()", "import time; time.sleep(60)"])
def test_a_crash_or_hang_of_the_hdf5_library_is_one_line(code, tmp_path, monkeypatch):
    path = tmp_path / "a.h5"
    with h5py.File(path, "w") as file:
        file["time"] = T
    (tmp_path / "h5py.py").write_text(code)
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setattr(hdf5_file, "PATIENCE", 3.0)
    with pytest.raises(wr.InputError, match="got a damaged file, on which the HDF5 library (crashes|does not return)"):
        wr.read_signal(path)


def test_a_line_that_was_not_finished_is_left_out(tmp_path, capsys):
    path = tmp_path / "a.csv"
    path.write_text("time [s],a [m],b [m]\n0,1,1\n1,2,2\n2,3,3\n3,4,4\n4,5")
    assert wr.read_signal(path).x.tolist() == [0.0, 1.0, 2.0, 3.0]
    assert "line 6 is incomplete" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("options", "expected"),
    [
        ({"channels": {"Acc": "a.y_m"}}, "channels Acc: expected one of time, Acc Y, F.*did you mean 'Acc Y'"),
        ({"channels": {"Acc Y": "a.y_m"}}, "Acc Y: expected its unit, for a.y_m; units="),
        ({"channels": {"Acc Y": "a.y_m"}, "units": {"Acc Y": "kN"}}, "expected a unit of a.y_m, got 'kN'"),
        ({"units": {"F": "parsec"}}, "units F: expected a unit such as mm"),
        ({"axis": "when"}, "axis when: expected one of"),
        ({"axis": "F"}, "F: expected the unit of a time or a distance"),
    ],
)
def test_a_wrong_argument_is_one_line(options, expected, tmp_path):
    path = tmp_path / "a.csv"
    path.write_text("time,Acc Y,F\n0,1,3\n1,2,4\n")
    with pytest.raises(wr.InputError, match=expected):
        wr.read_signal(path, **options)
    with pytest.raises(wr.InputError, match="no such file|No such file"):
        wr.read_signal(tmp_path / "none.csv")

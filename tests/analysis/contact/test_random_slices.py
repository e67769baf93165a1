"""Random families of slices, few of them sensible: a result, or one line that says what is wrong."""

import numpy as np
import pandas as pd
import pytest

from wrcore.cli import main

WITHIN = 1.0  # m and m/s^2: nothing that comes out of such a rail is larger


def family(folder, seed):
    """A table of slices: heads that come and go, noise, feature lines that may cross, one slice or ten thousand."""
    rng = np.random.default_rng(seed)
    count = (1, 2, 3, 10, 40, 10_000 if seed == 5 else 100)[seed % 6]
    heads, distinct = rng.integers(1, 4), min(count, 12)
    noise, radius = 10.0 ** rng.uniform(-9, -3.5), rng.uniform(0.05, 0.5)
    s = np.cumsum(10.0 ** rng.uniform(-3.5, -0.5, count))
    rows = []
    for head in range(heads):
        middle, half = rng.uniform(-0.05, 0.05), rng.uniform(0.003, 0.04)
        for k in range(distinct):
            u = middle + np.sort(rng.uniform(-half, half, rng.integers(5, 200)))
            f = np.sqrt(np.maximum(radius**2 - u**2, 0.0)) - radius + noise * rng.normal(size=u.size)
            table = pd.DataFrame({"u_m": u, "f_m": f - 0.002 * head})
            table.to_csv(folder / f"{head}_{k}.csv", index=False)
        there = rng.random(count) < rng.choice([1.0, 0.9, 0.5])
        for k in np.flatnonzero(there):
            cut = rng.uniform(-0.002, 2.2 * half) if seed % 4 == 3 else ""
            rows.append((s[k], f"{head}_{k % distinct}.csv", f"head {head}", cut))
    pd.DataFrame(rows, columns=["s_m", "profile", "head", "cut_1_m"]).to_csv(folder / "rail.csv", index=False)
    return rng.uniform(s[0] - 0.05, s[-1] + 0.05, 3)


@pytest.mark.parametrize("seed", range(20))
def test_a_result_or_one_line(tmp_path, capfd, seed):
    at = family(tmp_path, seed)
    poses = pd.DataFrame({"pose_id": list("abc"), "y_m": [0.0, 0.004, -0.004], "yaw_rad": [0.0, 0.0, 0.01], "s_m": at})
    poses.to_csv(tmp_path / "poses.csv", index=False)
    files = ["--poses", str(tmp_path / "poses.csv"), "--out", str(tmp_path / "out.csv")]
    pair = ["--wheel", "S1002", "--rail", str(tmp_path / "rail.csv"), "--rail-distance", "0.75"]
    code = main(["contact", *files, *pair, "--wheel-load", "5e4", "--patch", "moment"])
    said = [line for line in capfd.readouterr().err.splitlines() if line.startswith("wrcore:")]
    if code == 0:
        found = pd.read_csv(tmp_path / "out.csv")
        assert len(found)
        assert np.isfinite(found[["x_m", "y_m", "z_m", "N_N", "p_max_Pa"]]).all(axis=None)
        assert found.x_m.abs().max() < WITHIN
        assert (found.N_N >= 0.0).all()
    else:
        assert code == 2
        assert len(said) == 1 and "expected" in said[0]

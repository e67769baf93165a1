"""Random pairs of profiles."""

import numpy as np
import pytest

from study.surrogate.pairs import (
    RADII,
    TEST_PAIRS,
    is_test_pair,
    random_pair,
    read_measured,
    waves,
)
from wrcore.errors import InputError


def test_pairs_follow_from_the_seed():
    one, other = (random_pair(np.random.default_rng(5)) for _ in range(2))
    assert one.name == other.name
    np.testing.assert_array_equal(one.on_rail.wheel.f, other.on_rail.wheel.f)
    np.testing.assert_array_equal(one.on_rail.rail.f, other.on_rail.rail.f)
    assert random_pair(np.random.default_rng(6)).name != one.name


def test_pairs_are_in_their_ranges():
    random = np.random.default_rng(7)
    pairs = [random_pair(random) for _ in range(15)]
    assert all(RADII[0] <= pair.on_rail.rolling_radius <= RADII[1] for pair in pairs)
    assert len({pair.name for pair in pairs}) == len(pairs)


def test_test_pairs_are_known():
    assert len(TEST_PAIRS) == 9
    assert is_test_pair("S1002", "54E1", 1 / 40)
    assert not is_test_pair("S1002", "54E1", 1 / 20)
    assert not is_test_pair("S1002, long waves", "54E1", 1 / 40)


def test_test_pair_is_drawn_again(monkeypatch):
    from study.surrogate import pairs

    new = pairs.named_profile("S1002", "wheel"), "S1002"
    monkeypatch.setattr(pairs, "worn_wheel", lambda *given: new)
    monkeypatch.setattr(pairs, "worn_rail", lambda random, rail, name, *given: (rail, name))
    drawn = iter(["54E1", "60E1"])

    def base(*given):
        name = next(drawn)
        return pairs.named_profile(name, "rail", 1 / 40), f"{name} at 0.0250", 1 / 40

    monkeypatch.setattr(pairs, "rail_base", base)
    assert "60E1" in random_pair(np.random.default_rng(1)).name


def test_measured_profile_of_a_test_pair_is_refused(tmp_path):
    (tmp_path / "CAR7216_0001R.whl").write_text("")
    with pytest.raises(InputError, match="test pairs"):
        read_measured(tmp_path)


def test_waves_have_their_amplitude_and_length():
    u = np.arange(-0.05, 0.05, 1e-4)
    found = np.array([waves(np.random.default_rng(k), u, 2e-5, 2e-3) for k in range(20)])
    assert np.std(found, axis=1) == pytest.approx(2e-5)
    slopes = np.std(np.gradient(found, u, axis=1), axis=1)  # correlation length: sqrt(2) times that of the kernel
    assert slopes.mean() == pytest.approx(2e-5 / (2e-3 * np.sqrt(2.0)), rel=0.1)


def test_share_of_new_profiles_is_the_one_asked_for():
    names = [random_pair(np.random.default_rng([7, k]), new_share=1.0).name for k in range(8)]
    assert not any("hollow" in name or "waves" in name or "worn" in name for name in names)
    assert any("hollow" in random_pair(np.random.default_rng([7, k])).name for k in range(8))

"""Turns, medians and bars, with a clock that is told what to show."""

import numpy as np
import pytest

from study.cost.timing import Bar, Contender, compare, machine, summary, take_turns


class Clock:
    """Time that passes only when something is called."""

    def __init__(self):
        self.now, self.order = 0.0, []

    def __call__(self):
        return self.now

    def lasting(self, label, *seconds):
        """A call that takes each of the given times in turn."""
        left = list(seconds)

        def call():
            self.order.append(label)
            self.now += left.pop(0)

        return call


def test_contenders_take_turns_and_the_first_pass_is_not_counted():
    clock = Clock()
    contenders = [Contender("a", clock.lasting("a", 9, 1, 2)), Contender("b", clock.lasting("b", 9, 3, 8), units=2)]
    np.testing.assert_allclose(take_turns(contenders, 2, clock), [[1, 1.5], [2, 4]])
    assert clock.order == ["a", "b"] * 3


def test_rows_hold_medians_and_paired_ratios():
    clock = Clock()
    contenders = [Contender("a", clock.lasting("a", 0, 1, 2, 4)), Contender("b", clock.lasting("b", 0, 3, 4, 16))]
    first, second = compare("pair", "run", contenders, 3, "ms", Bar("b", "ratio", "at least", 8.0), clock)
    assert (first["time"], second["time"]) == (2000.0, 4000.0)
    assert first["ratio"] == 1.0
    assert (second["ratio_low"], second["ratio"], second["ratio_high"]) == (2.5, 3.0, 3.5)  # of 3, 2, 4
    assert second["excess"] == 2000.0  # of 2, 2, 12 s
    assert (first["bar"], first["met"]) == ("", "")
    assert (second["bar"], second["met"]) == ("ratio at least 8", "no")


@pytest.mark.parametrize(
    ("bar", "words", "met"),
    [
        (Bar("b", "ratio", "at least", 2.0), "ratio at least 2", "yes"),
        (Bar("b", "ratio", "at most", 2.0), "ratio at most 2", "yes"),
        (Bar("b", "ratio", "at most", 1.9), "ratio at most 1.9", "no"),
        (Bar("b", "excess", "at most", 2.0), "excess at most 2 us", "yes"),
        (Bar("b", "excess", "at most", 0.5), "excess at most 0.5 us", "no"),
    ],
)
def test_bars(bar, words, met):
    row = summary("pair", "evaluation", ["a", "b"], np.array([[1e-6, 2e-6]]), "us", bar)[1]
    assert (row["bar"], row["met"]) == (words, met)


def test_machine_is_named():
    found = machine()
    assert found["processor"]
    assert found["cores"] >= 1

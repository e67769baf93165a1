"""reports/arrays.md works as written, and its compiled creep force is the one of the package."""

import numpy as np

import wrcore as wr
from tests.pages import blocks


def test_the_page_runs_and_says_what_it_prints(capsys):
    names = {}
    for kind, text in blocks("arrays.md"):
        assert kind == "python"
        exec(compile(text, "arrays.md", "exec"), names)
    printed = capsys.readouterr().out.splitlines()
    assert printed[:2] == ["(1000, 2, 3)", "(1000, 2)"]
    table, random = names["table"], np.random.default_rng(1)
    for xi, eta, phi in random.normal(size=(20, 3)) * [1e-3, 1e-3, 0.2]:
        own = names["creep"](table, 6e-3, 4e-3, 5e4, xi, eta, phi, 0.3, 8.2e10)
        np.testing.assert_allclose(own, wr.creep_force("table", 6e-3, 4e-3, 5e4, xi, eta, phi), rtol=1e-9, atol=1e-9)

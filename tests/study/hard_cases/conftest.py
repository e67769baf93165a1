"""Vehicles of the hard cases, as the study's configuration names them."""

import pytest

from tests.conftest import ELLIPTIC, SCENES


@pytest.fixture(scope="session")
def vehicles():
    loose = {
        "contact.patch": "moment",
        "integration.method": "auto",
        "integration.rtol": 1e-5,  # impacts of 1 cm/s go 20 um deep: a step of 1 um, as with 1e-4, is a part of that
    }
    return {
        "suspended wheelset": {"scene": ELLIPTIC / "suspended_wheelset.yaml"},
        "free wheelset": {"scene": SCENES / "wheelset.yaml", "set": loose},
        "trailer vehicle": {"scene": ELLIPTIC / "trailer_vehicle.yaml"},
    }


@pytest.fixture(scope="session")
def assert_passed():
    """A function that fails with the rows that neither passed nor name a known limit."""

    def check(rows):
        assert rows
        failed = [row for row in rows if not row["passed"] and not row["known_limit"]]
        shown = ("case", "condition", "vehicle", "detection", "integrator", "reason", "invariant", "value", "limit")
        assert not failed, "\n".join(" | ".join(str(row[name]) for name in shown) for row in failed)

    return check

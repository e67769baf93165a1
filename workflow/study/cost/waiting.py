"""Where one right-hand side waits: its machine instructions, one by one, and how often a look finds it at each of them.

``python -m study.cost.waiting [scene]`` prints the instructions of one evaluation in the order in which they are
carried out, in stretches, with the time that each stretch takes. A processor carries out several instructions at once
where none waits for another: a stretch with few of them per nanosecond is a chain. Linux on x86-64 only, which lets one
process follow another step by step.
"""

import ctypes
import os
import random
import signal
import sys
import time
from collections import Counter

import numpy as np

from study.cost.recorded import record
from wrcore.equations.equations_of_motion import Equations, fill_many
from wrcore.errors import InputError
from wrcore.scene.description import load_scene

SCENE = "config/scenes/suspended_wheelset.yaml"
CHANGES = {"contact.patch": "moment", "speed": 60.0, "integration.duration": 10.0}

STRETCH = 150
"""Instructions in a row of the table."""

LOOKS = 60000

INTERVAL = 50e-6
"""Mean time between two looks, s."""

MOST = 10**7
"""Steps after which an entry that was not met is given up."""

_CONTINUE, _STEP, _REGISTERS, _SEIZE, _INTERRUPT, _ENDS_WITH_US = 7, 9, 12, 0x4206, 0x4207, 1 << 20
"""Requests of ptrace, and its option that ends what is followed with who follows."""

_POINTER, _STACK, _COUNT = 16, 19, 27
"""Places of the instruction's and the stack's pointer in the registers, and how many registers there are."""


class Followed:
    """A copy of this process that calls a function, called once here, over and over, followed from here."""

    def __init__(self, call):
        call()  # compiles, if it must
        self._trace = ctypes.CDLL(None, use_errno=True).ptrace
        self._trace.argtypes = [ctypes.c_long, ctypes.c_int, ctypes.c_void_p, ctypes.c_void_p]
        self._trace.restype = ctypes.c_long
        self.child = os.fork()
        if self.child == 0:
            try:
                while True:
                    call()
            finally:
                os._exit(1)
        try:
            self._ask(_SEIZE, _ENDS_WITH_US)
        except OSError:
            self.end()
            raise
        self.stop()

    def _ask(self, request, data=None):
        if self._trace(request, self.child, None, data) < 0:
            raise OSError(ctypes.get_errno(), "expected Linux that lets one process follow another")

    def stop(self):
        """Stop it where it is."""
        self._ask(_INTERRUPT)
        os.waitpid(self.child, 0)

    def go_on(self):
        """Let it run."""
        self._ask(_CONTINUE)

    def step(self):
        """One instruction."""
        self._ask(_STEP)
        os.waitpid(self.child, 0)

    def place(self):
        """Addresses of the instruction that comes next, and of the stack's end."""
        registers = (ctypes.c_ulonglong * _COUNT)()
        self._ask(_REGISTERS, registers)
        return registers[_POINTER], registers[_STACK]

    def end(self):
        """End it."""
        os.kill(self.child, signal.SIGKILL)
        os.waitpid(self.child, 0)


def instructions(call, entry):
    """Addresses of the instructions between the next time ``call`` comes to ``entry`` and the return from there."""
    followed, found = Followed(call), []
    try:
        for _ in range(MOST):
            if followed.place()[0] == entry:
                break
            followed.step()
        else:
            raise InputError("instructions", "entry", "expected an address that the call comes to")
        start = followed.place()[1]
        while followed.place()[1] <= start:
            found.append(followed.place()[0])
            followed.step()
    finally:
        followed.end()
    return found


def looks(call, count):
    """How often each address was found to come next, while ``call`` runs over and over, in so many looks."""
    followed, found = Followed(call), Counter()
    try:
        for _ in range(count):
            followed.go_on()
            time.sleep(random.uniform(0.5, 1.5) * INTERVAL)
            followed.stop()
            found[followed.place()[0]] += 1
    finally:
        followed.end()
    return found


def main(scene=SCENE):
    """Print the table for a scene."""
    recorded = record(load_scene(scene, CHANGES), CHANGES["integration.duration"], 200)
    equations, model, work = Equations(recorded.model).arguments
    states = np.tile(recorded.states, (500, 1))
    rates, one = np.empty_like(states), recorded.states[100:101]
    many = (equations, 0.0, states, model, work, rates)
    fill_many(*many)
    started = time.process_time()
    fill_many(*many)
    ns = 1e9 * (time.process_time() - started) / len(states)
    done = instructions(lambda: fill_many(equations, 0.0, one, model, work, rates[:1]), int(equations.address))
    seen, turns = looks(lambda: fill_many(*many), LOOKS), Counter(done)
    weights = np.array([seen[address] / turns[address] for address in done])
    weights *= ns / sum(seen.values())
    print(f"{scene}: {len(done)} instructions, {ns:.0f} ns, {len(done) / ns:.1f} per ns")
    print(f"{weights.sum() / ns:.0%} of {LOOKS} looks at these; others found what other states, or Python, do")
    for first in range(0, len(done), STRETCH):
        took = weights[first : first + STRETCH].sum()
        rate = len(done[first : first + STRETCH]) / max(took, 1e-3)
        print(f"from {first:5d}: {took:5.0f} ns, {rate:5.1f} per ns")


if __name__ == "__main__":
    main(*sys.argv[1:])

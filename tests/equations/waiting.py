"""Time of one evaluation of the right-hand side by machine instruction, from random samples of the program counter.

``python -m tests.equations.waiting [scene]`` prints the time of consecutive stretches of the executed instructions of
one evaluation. A processor executes several independent instructions at the same time. A stretch with few instructions
per nanosecond is a chain in which each instruction waits for the previous instruction. This works on Linux on x86-64
only, where one process can trace another (ptrace).
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
"""Instructions per row of the table."""

LOOKS = 60000

INTERVAL = 50e-6
"""Mean time between two samples, s."""

MOST = 10**7
"""Maximum number of steps to reach the entry address."""

_CONTINUE, _STEP, _REGISTERS, _SEIZE, _INTERRUPT, _ENDS_WITH_US = 7, 9, 12, 0x4206, 0x4207, 1 << 20
"""Requests of ptrace, and its option that ends the traced process together with the tracing process."""

_POINTER, _STACK, _COUNT = 16, 19, 27
"""Indices of instruction pointer and stack pointer in the registers, and the number of registers."""


class Followed:
    """A traced copy of this process that calls a function repeatedly."""

    def __init__(self, call):
        call()  # compiles the function if necessary
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
        """Stop the traced process at its present instruction."""
        self._ask(_INTERRUPT)
        os.waitpid(self.child, 0)

    def go_on(self):
        """Continue the traced process."""
        self._ask(_CONTINUE)

    def step(self):
        """Execute one instruction of the traced process."""
        self._ask(_STEP)
        os.waitpid(self.child, 0)

    def place(self):
        """Return the address of the next instruction and the stack pointer."""
        registers = (ctypes.c_ulonglong * _COUNT)()
        self._ask(_REGISTERS, registers)
        return registers[_POINTER], registers[_STACK]

    def end(self):
        """End the traced process."""
        os.kill(self.child, signal.SIGKILL)
        os.waitpid(self.child, 0)


def instructions(call, entry):
    """Return addresses of the instructions of ``call`` from the address ``entry`` until this function returns."""
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
    """Return how often each address was the next instruction in ``count`` samples while ``call`` runs repeatedly."""
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
    """Print instructions and times of one evaluation of a scene."""
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

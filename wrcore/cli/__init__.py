"""The command ``wrcore``, which ``python -m wrcore`` is, too: one module per command.

Exit status 0 only when the result was produced; 2 for bad input, with one line that names the file, the field and
what was expected.
"""

import atexit
import gc
import os
import sys
from contextlib import suppress
from signal import SIGPIPE

from wrcore import __version__
from wrcore.cli import (
    assess,
    compare,
    conicity,
    contact,
    creep,
    curving,
    draw,
    evolve,
    fmu,
    init,
    keys,
    profiles,
    response,
    simulate,
    sweep,
    table,
)
from wrcore.cli.common.options import Parser
from wrcore.cli.simulate import NOT_REACHED as NOT_REACHED
from wrcore.errors import InputError

COMMANDS = (
    init, simulate, fmu, sweep, assess, compare, response, curving, draw, evolve, contact, conicity, creep, table,
    profiles, keys,
)  # fmt: skip
"""Modules with a command each, in the order of the help: ``add(commands)`` hands its parser over, ``run(options)`` does
what the options say."""


def parser():
    """The parser of the whole command line; ``parser().parse_args(words).run(options)`` does what the words ask for."""
    whole = Parser(
        prog="wrcore", description="Wheel-rail contact in railway dynamics.",
        epilog="'wrcore COMMAND --help' lists its options with units and defaults, and the columns of its files. "
        "Exit status: 0 done, 1 a run that stalled or failed, 2 bad input, 4 an accuracy that was not reached or is "
        "that of a derailment.",
    )  # fmt: skip
    whole.add_argument("--version", action="version", version=f"wrcore {__version__}", help="print the version")
    commands = whole.add_subparsers(metavar="COMMAND", required=True)
    for module in COMMANDS:
        module.add(commands)
    return whole


GARBAGE = 100_000
"""New objects until Python looks for garbage. With its 700 it looks 700 times while a run's modules are imported, a
tenth of that time."""


def main(arguments=None):
    """Entry point, with the process's arguments by default: exit status 0 done, 2 bad input, 1 a run that stalled or
    failed, 4 an accuracy not reached or of a derailment, 128 and its number for a signal.
    """
    gc.set_threshold(GARBAGE)
    atexit.register(gc.freeze)  # else Python looks, as it ends, for garbage in all that it drops, a tenth of a run
    whole = parser()
    if "_ARGCOMPLETE" in os.environ:  # a shell asks what may come next: eval "$(register-python-argcomplete wrcore)"
        with suppress(ImportError):
            import argcomplete

            argcomplete.autocomplete(whole)
    try:
        options = whole.parse_args(arguments)
        status = options.run(options)
        sys.stdout.flush()
        return status
    except InputError as error:
        print(f"wrcore: {error}", file=sys.stderr)
        return 2
    except BrokenPipeError:  # who reads has enough, as ``head`` has; nothing more is written when Python ends
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 128 + SIGPIPE
    except OSError as error:  # a disk that fills up, a file that goes away
        print(f"wrcore: {InputError(error.filename or '', '', error.strerror or error)}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        print("wrcore: interrupted", file=sys.stderr)
        return 130

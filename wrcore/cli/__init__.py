"""Command line ``wrcore``, also ``python -m wrcore``, with one module per command.

The exit status is 0 only if the result was produced. It is 2 for invalid input, with one line that names the file, the
field and the expected value.
"""

import atexit
import gc
import os
import sys
from contextlib import suppress
from signal import SIGPIPE

from wrcore import __version__
from wrcore.cli import assess, compare, curving, draw, evolve, fmu, init, keys, response, simulate, sweep
from wrcore.cli.common.options import Parser
from wrcore.cli.simulate import NOT_REACHED as NOT_REACHED
from wrcore.cli.wheel_and_rail import conicity, contact, creep, profiles, table
from wrcore.errors import InputError
from wrcore.reporting import command as report

COMMANDS = (
    init, simulate, fmu, sweep, report, assess, compare, response, curving, draw, evolve, contact, conicity, creep,
    table, profiles, keys,
)  # fmt: skip
"""Modules with one command each, in the order of the help: ``add(commands)`` adds its parser, ``run(options)`` executes
the command."""


def parser():
    """Return the parser of the whole command line; the parsed options have ``run``, which executes the command."""
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
"""Number of new objects between garbage collections. With Python's default of 700, 700 collections take a tenth of the
time of importing a run's modules."""


def main(arguments=None):
    """Execute a command line, by default the process's arguments, and return the exit status.

    It is 0 for success, 2 for invalid input, 1 for a run that stalled or failed, 4 for an accuracy that was not reached
    or is that of a derailment, and 128 plus its number for a signal.
    """
    gc.set_threshold(GARBAGE)
    atexit.register(gc.freeze)  # avoids a garbage collection at exit, which takes a tenth of a run
    whole = parser()
    if "_ARGCOMPLETE" in os.environ:  # completion in a shell: eval "$(register-python-argcomplete wrcore)"
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
    except BrokenPipeError:  # the reader, such as ``head``, has closed the pipe; avoid writing at exit
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 128 + SIGPIPE
    except OSError as error:  # disk full, or a file was removed
        print(f"wrcore: {InputError(error.filename or '', '', error.strerror or error)}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        print("wrcore: interrupted", file=sys.stderr)
        return 130

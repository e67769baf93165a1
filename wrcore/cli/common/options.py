"""Options that several commands share, and the help texts and errors of all commands."""

import argparse
import os
import textwrap
from pathlib import Path

from wrcore.errors import InputError, one_of, similar
from wrcore.run.output.channels import DESCRIPTIONS, unit_of


class _Help(argparse.RawDescriptionHelpFormatter):
    """Formatter of help texts that keeps their line breaks and adds the default of each option."""

    def _get_help_string(self, action):
        text = action.help or ""
        value = action.default
        said = action.required or not action.option_strings or "default" in text
        if said or value in (None, [], argparse.SUPPRESS) or isinstance(value, bool):
            return text
        return f"{text} (default: {value:g})" if isinstance(value, float) else f"{text} (default: {value})"


class Parser(argparse.ArgumentParser):
    """Parser whose errors are InputError: one line, with a suggestion for a misspelt word."""

    def __init__(self, **settings):
        super().__init__(**{"formatter_class": _Help, **settings})

    def error(self, message):
        raise InputError(self.prog, "", message)

    def parse_known_args(self, args=None, namespace=None):
        """Parse known arguments; raise an error for an unknown option with a suggestion from the known options."""
        found, left = super().parse_known_args(args, namespace)
        options = [word.partition("=")[0] for word in left if word.startswith("--")]
        if options:
            self.error(f"unknown option {options[0]}{similar(options[0], self._option_string_actions)}")
        return found, left

    def _check_value(self, action, value):
        if action.choices is not None and value not in action.choices:
            raise argparse.ArgumentError(action, one_of(action.choices, value))


def columns(title, **texts):
    """Return the description of a table's columns as text for a help page.

    ``texts`` are meanings by column; an empty text is replaced by that of the run's channel with this name. Units are
    those that the names state.
    """
    lines = [f"{title}:"]
    for name, text in texts.items():
        unit = unit_of(name)
        meaning = (text or DESCRIPTIONS[name]) + ("" if unit == "1" else f" [{unit}]")
        lines += textwrap.wrap(meaning, 118, initial_indent=f"  {name:28} ", subsequent_indent=31 * " ")
    return "\n".join(lines)


def as_runs(*names):
    """Return empty texts for `columns` that are described like a run's channels with these names."""
    return dict.fromkeys(names, "")


def add_pair(command, slices=""):
    """Add the options of a wheel on a rail; ``slices`` is appended to the help of ``--rail``."""
    what = "profile: a name ('wrcore profiles'), a file of points, or '{points: FILE, ...}'"
    command.add_argument("--wheel", required=True, metavar="NAME|FILE", help=what)
    command.add_argument("--rail", required=True, metavar="NAME|FILE", help=what + slices)
    command.add_argument("--unit", choices=("m", "mm", "inch", "cm", "um"), help="of files that do not state it")
    command.add_argument("--smoothing", type=float, metavar="m", help="noise of a file's points to even out, m")
    command.add_argument(
        "--inclination", metavar="1/40", help="of a rail, named (0: upright) or {..., inclined: false}"
    )
    command.add_argument("--gauge", type=float, default=1.435, metavar="m", help="m, 14 mm below the rails' tops")
    command.add_argument("--rolling-radius", type=float, default=0.46, metavar="m", help="at the tape circle, m")
    command.add_argument(
        "--tape-circle-half-distance", type=float, default=0.75, metavar="m", help="from the wheelset's centre, m"
    )


def pair_of(options):
    """Return the `WheelsetOnTrack` of the options of `add_pair`, and of optional ones of a different right wheel."""
    from wrcore.contact.rigid.wheel_on_rail import WheelOnRail, WheelsetOnTrack

    given = {"right_wheel": None, "right_rolling_radius": None} | vars(options)
    wheel = profile_of(options, options.wheel, "wheel")
    right = profile_of(options, given["right_wheel"], "wheel") if given["right_wheel"] else wheel
    rail, radius = profile_of(options, options.rail, "rail"), options.rolling_radius
    other = radius if given["right_rolling_radius"] is None else given["right_rolling_radius"]
    sides = WheelOnRail(wheel, rail, radius), WheelOnRail(right, rail, other)
    return WheelsetOnTrack(*sides, options.tape_circle_half_distance, options.gauge)


def profile_of(options, spec, kind):
    """Return a named profile, or a profile from a file, to which ``--unit`` and ``--smoothing`` apply.

    In a pair, ``--inclination`` is that of the rail."""
    from wrcore.geometry.profiles.standards import named_profile

    beside_a_rail = kind == "wheel" and hasattr(options, "rail")
    return named_profile(profile_spec(options, spec), kind, None if beside_a_rail else ratio(options.inclination))


def profile_spec(options, spec):
    """Return a profile's name, or the mapping of a file with its unit and smoothing."""
    from wrcore.errors.checked_yaml import parse_value

    described = parse_value(spec) if spec.lstrip().startswith("{") else {"points": spec}
    if not isinstance(described, dict) or not os.path.isfile(str(described.get("points"))):
        return spec
    if options.unit and Path(described["points"]).suffix.lower() not in (".prw", ".prr"):
        described.setdefault("unit", options.unit)
    if options.smoothing is not None:
        described.setdefault("smoothing", options.smoothing)
    return described if len(described) > 1 else spec


def slices_of(options, kind):
    """Return `RailSlices` of ``--rail`` or `WheelSlices` of ``--wheel``; None if the profile is constant."""
    from wrcore.errors.checked_yaml import parse_value
    from wrcore.geometry.changing_rails.files import is_slices, read_slices

    spec = getattr(options, kind)
    said = spec.lstrip().startswith("{")
    described = parse_value(spec) if said else {"slices": spec}
    if not isinstance(described, dict) or "slices" not in described or not (said or is_slices(spec, kind)):
        return None
    if kind == "rail" and ratio(options.inclination):
        expected = "expected none or 0 beside a rail of slices, whose sections lie in the track pose already"
        raise InputError("wrcore", "--inclination", expected)
    if options.unit:
        described.setdefault("unit", options.unit)
    return read_slices(described, kind)


def ratio(text):
    """Parse a ratio such as 1/40; return None if none is given."""
    from wrcore.errors.checked_yaml import parse_ratio

    if text is None:
        return None
    value = parse_ratio(text)
    if not abs(value) <= 0.2:
        raise InputError("wrcore", "--inclination", f"expected a ratio such as 1/40, within 1/5, got {text!r}")
    return value

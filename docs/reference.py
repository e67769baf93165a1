"""Pages of the reference, made of docstrings, command line parsers, schemas and tables of names."""

import argparse
import importlib
import inspect
from importlib.resources import files

import yaml

import wrcore
from wrcore.errors.schema_keys import kinds_in

GROUPS = {
    "Scenes and runs": (
        "load_scene", "Scene", "simulate", "simulate_many", "simulate_to_accuracy", "Run", "start", "Session",
        "load_run", "load_runs", "example", "write_run", "plot_run", "hunting_frequency",
    ),
    "Profiles and contact": (
        "list_profiles", "named_profile", "WheelsetOnTrack", "first_touch", "conicity_curve", "contact_table", "patch",
        "Patch", "plot_pair",
    ),
    "Creep forces": ("creep_force", "CreepTable", "ensure_table", "RollingContact", "plot_creep_force"),
    "Forces, modes, critical speeds": (
        "wheel_forces", "wheel_table", "wheelset_channels", "creep_power", "wear_number", "modes", "critical_speeds",
        "limit_cycles", "speed_ramp", "Settling",
    ),
    "Response, curving, roll": (
        "frequency_response", "plot_frequency_response", "quasi_static_curving", "roll_coefficient",
    ),
    "Pictures and reports": ("report", "ReportPage", "draw", "plot_wheel_on_rail"),
    "Assessment, damage and wear": (
        "assess", "Assessment", "section_statistics", "damage_table", "plot_shakedown", "local_wear",
        "WheelWear", "evolve",
    ),
    "Measured signals": ("read_signal", "Signal", "SignalComparison", "fit", "Fit", "fit_path", "FittedPath"),
    "Many runs": ("load_sweep", "run_sweep"),
    "Errors": ("InputError",),
}  # fmt: skip
"""Public names by what a user wants; names that stand nowhere here come last, as "Further"."""

ROOMS = (
    "analysis.stability.modes", "analysis.assessment.ride", "analysis.stability.stability",
    "analysis.stability.limit_cycles", "analysis.to_accuracy", "analysis.contact.poses", "analysis.contact.loaded",
    "contact.rigid.wheel_on_rail", "contact.rigid.conicity", "contact.rigid.first_touch", "contact.rigid.pose_file",
    "contact.search.detection", "contact.hertz", "creep.cases", "creep.kalker", "creep.laws", "creep.table",
    "geometry.profiles.profile", "geometry.profiles.files", "geometry.profiles.meters",
    "geometry.profiles.standards", "geometry.irregularity", "geometry.track", "run.output.channels",
    "run.checks.validity", "scene.description", "scene.compile", "sweep.measures", "sweep.plan", "sweep.batch",
)  # fmt: skip
"""Modules that scripts use beside the public names."""

SCHEMAS = {
    "scene": "scene",
    "track": "key `track` of a scene",
    "vehicle": "vehicle",
    "sweep": "sweep",
    "wear": "wear plan",
}


def write_reference(folder):
    """Write all pages of the reference into a folder."""
    folder.mkdir()
    pages = {
        "api": api_page(),
        "modules": modules_page(),
        "cli": cli_page(),
        "files": files_page(),
        "names": names_page(),
    }
    for name, text in pages.items():
        (folder / f"{name}.md").write_text(text, "utf-8")
    tree = "\n".join(["```{toctree}", *pages, "```"])
    (folder / "index.md").write_text(f"# Reference\n\n{tree}\n", "utf-8")


def groups():
    """Public names by group; each stands in one."""
    public = list(wrcore._PUBLIC)
    listed = {name for names in GROUPS.values() for name in names}
    found = {group: [name for name in names if name in public] for group, names in GROUPS.items()}
    rest = [name for name in public if name not in listed]
    return found | ({"Further": rest} if rest else {})


def api_page():
    """``wr.`` name by name."""
    parts = [
        "# API: `import wrcore as wr`\n",
        "SI units; axes, signs and names as follows.\n",
        _rst(".. automodule:: wrcore"),
    ]
    for group, names in groups().items():
        parts += [f"\n## {group}\n"]
        parts += [_entry("wrcore", name, getattr(wrcore, name)) for name in names]
    return "\n".join(parts)


def modules_page():
    """Functions and classes of the modules that scripts use."""
    lead = "Modules for scripts that want more than `wr.` has; private names and compiled kernels are left out.\n"
    parts = ["# Modules", f"\n{lead}"]
    for room in ROOMS:
        module = importlib.import_module(f"wrcore.{room}")
        parts += [f"\n## wrcore.{room}\n", _rst(f".. automodule:: wrcore.{room}\n   :no-index:")]
        for name, value in vars(module).items():
            own = getattr(value, "__module__", None) == module.__name__ and not name.startswith("_")
            if own and (inspect.isfunction(value) or inspect.isclass(value)) and inspect.getdoc(value):
                parts.append(_entry(module.__name__, name, value))
    return "\n".join(parts)


def _entry(module, name, value):
    """Directive that shows the docstring of a function, a class or a value."""
    if inspect.isclass(value):
        kind, options = "autoclass", "\n   :members:"
        if issubclass(value, Exception):
            options = ""
    else:
        kind, options = ("autofunction" if callable(value) else "autodata"), ""
    if module != "wrcore" and name in wrcore._PUBLIC:
        options += "\n   :no-index:"
    return _rst(f".. {kind}:: {module}.{name}{options}")


def _rst(text):
    return f"```{{eval-rst}}\n{text}\n```\n"


def cli_page():
    """Commands with their options, units and defaults, from the parsers themselves."""
    from wrcore import cli

    parser = cli.parser()
    parts = ["# Command line", f"\n{parser.description}\n"]
    for name, command, summary in _commands(parser):
        parts += [f"\n## wrcore {name}\n", f"{_sentence(summary)}\n", f"```text\n{_usage(command)}\n```\n"]
        for text in (command.description, command.epilog):
            if text and text.strip() != summary:
                parts.append(f"```text\n{inspect.cleandoc(text)}\n```\n")
        rows = [_option(action) for action in command._actions if action.dest != "help"]
        if rows:
            parts += ["| option | default | |", "|---|---|---|", *rows, ""]
    return "\n".join(parts)


def _commands(parser, before=""):
    """Names, parsers and summaries of all commands below a parser, depth first."""
    for action in parser._actions:
        if isinstance(action, argparse._SubParsersAction):
            summaries = {choice.dest: choice.help or "" for choice in action._choices_actions}
            for name, command in action.choices.items():
                below = list(_commands(command, f"{before}{name} "))
                yield from below or [(f"{before}{name}", command, summaries.get(name, ""))]


def _usage(command):
    return command.format_usage().removeprefix("usage: ").strip()


def _option(action):
    names = ", ".join(f"`{name}`" for name in action.option_strings) or f"`{action.metavar or action.dest}`"
    wanted = action.metavar if action.option_strings and action.nargs != 0 else None
    if action.choices and not action.metavar:
        wanted = "|".join(map(str, action.choices))
    if wanted and not isinstance(action, argparse.BooleanOptionalAction):
        names += f" `{wanted if isinstance(wanted, str) else ' '.join(wanted)}`"
    value = action.default
    default = "required" if action.required else "" if value in (None, False, [], argparse.SUPPRESS) else f"`{value}`"
    text = (action.help or "").replace("%%", "%").replace("%(default)s", str(value))
    return f"| {_cell(names)} | {default} | {_cell(text)} |"


def _sentence(text):
    return f"{text[:1].upper()}{text[1:]}{'' if text.endswith('.') else '.'}" if text else ""


def _cell(text):
    return text.replace("|", r"\|").replace("\n", " ")


def files_page():
    """Keys of all input files with what is expected and defaults, from the schemas that check them."""
    parts = [
        "# Input files, key by key",
        "\nFrom the schemas in `wrcore/scene/schemas/`, which check every file before work starts.\n",
    ]
    for name, title in SCHEMAS.items():
        schema = yaml.safe_load(files("wrcore.scene").joinpath(f"schemas/{name}.yaml").read_text("utf-8"))
        rows = list(_keys(schema, ""))
        parts += [
            f"\n## {_sentence(title).removesuffix('.')}\n",
            "| key | expected | default |",
            "|---|---|---|",
            *rows,
            "",
        ]
    return "\n".join(parts)


def _keys(schema, before):
    """Rows of a schema's keys, depth first; alternatives that are mappings are followed."""
    for part in (schema, *schema.get("anyOf", ()), *schema.get("oneOf", ()), *kinds_in(schema)):
        required = part.get("required", ())
        for key, value in part.get("properties", {}).items():
            path = f"{before}{key}"
            default = "required" if key in required else ""
            if value.get("default") not in (None, {}):
                default = f"`{value['default']}`"
            if value.get("description") or default:
                yield f"| `{path}` | {_cell(value.get('description', ''))} | {default} |"
            yield from _keys(value, f"{path}.")
            if isinstance(value.get("items"), dict):
                yield from _keys(value["items"], f"{path}[].")
            if isinstance(value.get("additionalProperties"), dict):
                yield from _keys(value["additionalProperties"], f"{path}.NAME.")


def names_page():
    """Channels of runs, counters and measures of sweeps."""
    from wrcore.run.checks.validity import LIMITS
    from wrcore.run.output.channels import DESCRIPTIONS, unit_of

    parts = ["# Channels, counters, measures", "\n## Channels of a run\n", "| channel | unit | |", "|---|---|---|"]
    parts += [f"| `{name}` | {unit_of(name)} | {_cell(text)} |" for name, text in DESCRIPTIONS.items()]
    parts += ["\n## Counters of limits\n", "| counter | what is counted |", "|---|---|"]
    parts += [f"| `{name}` | {_cell(text)} |" for name, text in LIMITS.items()]
    parts += ["\n## Measures of a sweep\n", _rst(".. automodule:: wrcore.sweep.measures\n   :no-index:")]
    return "\n".join(parts)

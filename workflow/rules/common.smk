# Checks of the configuration, and which sources each family of rules stands on.
import copy
import re
from fnmatch import fnmatchcase
from pathlib import Path

import yaml
from snakemake.exceptions import WorkflowError

from wrcore.errors import InputError, one_of
from wrcore.errors.checked_yaml import check, plain_tree
from wrcore.scene.description import load_scene

HERE = Path(workflow.basedir)


def drop_null(part):
    """Remove keys with the value null: --configfile leaves out parts of config/study.yaml by them."""
    for key in [key for key, value in part.items() if value is None]:
        del part[key]
    for inner in part.values():
        if isinstance(inner, dict):
            drop_null(inner)


GIVEN = copy.deepcopy(config)
"""The configuration with its nulls, for a second call of Snakemake."""

drop_null(config)


def refuse(key, expected):
    """Stop with one line that names a key of the configuration, and the file that gives it."""
    places = [key, *re.split(" on | with ", key)]
    changed = [
        path for path in map(Path, workflow.overwrite_configfiles)
        if any(has_key(yaml.safe_load(path.read_text()) or {}, place.split(".")) for place in places)
    ]  # fmt: skip
    file = changed[-1] if changed else HERE / "config/study.yaml"
    raise WorkflowError(f"{file.relative_to(HERE) if file.is_relative_to(HERE) else file}: {key}: {expected}")


def has_key(data, parts):
    """Whether nested data have a key; names may hold dots."""
    if not parts:
        return True
    if isinstance(data, list):
        return parts[0].isdigit() and int(parts[0]) < len(data) and has_key(data[int(parts[0])], parts[1:])
    ways = range(1, len(parts) + 1) if isinstance(data, dict) else ()
    return any(has_key(data[".".join(parts[:n])], parts[n:]) for n in ways if ".".join(parts[:n]) in data)


def check_config():
    """Stop before any job, with one line that names the key, if the configuration cannot be used."""
    schema = yaml.safe_load((HERE / "workflow/schemas/config.schema.yaml").read_text())
    try:
        check(plain_tree(config, "configuration"), schema, "configuration")
    except InputError as error:
        refuse(error.field, error.expected)
    for key, names, place in chosen_names():
        for name in names:
            if name not in (known := setting(config, place)):
                refuse(key, f"{one_of(known, name)} (names under {place})")
    if config["paper"]["comparison"]["case"] not in config["paper"]["timing"]["cases"]:
        refuse("paper.comparison.case", "expected one of paper.timing.cases")
    speeds = config["speeds"]
    if not set(speeds["shown"]) <= set(speeds["values"]):
        refuse("speeds.shown", "expected some of speeds.values")
    creep = config["creep"]
    if creep["shown"] not in [table["name"] for table in creep["tables"]]:
        refuse("creep.shown", f"expected a name under creep.tables, got {creep['shown']!r}")
    scenes = {
        f"{place}.{name}": (entry["scene"], entry["set"])
        for place in ("paper.cases", "accuracy.scenes", "cost.scenes", "hard_cases.vehicles")
        for name, entry in setting(config, place).items()
    }
    for vehicle, entry in config["speeds"]["vehicles"].items():
        for track, there in config["speeds"]["tracks"].items():
            scenes[f"speeds.vehicles.{vehicle} on speeds.tracks.{track}"] = (entry["scene"], entry["set"] | there)
    for case, entry in config["hard_cases"]["families"]["integration"]["long_run"]["changes"].items():
        place = f"hard_cases.families.integration.long_run.changes.{case}"
        vehicle = config["hard_cases"]["vehicles"][case]
        scenes[place] = (vehicle["scene"], vehicle["set"] | entry)
    hunting = config["hard_cases"]["families"]["streaming"]["hunting"]
    vehicle = config["hard_cases"]["vehicles"][hunting["name"]]
    scenes["hard_cases.families.streaming.hunting.changes"] = (vehicle["scene"], vehicle["set"] | hunting["changes"])
    for model in ("finer", "coarser"):
        for name, entry in config["accuracy"]["scenes"].items():
            if "exact" in entry:
                more = config["accuracy"]["exact"][model]
                scenes[f"accuracy.exact.{model} with accuracy.scenes.{name}"] = (entry["scene"], entry["set"] | more)
    for place in ("patch.cost", "patch.cells"):
        scenes[place] = (setting(config, place)["scene"], setting(config, place)["set"])
    scenes["paper.geometry"] = (config["paper"]["geometry"]["scene"], {})
    for vehicle, entry in config["critical_speed"]["vehicles"].items():
        for name, changes in config["critical_speed"]["variants"].items():
            place = f"critical_speed.vehicles.{vehicle} with critical_speed.variants.{name}"
            scenes[place] = (entry["scene"], entry["set"] | changes)
    scenes["crossings.scene"] = (config["crossings"]["scene"], {})
    for vehicle, entry in config["patch"]["runs"]["vehicles"].items():
        for name, model in config["patch"]["runs"]["models"].items():
            place = f"patch.runs.vehicles.{vehicle} with patch.runs.models.{name}"
            scene = config["critical_speed"]["vehicles"][vehicle]["scene"]
            scenes[place] = (scene, model["set"] | entry["track"])
            if "start" in model:
                scenes[f"{place}.start"] = (scene, model["set"] | model["start"])
    loaded = {key: checked(key, load_scene, scene, changes) for key, (scene, changes) in scenes.items()}
    for key in ("plain.scene", "creep", "axle_boxes"):
        check_tangent(f"cost.pairs.{key}", names_at(config["cost"]["pairs"], key), loaded)
    check_tangent("cost.stages.scenes", config["cost"]["stages"]["scenes"], loaded)
    for name, train in config["cost"]["growth"]["trains"].items():
        check_tangent(f"cost.growth.trains.{name}.scene", [train["scene"]], loaded)
    if not loaded["patch.cost"].track.tangent:
        refuse("patch.cost.scene", "expected a scene on tangent, perfect track")
    if not any(one.rails[1] for one in loaded["crossings.scene"].crossings):
        refuse("crossings.scene", "expected a scene with track.crossing in the right rail")
    check_numbers(config)
    check_profiles()
    check_wear_plans()


def checked(key, function, *arguments):
    """Call a function, and stop with one line that names a key of the configuration if it refuses its arguments."""
    try:
        return function(*arguments)
    except InputError as error:
        refuse(key, f"{error}")


def check_tangent(key, names, scenes):
    """Stop if one of the scenes under cost.scenes has a track that differs from place to place."""
    for name in names:
        if not scenes[f"cost.scenes.{name}"].track.tangent:
            refuse(key, f"expected scenes on tangent, perfect track, got {name!r}")


RISING = (
    "speeds.values", "creep.levels", "critical_speed.vehicles.*.cycle_speeds", "hard_cases.families.contact.slow_push.durations",
    "patch.zones.*", "ivp.baumgarte", "cost.growth.*.size.counts", "cost.growth.trains.*.size.counts",
)  # fmt: skip
"""Lists of numbers, each larger than the one before."""


def check_numbers(data, key=""):
    """Stop if equally spaced numbers or a list under `RISING` do not rise."""
    if isinstance(data, dict) and data.keys() == {"start", "stop", "num"} and data["start"] >= data["stop"]:
        refuse(f"{key}.stop", f"expected more than start, {data['start']:g}, got {data['stop']:g}")
    if isinstance(data, list) and any(fnmatchcase(key, pattern) for pattern in RISING):
        if any(one >= next for one, next in zip(data, data[1:])):
            refuse(key, f"expected rising numbers, got {data}")
    for name, inner in data.items() if isinstance(data, dict) else ():
        check_numbers(inner, f"{key}.{name}".strip("."))


def check_profiles():
    """Stop if a pair of profiles cannot be read, or a profile of the hard cases lacks an argument of its kind."""
    from study.contact.tables import study_pair
    from study.hard_cases.profiles import SHAPES

    hard = config["hard_cases"]["families"]
    for place, pairs in (("contact.pairs", config["contact"]["pairs"]),
                         ("hard_cases.families.contact.pose_sweeps.pairs", hard["contact"]["pose_sweeps"]["pairs"])):
        for label, pair in pairs.items():
            checked(f"{place}.{label}", study_pair, pair)
    for name, entry in hard["profiles"]["profiles"]["entries"].items():
        expected, given = SHAPES[entry["kind"]], set(entry.get("shape", {}))
        if given != expected:
            refuse(f"hard_cases.families.profiles.profiles.entries.{name}", f"expected the shape {sorted(expected)}, got {sorted(given)}")
    patch = config["patch"]
    if patch["shown"]["load"] not in patch["loads"]:
        refuse("patch.shown.load", f"expected one of patch.loads, got {patch['shown']['load']:g}")


def check_wear_plans():
    """Stop if the wear plan, its settings or a variant of it cannot be used."""
    from study.wear.influences import variant_changes
    from wrcore.analysis.wear.evolve import load_wear_plan

    wear, checked_changes = config["wear"], set()
    asked = {"wear.settings": wear["settings"]}
    for name, variant in wear["influences"]["variants"].items():
        asked[f"wear.influences.variants.{name}"] = variant_changes(variant, wear["influences"]["distance"])
    for key, changes in asked.items():
        if repr(changes) not in checked_changes:
            checked(f"wear.plan with {key}", load_wear_plan, wear["plan"], changes)
        checked_changes.add(repr(changes))


def chosen_names():
    """Keys that choose by name: key, the names, and the key under which they stand."""
    paper, speeds, patch, cost = (config[section] for section in ("paper", "speeds", "patch", "cost"))
    yield "paper.timing.cases", paper["timing"]["cases"], "paper.cases"
    yield "paper.timing.first", paper["timing"]["first"], "paper.cases"
    yield "paper.comparison.case", [paper["comparison"]["case"]], "paper.cases"
    yield "paper.figures.contact_points", [paper["figures"]["contact_points"]], "paper.cases"
    for key in ("released", "disturbed"):
        yield f"speeds.{key}", [speeds[key]], "speeds.tracks"
    yield "patch.shown.model", [patch["shown"]["model"]], "patch.models"
    yield "patch.cost.models", patch["cost"]["models"], "patch.models"
    yield "patch.runs.exact", [patch["runs"]["exact"]], "patch.runs.models"
    yield "patch.runs.vehicles", patch["runs"]["vehicles"], "critical_speed.vehicles"
    for name, model in patch["runs"]["models"].items():
        yield f"patch.runs.models.{name}.variant", {model.get("variant")} - {None}, "critical_speed.variants"
    for key in ("plain.scene", "creep", "axle_boxes", "detection", "engine"):
        yield f"cost.pairs.{key}", names_at(cost["pairs"], key), "cost.scenes"
    for key in ("stages.scenes", "growth.runs.scene", "growth.chains.scene", "growth.simultaneous.scene", "batch.scene", "rejections.scenes"):
        yield f"cost.{key}", names_at(cost, key), "cost.scenes"
    for name, train in cost["growth"]["trains"].items():
        yield f"cost.growth.trains.{name}.scene", [train["scene"]], "cost.scenes"
    for family, cases in config["hard_cases"]["families"].items():
        for case, settings in cases.items():
            for key in {"name", "names", "vehicles", "unstable", "pushes", "changes"} & set(settings) - BY_KEY.get(case, set()):
                yield f"hard_cases.families.{family}.{case}.{key}", names_at(settings, key), "hard_cases.vehicles"


BY_KEY = {"hunting": {"changes"}}
"""Settings of hard cases that are changes to a scene, not names of vehicles."""


def names_at(data, key):
    """Names at a dotted key: one, a list, or the keys of a mapping."""
    found = setting(data, key)
    return [found] if isinstance(found, str) else list(found)


def setting(data, key):
    """Value at a dotted key."""
    for part in key.split("."):
        data = data[part]
    return data


if workflow.is_main_process:  # jobs get a configuration that has been checked
    check_config()

PAGES = {
    "comparison": "01 The paper's values and ours",
    "paper": "02 The paper's figures",
    "contact": "03 Contact geometry",
    "patch": "04 The real patch",
    "creep": "05 Creep forces",
    "speeds": "06 Wheelset and trailer vehicle",
    "critical_speed": "07 Hunting: critical speeds",
    "accuracy": "08 Speed against error",
    "cost": "09 Cost",
    "hard_cases": "10 Hard cases",
    "ivp": "11 Benchmark of integrators",
    "sweeps": "12 Sweeps",
    "wear": "13 Wear",
    "crossings": "14 Crossings",
}
"""Pages of the report by question; the table of comparison has a page of its own."""


def shown(name, title, page=None, caption=None, **labels):
    """Mark a file below ``<results>`` for the report: a figure or table with its title and the labels of its wildcards.

    Its caption has the file's name without wildcards, and its page is that of its question, unless both are given.
    """
    question, file = name.split("/")
    stem = re.sub(r"_?{\w+}", "", Path(file).stem)
    return report(
        f"<results>/{name}",
        caption=f"../report/{question}/{caption or stem}.rst",
        category=PAGES[page or question],
        labels={"figure" if file.endswith(".png") else "table": title, **labels},
    )


CASES = list(config["paper"]["cases"])
WITH_TWINS = [case for case in CASES if config["paper"]["cases"][case]["twins"]]


wildcard_constraints:
    case="|".join(CASES),


def sources(*rooms):
    """Files of rooms (``equations``, ``study/contact``) or of single modules (``analysis/motion``).

    A rule lists them as inputs, else an edit there would go unnoticed.
    """
    files = ["wrcore/__init__.py", *map(str, sorted(Path("wrcore/errors").glob("*.py")))]
    for room in rooms:
        place = Path("workflow" if room.startswith("study/") else "wrcore") / room
        inside = [p for p in place.rglob("*") if p.suffix in (".py", ".yaml", ".csv")]
        found = sorted(map(str, inside)) or [f"{place}.py"]
        if not Path(found[0]).is_file():
            raise WorkflowError(f"sources: expected a room or a module, got {room!r}")
        files += found
    return files


CONTACT = ("kernels", "geometry", "contact")
FORCES = ("bodies", "creep", "wheels", "track", "forces", "equations", "jacobian")
SCENE = ("vehicle", "balance", "scene")
RUN = (*CONTACT, *FORCES, "integrate", *SCENE, "run")
VEHICLE = ("analysis/assessment/wheels",)
LOADED = (*CONTACT, *FORCES, "analysis/contact/loaded", "analysis/contact/poses")
STYLE = ("analysis/pictures/style", "analysis/legible")
CORE = {
    "creep": sources("kernels", "creep", "contact/rolling"),
    "creep_study": sources("kernels", "creep", "contact/rolling", "study/creep/laws", "analysis/creep_curves"),
    "creep_figures": sources("kernels", "creep", "contact/rolling", "study/creep", "analysis/creep_curves", "analysis/pictures/plot_creep", *STYLE),
    "geometry": sources(*LOADED, *SCENE, "analysis/motion", "analysis/contact/rigid", "study/paper/tables"),
    "contact_figures": sources(*LOADED, "analysis/contact/contact", "analysis/contact/rigid", "analysis/pictures/plot_contact", *STYLE, "study/contact"),
    "simulation": sources(*RUN, "study/creep_table"),
    "vehicle": sources(*VEHICLE, "analysis/motion", "study/speeds/sweep", "study/speeds/tables"),
    "vehicle_figures": sources("run", *VEHICLE, *STYLE, "analysis/motion", "analysis/pictures/plot_motion", "study/speeds"),
    "accuracy": sources(*VEHICLE, "analysis/accuracy"),
    "accuracy_requests": sources(*VEHICLE, "analysis/to_accuracy", "study/accuracy/requests"),
    "accuracy_figures": sources("run/accuracy", *VEHICLE, *STYLE, "analysis/accuracy", "study/accuracy"),
    "paper": sources("run", "analysis/motion", "analysis/contact/rigid", "study/paper/tables"),
    "figures": sources(*CONTACT, *SCENE, "run", *STYLE, "analysis/motion", "analysis/pictures/plot_motion", "study/paper", "reference/surfaces"),
}
SCENES = sorted(str(p) for folder in ("scenes", "vehicles") for p in Path("config", folder).glob("*.yaml"))


def case_scene(wildcards):
    return config["paper"]["cases"][wildcards.case]["scene"]


def changes(entries):
    """Changes to a scene, as `wrcore simulate --set` takes them."""
    return [f"{key}={value}" for key, value in entries.items()]


def overrides(case):
    return changes(config["paper"]["cases"][case]["set"])


# Functions of the wildcards only: Snakemake does not compare params that depend on inputs with those of the last run.
def case_overrides(wildcards):
    return overrides(wildcards.case)

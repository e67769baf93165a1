# Checks of the configuration, and which sources each family of rules stands on.
from pathlib import Path

import yaml
from snakemake.exceptions import WorkflowError

from wrcore.errors import InputError
from wrcore.errors.checked_yaml import _validator
from wrcore.scene.description import load_scene

HERE = Path(workflow.basedir)


def check_config():
    """Stop before any job, with one line that names the key, if the configuration cannot be used."""
    schema = yaml.safe_load((HERE / "workflow/schemas/config.schema.yaml").read_text())
    validator = _validator()(schema)  # imports jsonschema, without a grammar that would take most of a second

    from jsonschema.exceptions import best_match

    error = best_match(validator.iter_errors(config))
    if error is not None:
        key = ".".join(map(str, error.absolute_path)) or "top level"
        meaning = error.schema.get("description", "see workflow/schemas/config.schema.yaml")
        raise WorkflowError(f"configuration: {key}: {error.message} ({meaning})")
    chosen = {
        "paper.timing.cases": config["paper"]["timing"]["cases"],
        "paper.timing.first": config["paper"]["timing"]["first"],
        "paper.comparison.case": [config["paper"]["comparison"]["case"]],
        "paper.figures.contact_points": [config["paper"]["figures"]["contact_points"]],
    }
    for key, names in chosen.items():
        for name in set(names) - set(config["paper"]["cases"]):
            raise WorkflowError(f"configuration: {key}: expected a name under paper.cases, got {name!r}")
    if config["paper"]["comparison"]["case"] not in config["paper"]["timing"]["cases"]:
        raise WorkflowError("configuration: paper.comparison.case: expected one of paper.timing.cases")
    speeds = config["speeds"]
    for key in ("released", "disturbed"):
        if speeds[key] not in speeds["tracks"]:
            raise WorkflowError(f"configuration: speeds.{key}: expected a name under speeds.tracks, got {speeds[key]!r}")
    if not set(speeds["shown"]) <= set(speeds["values"]):
        raise WorkflowError("configuration: speeds.shown: expected some of speeds.values")
    creep = config["creep"]
    if creep["shown"] not in [table["name"] for table in creep["tables"]]:
        raise WorkflowError(f"configuration: creep.shown: expected a name under tables, got {creep['shown']!r}")
    scenes = {f"paper.cases.{case}": (entry["scene"], entry["set"]) for case, entry in config["paper"]["cases"].items()}
    for name, entry in config["accuracy"]["scenes"].items():
        scenes[f"accuracy.scenes.{name}"] = (entry["scene"], entry["set"])
    for vehicle, entry in config["speeds"]["vehicles"].items():
        for track, there in config["speeds"]["tracks"].items():
            scenes[f"speeds.vehicles.{vehicle} on speeds.tracks.{track}"] = (entry["scene"], entry["set"] | there)
    for name, entry in config["cost"]["scenes"].items():
        scenes[f"cost.scenes.{name}"] = (entry["scene"], entry["set"])
    for name, entry in config["hard_cases"]["vehicles"].items():
        scenes[f"hard_cases.vehicles.{name}"] = (entry["scene"], entry["set"])
    scenes["paper.geometry"] = (config["paper"]["geometry"]["scene"], {})
    for vehicle, entry in config["critical_speed"]["vehicles"].items():
        for name, changes in config["critical_speed"]["variants"].items():
            place = f"critical_speed.vehicles.{vehicle} with critical_speed.variants.{name}"
            scenes[place] = (entry["scene"], entry["set"] | changes)
    scenes["crossings.scene"] = (config["crossings"]["scene"], {})
    scenes["patch.cells"] = (config["patch"]["cells"]["scene"], config["patch"]["cells"]["set"])
    for vehicle, entry in config["patch"]["runs"]["vehicles"].items():
        for name, model in config["patch"]["runs"]["models"].items():
            place = f"patch.runs.vehicles.{vehicle} with patch.runs.models.{name}"
            scenes[place] = (config["critical_speed"]["vehicles"][vehicle]["scene"], model["set"] | entry["track"])
    for key, (scene, changes) in scenes.items():
        try:
            load_scene(scene, changes)
        except InputError as error:
            raise WorkflowError(f"configuration: {key}: {error}")


check_config()

CASES = list(config["paper"]["cases"])
WITH_TWINS = [case for case in CASES if config["paper"]["cases"][case]["twins"]]


wildcard_constraints:
    case="|".join(CASES),


def sources(*rooms):
    """Files of rooms (``dynamics``, ``study/contact``) or of single modules (``analysis/motion``).

    A rule lists them as inputs, else an edit there would go unnoticed.
    """
    files = ["wrcore/__init__.py", *map(str, sorted(Path("wrcore/errors").glob("*.py")))]
    for room in rooms:
        place = Path("workflow" if room.startswith("study/") else "wrcore") / room
        inside = [p for p in place.rglob("*") if p.suffix in (".py", ".yaml", ".csv")]
        files += sorted(map(str, inside)) or [f"{place}.py"]
    return files


CONTACT = ("kernels", "geometry", "contact")
SCENE = ("vehicle", "balance", "scene")
RUN = (*CONTACT, "creep", "elements", "dynamics", "integrate", *SCENE, "run")
VEHICLE = ("analysis/assessment/wheels",)
LOADED = (*CONTACT, "creep", "elements", "dynamics", "analysis/contact/loaded", "analysis/contact/poses")
STYLE = ("analysis/pictures/style", "study/style", "study/report/legible")
CORE = {
    "creep": sources("kernels", "creep"),
    "creep_study": sources("kernels", "creep", "study/creep/laws"),
    "creep_figures": sources("kernels", "creep", "study/creep", *STYLE),
    "geometry": sources(*LOADED, *SCENE, "study/paper/motion", "study/paper/tables"),
    "contact_search": sources(*LOADED, "analysis/contact/contact", "study/contact/tables", "study/contact/search"),
    "contact_figures": sources(*LOADED, "analysis/contact/contact", "analysis/pictures/plot_contact", *STYLE, "study/contact"),
    "simulation": sources(*RUN, "study/creep_table"),
    "vehicle": sources(*VEHICLE, "study/speeds/sweep", "study/speeds/tables"),
    "vehicle_figures": sources("run", *VEHICLE, *STYLE, "study/speeds"),
    "accuracy": sources(*VEHICLE, "study/accuracy/errors", "study/accuracy/models"),
    "accuracy_requests": sources(*VEHICLE, "analysis/to_accuracy", "study/accuracy/requests"),
    "accuracy_figures": sources("run/accuracy", *VEHICLE, *STYLE, "study/accuracy"),
    "paper": sources("run", "study/paper/motion", "study/paper/tables"),
    "figures": sources(*CONTACT, *SCENE, "run", *STYLE, "study/paper", "study/contact/surface"),
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

# Checks of the configuration, and which sources each family of rules stands on.
from pathlib import Path

import jsonschema
import yaml
from snakemake.exceptions import WorkflowError

from wrcore.errors import InputError
from wrcore.scene.description import load_scene

HERE = Path(workflow.basedir)


def check_config():
    """Stop before any job, with one line that names the key, if the configuration cannot be used."""
    schema = yaml.safe_load((HERE / "workflow/schemas/config.schema.yaml").read_text())
    error = jsonschema.exceptions.best_match(jsonschema.Draft202012Validator(schema).iter_errors(config))
    if error is not None:
        key = ".".join(map(str, error.absolute_path)) or "top level"
        meaning = error.schema.get("description", "see workflow/schemas/config.schema.yaml")
        raise WorkflowError(f"configuration: {key}: {error.message} ({meaning})")
    chosen = {
        "timing.cases": config["timing"]["cases"],
        "comparison.case": [config["comparison"]["case"]],
        "figures.contact_points": [config["figures"]["contact_points"]],
    }
    for key, names in chosen.items():
        for name in set(names) - set(config["cases"]):
            raise WorkflowError(f"configuration: {key}: expected a name under cases, got {name!r}")
    if config["comparison"]["case"] not in config["timing"]["cases"]:
        raise WorkflowError("configuration: comparison.case: expected one of timing.cases")
    speeds = config["speeds"]
    for key in ("released", "disturbed"):
        if speeds[key] not in speeds["tracks"]:
            raise WorkflowError(f"configuration: speeds.{key}: expected a name under speeds.tracks, got {speeds[key]!r}")
    if not set(speeds["shown"]) <= set(speeds["values"]):
        raise WorkflowError("configuration: speeds.shown: expected some of speeds.values")
    creep = config["creep_study"]
    if creep["shown"] not in [table["name"] for table in creep["tables"]]:
        raise WorkflowError(f"configuration: creep_study.shown: expected a name under tables, got {creep['shown']!r}")
    scenes = {f"cases.{case}": (entry["scene"], entry["set"]) for case, entry in config["cases"].items()}
    for name, entry in config["accuracy_study"]["scenes"].items():
        scenes[f"accuracy_study.scenes.{name}"] = (entry["scene"], entry["set"])
    for vehicle, entry in config["speeds"]["vehicles"].items():
        for track, there in config["speeds"]["tracks"].items():
            scenes[f"speeds.vehicles.{vehicle} on speeds.tracks.{track}"] = (entry["scene"], entry["set"] | there)
    for name, entry in config["cost_study"]["scenes"].items():
        scenes[f"cost_study.scenes.{name}"] = (entry["scene"], entry["set"])
    for name, entry in config["stability_study"]["vehicles"].items():
        scenes[f"stability_study.vehicles.{name}"] = (entry["scene"], entry["set"])
    scenes["contact_geometry"] = (config["contact_geometry"]["scene"], {})
    for vehicle, entry in config["critical_speed"]["vehicles"].items():
        for name, changes in config["critical_speed"]["variants"].items():
            scenes[f"critical_speed.vehicles.{vehicle} with critical_speed.variants.{name}"] = (entry["scene"], changes)
    for key, (scene, changes) in scenes.items():
        try:
            load_scene(scene, [f"{name}={value}" for name, value in changes.items()])
        except InputError as error:
            raise WorkflowError(f"configuration: {key}: {error}")


check_config()

CASES = list(config["cases"])
WITH_TWINS = [case for case in CASES if config["cases"][case]["twins"]]


wildcard_constraints:
    case="|".join(CASES),


def sources(*rooms):
    """Files of wrcore's rooms. A rule lists them as inputs, else an edit there would go unnoticed."""
    files = ["wrcore/__init__.py", "wrcore/_jit.py", "wrcore/errors.py"]
    for room in rooms:
        files += sorted(str(p) for p in Path("wrcore").glob(f"{room}/*") if p.is_file()) or [f"wrcore/{room}.py"]
    return files


SCENE = ("vehicle", "schemas", "checked_yaml", "initial", "scene")
RUN = ("course", "validity", "simulate", "run", "channels", "checkpoints", "results")
CORE = {
    "creep": sources("creep"),
    "creep_study": sources("creep", "analysis_creep"),
    "creep_figures": sources("creep", "analysis_creep", "analysis_creep_table", "figures", "figures_creep"),
    "geometry": sources("geometry", "contact", *SCENE),
    "contact_search": sources("geometry", "contact", "analysis_contact", "analysis_contact_search"),
    "contact_figures": sources(
        "geometry", "contact", "analysis_contact", "analysis_contact_reference", "figures", "figures_contact"
    ),
    "simulation": sources("geometry", "contact", "creep", "dynamics", *SCENE, *RUN),
    "vehicle": sources("analysis", "analysis_vehicle", "sweep", *RUN),
    "vehicle_figures": sources(*RUN, "analysis", "analysis_vehicle", "figures", "figures_vehicle"),
    "accuracy": sources("analysis", "analysis_vehicle", "analysis_accuracy"),
    "accuracy_figures": sources("analysis", "analysis_vehicle", "analysis_accuracy", "figures", "figures_accuracy"),
    "analysis": sources(*RUN, "analysis"),
    "figures": sources("geometry", "contact", *SCENE, *RUN, "analysis", "figures"),
}
SCENES = sorted(str(p) for folder in ("scenes", "vehicles") for p in Path("config", folder).glob("*.yaml"))


def case_scene(wildcards):
    return config["cases"][wildcards.case]["scene"]


def changes(entries):
    """Changes to a scene, as `wrcore simulate --set` takes them."""
    return [f"{key}={value}" for key, value in entries.items()]


def overrides(case):
    return changes(config["cases"][case]["set"])


# Functions of the wildcards only: Snakemake does not compare params that depend on inputs with those of the last run.
def case_overrides(wildcards):
    return overrides(wildcards.case)

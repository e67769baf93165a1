"""Section of a report: scene and vehicle."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import Any

from matplotlib.axes import Axes

from wrcore.analysis.pictures.plot_vehicle import MARKS, draw_view
from wrcore.reporting.page import Markup, Row, element, figure, grid, join, paragraph, quantities
from wrcore.reporting.panels import panel
from wrcore.reporting.subject import Report, Subject

TITLE = "Scene and vehicle"

SIZE = 5.5, 2.0
"""Width of a picture of a vehicle, inches; its height follows from the vehicle."""

PATCHES = {
    "tabulated": "exact contact, interpolated in a lookup table",
    "exact": "exact contact, solved in each evaluation",
    "surrogate": "exact contact, approximated by a trained network",
    "moment": "an ellipse with the moments of the overlap",
    "maximum": "an ellipse at the deepest point of the overlap",
}  # fmt: skip
"""Contact models (``contact.patch``) in words."""


def section(report: Report) -> Markup:
    """Return the settings of all scenes as a table, and a picture of each vehicle."""
    table = quantities(_rows(report), report.labels, "setting")
    note = "A setting that differs between the runs has a coloured background." if report.several else ""
    pictures = _pictures(report)
    if not report.several and pictures:
        return grid([element("div", table), element("div", *pictures)], "two")
    return join([table, paragraph(note, class_="note") if note else "", grid(pictures, "two")])


def _rows(report: Report) -> list[Row]:
    found = {subject.label: _settings(subject) for subject in report.subjects}
    names = list(dict.fromkeys(name for settings in found.values() for name in settings))
    return [
        Row(name.replace(" ", "_"), name, "", "", 1.0, [settings.get(name, "–") for settings in found.values()])
        for name in names
    ]


def _settings(subject: Subject) -> dict[str, str]:
    """Return the settings of a scene in words; parts that the scene does not have are omitted."""
    data, run = subject.data, subject.run
    track, contact, output = (part(data, name) for name in ("track", "contact", "output"))
    vehicle, rail = part(data, "vehicle"), part(data, "rail")
    model = vehicle.get("model", vehicle.get("parameters", ""))
    count = vehicle.get("count", 1)
    found = {
        "vehicle": _words(model) + (f", {count} of them" if count != 1 else ""),
        "wheel profile": _profile(part(data, "wheel")),
        "rail profile": _profile(rail) + (f", inclined {rail['inclination']}" if rail.get("inclination") else ""),
        "track": _track(track),
        "speed": f"{data['speed']:g} m/s ({3.6 * data['speed']:.4g} km/h)" if _is_number(data.get("speed")) else "",
        "friction": _friction(contact.get("friction")),
        "contact model": _patch(contact),
        "creep law": _words(part(contact, "creep").get("model", "")),
        "integration": _integration(run.settings),
        "output": f"{output['rate']:g} 1/s: {_words(output.get('channels', ''))}"
        if _is_number(output.get("rate"))
        else "",
        "version": f"wrcore {run.settings['wrcore_version']}" if "wrcore_version" in run.settings else "",
    }
    return {name: text for name, text in found.items() if text}


def part(data: Any, name: str) -> Mapping[str, Any]:
    """Return a mapping inside a scene; an empty one if the scene does not have it."""
    found = data.get(name) if isinstance(data, Mapping) else None
    return found if isinstance(found, Mapping) else {}


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def _words(value: Any) -> str:
    return ", ".join(map(str, value)) if isinstance(value, list | tuple) else str(value).replace("_", " ")


def _profile(data: Mapping[str, Any]) -> str:
    for name in ("profile", "points", "slices"):
        if name in data:
            return str(data[name])
    return ""


def _track(track: Mapping[str, Any]) -> str:
    path = track.get("path", "tangent")
    texts = ["straight"] if path == "tangent" else []
    if isinstance(path, list):
        radii = [segment["radius"] for segment in path if isinstance(segment, Mapping) and "radius" in segment]
        texts.append("curves with radii of " + ", ".join(f"{radius} m" for radius in dict.fromkeys(radii)) if radii
                     else "straight")  # fmt: skip
    extras = {"gradients": "gradients", "irregularity": "irregularity", "crossing": "crossing",
              "support": "flexible track", "corrugation": "corrugation"}  # fmt: skip
    texts += [text for name, text in extras.items() if track.get(name)]
    gauge = track.get("gauge")
    if isinstance(gauge, int | float):
        texts.append(f"gauge {1e3 * gauge:g} mm")
    return ", ".join(texts)


def _friction(value: Any) -> str:
    if _is_number(value):
        return f"{value:g}"
    values = value.get("mu") if isinstance(value, Mapping) else None
    if isinstance(values, list) and values and all(map(_is_number, values)):
        return f"{min(values):g} to {max(values):g}, over the distance"
    return _words(", ".join(value) if isinstance(value, Mapping) else "") or ""


def _patch(contact: Mapping[str, Any]) -> str:
    name = str(contact.get("patch", ""))
    about = f" ({PATCHES[name]})" if name in PATCHES else ""
    return f"{name}{about}, {contact.get('detection', '')} detection".removesuffix(",  detection") if name else ""


def _integration(settings: Mapping[str, Any]) -> str:
    method = str(settings.get("method_used") or settings.get("method", ""))
    if isinstance(step := settings.get("step"), int | float) and step > 0.0:
        return f"{method}, steps of {step:g} s"
    return f"{method}, relative tolerance {settings['rtol']:g}" if _is_number(settings.get("rtol")) else method


def _pictures(report: Report) -> list[Markup]:
    """Return side and plan view of each different vehicle."""
    found: dict[str, list[str]] = {}
    vehicles = {}
    for subject, scene in report.each("Picture of the vehicle", lambda subject: subject.scene):
        vehicle = scene.vehicle.unit or scene.vehicle
        key = repr(vehicle.data)
        vehicles[key] = vehicle
        found.setdefault(key, []).append(subject.label)
    parts = []
    for key, labels in found.items():
        vehicle = vehicles[key]
        whose = f" ({', '.join(labels)})" if len(found) > 1 else ""
        for view, text in (("side", "Side view"), ("plan", "Plan view")):
            label = f"{text} of {vehicle.name}{whose}"
            picture = panel(partial(_draw, vehicle, view), label, SIZE, fits=True)
            parts.append(figure(picture, join([label, ". ", _marks(vehicle)]) if view == "plan" else f"{label}."))
    return parts


def _draw(vehicle: Any, view: str, axes: Axes) -> None:
    draw_view(axes, vehicle, view)
    axes.set(xlabel="x / m", ylabel="z / m" if view == "side" else "y / m")


def _marks(vehicle: Any) -> Markup:
    """Return the kinds of force elements in words, with the colours of their marks."""
    kinds = dict.fromkeys(item["kind"] for item in vehicle.data["elements"])
    if vehicle.data["joints"]:
        kinds["joint"] = None
    texts = [
        element("span", "■ ", kind.replace("_", " "), style=f"color: {MARKS[kind]['color']}")
        for kind in kinds if kind in MARKS and str(MARKS[kind].get("color", "")).startswith("#")
    ]  # fmt: skip
    return join(["Marks are force elements: " if texts else "", join(texts, ", "),
                 ". " if texts else "", "Boxes have the mass and moments of inertia of their bodies."])  # fmt: skip

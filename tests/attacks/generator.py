"""Bad input, drawn by hypothesis from the schemas and parsers: documents, texts, bytes, HDF5 files, options."""

import contextlib
import copy
import datetime
import math
import os

import h5py
import numpy as np
from hypothesis import HealthCheck, settings
from hypothesis import strategies as st

from wrcore.cli import parser
from wrcore.errors import checked_yaml
from wrcore.errors.checked_hdf5 import sign
from wrcore.errors.schema_keys import kinds_in


def examples(count):
    """Hypothesis settings of a test with ``count`` inputs, the same ones every time; ``WRCORE_ATTACK=10``: ten times
    as many."""
    count = round(count * float(os.environ.get("WRCORE_ATTACK", "1")))
    return settings(
        max_examples=max(1, count), derandomize=True, deadline=None, database=None,
        suppress_health_check=list(HealthCheck),
    )  # fmt: skip


# ------------------------------------------------------------------------------------------------------------- values

numbers = st.one_of(
    st.sampled_from(
        [math.nan, math.inf, -math.inf, 0, -0.0, -1, 1e-320, 1e-12, -1e-3, 1e6, 1e300, -1e300, 10**400, 0.5]
    ),
    st.floats(),
    st.integers(),
    st.floats(-2.0, 2.0),
)
"""Numbers of every size and sign, and those that are none."""

texts = st.one_of(
    st.text(max_size=12),
    st.sampled_from(["", " ", "nan", "1e999", "1/0", "0x10", "../..", "/", "\x00", "1_0", "~", "é", "1:30", "20 m/s"]),
)
leaves = st.one_of(
    st.none(), st.booleans(), numbers, texts, st.just(datetime.date(2001, 2, 3)), st.just(b"\xff\x00"), st.just({1, 2})
)
junk = st.recursive(
    leaves,
    lambda inner: st.one_of(st.lists(inner, max_size=3), st.dictionaries(texts, inner, max_size=3)),
    max_leaves=5,
)
"""Whatever YAML can hold."""


def schema_of(kind):
    """Return a schema of the package; that of a scene with those of its track and vehicle inside."""
    schema = copy.deepcopy(checked_yaml.schema_of(kind))
    if kind == "scene":
        inside = schema["properties"]
        inside["track"], inside["vehicle"]["properties"]["parameters"] = schema_of("track"), schema_of("vehicle")
    return schema


def ways(part):
    """Parts of a schema of which a value matches one, with those of ``part`` itself."""
    return [part, *part.get("anyOf", ()), *kinds_in(part)]


def part_at(schema, path):
    """Return the part of a schema that describes the value at a path of a document, {} where there is none."""
    for key in path:
        inside = ways(schema)
        if isinstance(key, int):
            found = [one["items"] for one in inside if isinstance(one.get("items"), dict)]
        else:
            found = [one["properties"][key] for one in inside if key in one.get("properties", {})]
            found += [
                one["additionalProperties"] for one in inside if isinstance(one.get("additionalProperties"), dict)
            ]
        if not found:
            return {}
        schema = found[0]
    return schema


def allowed(part, depth=3):
    """Strategy of values that a part of a schema allows, with those at its bounds and just outside them."""
    inner = [one for one in ways(part)[1:] if depth]
    if inner:
        return st.one_of(*(allowed(one, depth - 1) for one in inner))
    if "enum" in part:
        return st.sampled_from([value for value in part["enum"] if value != "cvode"])
    kinds = part.get("type", ())
    kinds = [kinds] if isinstance(kinds, str) else kinds
    found = []
    if "number" in kinds or "integer" in kinds:
        low = float(part.get("minimum", part.get("exclusiveMinimum", -1e9)))
        high = float(part.get("maximum", part.get("exclusiveMaximum", 1e9)))
        bounds = [low, high, math.nextafter(low, -math.inf), math.nextafter(high, math.inf), low + 1e-300]
        within = st.integers(math.ceil(low), math.floor(high)) if "integer" in kinds else st.floats(low, high)
        found += [st.sampled_from(bounds), within]
    if "boolean" in kinds:
        found.append(st.booleans())
    if "string" in kinds:
        found.append(texts)
    if "array" in kinds and depth:
        found.append(st.lists(allowed(part.get("items", {}), depth - 1), min_size=1, max_size=3))
    if "object" in kinds and depth:
        keys = {key: allowed(one, depth - 1) for key, one in part.get("properties", {}).items()}
        required = {key: keys.pop(key) for key in part.get("required", ()) if key in keys}
        found.append(st.fixed_dictionaries(required, optional=dict(list(keys.items())[:6])))
    return st.one_of(*found) if found else junk


# ---------------------------------------------------------------------------------------------------------- documents


def places(document, path=()):
    """Paths of all values in a nested document."""
    yield path
    items = (
        document.items() if isinstance(document, dict) else enumerate(document) if isinstance(document, list) else ()
    )
    for key, value in items:
        yield from places(value, (*path, key))


@st.composite
def spoiled(draw, document, schema, most=3):
    """The document with one to ``most`` faults.

    A value is replaced (by what its schema allows, by a bound of it, by junk) or scaled, a key or item left out or
    added (one of the schema, or an unknown one).
    """
    document = copy.deepcopy(document)
    for _ in range(draw(st.integers(1, most))):
        *path, last = draw(st.sampled_from([place for place in places(document) if place] or [("x",)]))
        parent = document
        for key in path:
            parent = parent[key]
        fault = draw(st.sampled_from(["allowed", "allowed", "replace", "scale", "drop", "add", "known", "number"]))
        if fault == "drop":
            parent.pop(last, None) if isinstance(parent, dict) else parent.pop(last)
        elif fault == "known" and isinstance(parent, dict):
            known = [key for one in ways(part_at(schema, path)) for key in one.get("properties", ())]
            key = draw(st.sampled_from([*known, "x"]))
            parent[key] = draw(allowed(part_at(schema, [*path, key])))
        elif fault == "add" and isinstance(parent, dict):
            parent[draw(texts)] = draw(junk)
        elif fault in ("add", "known") and isinstance(parent, list):
            parent.append(draw(st.one_of(junk, allowed(part_at(schema, [*path, last])))))
        elif fault == "scale" and type(parent[last]) in (int, float) and abs(parent[last]) < 1e300:
            parent[last] *= draw(st.sampled_from([-1, 0, 1e-3, 0.5, 1.1, 2, 10, 1e3, 1e6, 1e150]))
        elif fault == "allowed":
            parent[last] = draw(allowed(part_at(schema, [*path, last])))
        else:
            parent[last] = draw(numbers if fault == "number" else junk)
    return document


@st.composite
def spoiled_text(draw, text, alphabet=None):
    """The text cut, with parts doubled, replaced or removed."""
    letters = st.characters() if alphabet is None else alphabet
    for _ in range(draw(st.integers(1, 4))):
        first = draw(st.integers(0, len(text)))
        last = min(len(text), first + draw(st.integers(0, 12)))
        insert = draw(
            st.one_of(
                st.text(letters, max_size=4), texts,
                st.sampled_from(["nan", "inf", "\t", "1e999", ",,", "&a", "*a", "<<: ", "[", "{", ": ", "!!", "\r\n"]),
            )
        )  # fmt: skip
        text = draw(
            st.sampled_from(
                [text[:first], text[:first] + insert + text[last:], text[:last] + text[first:], text[first:]]
            )
        )
    return text


@st.composite
def spoiled_options(draw, command, valid):
    """Words of a command with one or two options of its parser replaced by wrong ones."""
    (sub,) = [action for action in parser()._actions if action.choices and hasattr(action, "add_parser")]
    known = [option for action in sub.choices[command]._actions for option in action.option_strings]
    known = [option for option in known if option.startswith("--") and option not in ("--help", "--out")]
    values = st.one_of(texts, numbers.map(str), st.sampled_from(["S1002", "cone:1/20", "circle:0.3", "cone:", "x.csv"]))
    wrong = draw(st.dictionaries(st.sampled_from([*known, "--nothing"]), values, min_size=1, max_size=2))
    return [command, *(f"{key}={value}" for key, value in (valid | wrong).items())]


# ----------------------------------------------------------------------------------------------------- bytes and HDF5


def damaged(data, rng):
    """Bytes with some of them flipped, overwritten, cut off, doubled or swapped."""
    data, kind = bytearray(data), rng.choice(["flip", "flip", "flip", "write", "cut", "double", "swap"])
    at, other, length = rng.randrange(len(data)), rng.randrange(len(data)), rng.randint(1, 600)
    if kind == "flip":
        for _ in range(rng.randint(1, 3)):
            data[rng.randrange(len(data))] ^= 1 << rng.randrange(8)
    elif kind == "write":
        data[at : at + length] = rng.choice([bytes(length), rng.randbytes(length)])[: len(data) - at]
    elif kind == "cut":
        del data[at:]
    elif kind == "double":
        data[at:at] = data[other : other + length]
    else:
        data[at : at + length], data[other : other + length] = data[other : other + length], data[at : at + length]
    return bytes(data)


VALUES = [0, -1, 7, 2**62, np.nan, np.inf, 1e300, 0.5, "x", "", b"\xff", [], [[1.0], [2.0]], np.zeros(3, "S4"), 1j]
EDITS = ["gone", "external", "soft", "cycle", "virtual", "stored elsewhere", "fill", "moved"]


def edited(path, rng):
    """Make a file of what HDF5 can hold and nobody expects, with a digest as if it had been written so."""
    fifo = path.with_name("fifo")
    if not fifo.exists():
        os.mkfifo(fifo)
    with h5py.File(path, "a") as file, np.errstate(over="ignore"):
        names, groups = [], ["/"]
        file.visititems(lambda name, item: (names if isinstance(item, h5py.Dataset) else groups).append(name))
        for _ in range(rng.randint(1, 2)):
            name, kind = rng.choice(names), rng.choice(["value"] * 4 + ["number"] * 4 + ["attribute"] * 4 + EDITS)
            with contextlib.suppress(KeyError, TypeError, ValueError, OSError, AttributeError, OverflowError):
                _edit(file, name, rng.choice([*names, *groups]), kind, fifo, rng)
    sign(path)


def _edit(file, name, owner, kind, fifo, rng):
    dataset = file[name]
    if kind == "number":
        dataset[tuple(rng.randrange(n) for n in dataset.shape)] = rng.choice(VALUES[:8])
    elif kind == "attribute":
        attributes = file[owner].attrs
        attributes[rng.choice(list(attributes) or ["x"])] = rng.choice(VALUES)
    else:
        shape = dataset.shape
        del file[name]
        if kind == "value":
            file[name] = rng.choice([*VALUES, np.zeros(tuple(n + 1 for n in shape)), np.zeros(shape, ">i2")])
        elif kind == "external":
            file[name] = h5py.ExternalLink(fifo.name, "/x")
        elif kind == "soft":
            file[name] = h5py.SoftLink("/nowhere")
        elif kind == "cycle":
            file[name] = file["/"]
        elif kind == "virtual":
            layout = h5py.VirtualLayout(shape or (1,), float, (None,) * (len(shape) or 1))
            layout[...] = h5py.VirtualSource(fifo.name, "x", shape or (1,))
            file.create_virtual_dataset(name, layout)
        elif kind == "stored elsewhere":
            file.create_dataset(name, (10**6,), float, external=[(str(fifo), 0, h5py.h5f.UNLIMITED)])
        elif kind == "fill":
            file.create_dataset(name, (2**29, *shape[1:]), float, chunks=(2**20, *shape[1:]), fillvalue=1.0)
        elif kind == "moved":
            file[name + "x"] = 1.0

"""Strict reading of YAML files: each fault is reported in one line before a computation starts."""

import copy
import hashlib
import math
import os
import re
import sys
from collections.abc import Callable, Mapping
from functools import cache
from importlib.resources import files
from itertools import islice
from pathlib import Path

import yaml

from wrcore.errors import InputError, similar
from wrcore.errors.input_files import check_regular

MOST_BYTES, MOST_VALUES, DEEPEST = 4_000_000, 100_000, 50
"""Limits of a document: size (bytes), number of values, levels of nesting. Files written by hand are far smaller."""

_FORMATS = (
    "fqdn", "idna", "isoduration", "jsonpointer", "rfc3339_validator", "rfc3986_validator", "rfc3987", "rfc3987_syntax",
    "uri_template", "webcolors",
)  # fmt: skip
"""Optional modules for formats that no schema of wrcore uses. If they are installed, for example with JupyterLab,
jsonschema would import them, which takes up to 1 s."""

_TAG = "tag:yaml.org,2002:"
_LIBYAML = yaml.__with_libyaml__


@cache
def _validator():
    """Return the validator class of jsonschema, imported without the modules of `_FORMATS`."""
    hidden = [name for name in _FORMATS if name not in sys.modules]
    sys.modules.update(dict.fromkeys(hidden))  # type: ignore[arg-type]
    try:
        from jsonschema import Draft202012Validator
    finally:
        for name in hidden:
            del sys.modules[name]
    return Draft202012Validator


class _Loader(yaml.CSafeLoader if _LIBYAML else yaml.SafeLoader):
    """Safe loader that refuses repeated keys and reads only unambiguous decimal numbers as numbers.

    1e6, 1E-6 and 1.0E6 are numbers. The names of rails 60E1 and 54E1 are text, as are 020 (octal in YAML 1.1), 1:30
    (base 60), 1_000, 0x10 and dates.
    """

    yaml_implicit_resolvers = {
        first: [
            (tag, pattern) for tag, pattern in known if tag not in (f"{_TAG}int", f"{_TAG}float", f"{_TAG}timestamp")
        ]
        for first, known in yaml.SafeLoader.yaml_implicit_resolvers.items()
    }


_NUMBERS = {
    "int": r"[-+]?(?:0|[1-9][0-9]*)",
    "float": r"[-+]?(?:(?:[0-9]+\.[0-9]*|\.[0-9]+)(?:[eE][-+]?[0-9]+)?|[0-9]+(?:e[-+]?|E[-+])[0-9]+|\.inf)|\.nan",
}
for _name, _pattern in _NUMBERS.items():
    _Loader.add_implicit_resolver(_TAG + _name, re.compile(f"^(?:{_pattern})$"), list("-+0123456789."))


def _mapping(loader, node, deep=False):
    seen = set()
    for key, _ in node.value:
        if key.tag != f"{_TAG}merge":  # explicit keys override those of << *anchor
            name = loader.construct_object(key, deep=True)
            if name in seen:
                raise yaml.constructor.ConstructorError(None, None, f"the key {name!r} is given twice", node.start_mark)
            seen.add(name)
    return loader.construct_mapping(node, deep)


_Loader.add_constructor(yaml.resolver.BaseResolver.DEFAULT_MAPPING_TAG, _mapping)


def _load(text):
    """Return the document of a YAML text, after a check of nesting depth and number of values, aliases included.

    PyYAML itself limits neither the depth nor the size of aliases."""
    sizes, above, size = {}, [], 0  # number of values by anchor, and of each open collection
    for event in yaml.parse(text, Loader=yaml.CSafeLoader if _LIBYAML else yaml.SafeLoader):
        if isinstance(event, yaml.CollectionStartEvent):
            above.append((event.anchor, size))
            size = 1
        elif isinstance(event, yaml.CollectionEndEvent):
            anchor, before = above.pop()
            sizes[anchor] = size
            size += before
        elif isinstance(event, yaml.AliasEvent):
            size += sizes.get(event.anchor, 1 if event.anchor not in dict(above) else math.inf)
        elif isinstance(event, yaml.ScalarEvent):
            sizes[event.anchor] = 1
            size += 1
        if len(above) > DEEPEST or size > MOST_VALUES:
            raise yaml.constructor.ConstructorError(None, None, _LIMITS, event.start_mark)
    return yaml.load(text, Loader=_Loader)


_LIMITS = f"expected at most {MOST_VALUES} values, {DEEPEST} levels deep and none inside itself"


def read_yaml(path):
    """Read one YAML mapping.

    An InputError is raised for a missing file, text that is not UTF-8 or YAML, repeated keys, and other content than a
    mapping."""
    text = ""
    try:
        check_regular(path)
        with open(path, encoding="utf-8-sig") as file:
            text = file.read(MOST_BYTES + 1)
        if len(text) > MOST_BYTES:
            raise InputError(path, "", f"expected a file of at most {MOST_BYTES // 10**6} MB")
        data = _load(text)
    except InputError:
        raise
    except OSError as error:
        raise InputError(path, "", f"expected a readable file: {error.strerror}") from None
    except UnicodeDecodeError:
        raise InputError(path, "", "expected a UTF-8 text file") from None
    except Exception as error:  # PyYAML also raises other errors in its constructors
        mark = getattr(error, "problem_mark", None)
        where, problem = f"line {mark.line + 1}" if mark else "", getattr(error, "problem", None) or error
        if mark and "\t" in "".join(text.splitlines()[mark.line : mark.line + 1]):
            problem = f"{problem}; this line has a tab, where YAML is indented by blanks"
        raise InputError(path, where, f"expected YAML: {str(problem)[:500]}") from None  # it may quote the whole file
    if not isinstance(data, dict):
        raise InputError(path, "", f"expected a mapping of keys, got {type(data).__name__}")
    return data


def read_source(source, kind):
    """Return name for messages, folder of relative paths, and content of a YAML file or of a mapping."""
    if isinstance(source, Mapping):
        return kind, Path(), plain_tree(dict(source), kind)
    return str(source), Path(source).parent, read_yaml(source)


def parse_value(text):
    """Return the value of a text of the command line (``--set key=value``), read as YAML."""
    try:
        return _load(text)
    except Exception:  # as in read_yaml
        return text


def parse_ratio(value):
    """Return a number, or a ratio of two numbers such as '1/40', as float; NaN for any other value."""
    numerator, slash, denominator = str(value).partition("/")
    try:
        return float(numerator) / (float(denominator) if slash else 1.0)
    except (ValueError, ZeroDivisionError, OverflowError):
        return math.nan


@cache
def schema_of(name):
    """Return a schema of the package. It is parsed only once, because a sweep validates a scene for each run."""
    text = files("wrcore").joinpath("scene", "schemas", f"{name}.yaml").read_text(encoding="utf-8")
    return yaml.load(text, Loader=_Loader)  # reads 1.0e9 as a number


def validate(data, schema_name, source, above=""):
    """Check data against a schema of the package and return a copy with all defaults.

    Integers of the schema are converted to int. An InputError of one line names source, field and expectation.
    ``above`` is the field that holds the data.
    """
    schema = schema_of(schema_name)
    data = plain_tree(data, source)
    check(data, schema, source, above)
    _fill_defaults(data, schema, schema)
    return data


_SOUND: dict[tuple[int, bytes], dict] = {}

MOST_SOUND = 10_000
"""Largest number of data sets stored as valid in `_SOUND`."""


def check(data, schema, source, above=""):
    """Raise an InputError if data do not match a schema (a dict); ``above`` is the field that holds the data.

    Data that are known to be valid for this schema are not checked again."""
    known = id(schema), hashlib.sha256(repr(data).encode(errors="surrogatepass")).digest()
    if known in _SOUND:
        return
    found = islice(_validator()(schema).iter_errors(data), 1000)
    errors = sorted(found, key=lambda e: (len(e.path), str(e.path)))
    if errors:
        field, expected = _explain(errors[0], schema)
        raise InputError(source, ".".join(filter(None, [above, field])), expected)
    if len(_SOUND) >= MOST_SOUND:
        _SOUND.clear()
    _SOUND[known] = schema  # keeps the schema alive, so that its id stays unique


def plain_tree(data, source):
    """Return a copy of nested data with types of JSON only; paths and functions become text.

    An InputError is raised for keys that are not text, and for values that JSON cannot represent: dates, bytes, sets,
    infinite, NaN or too large numbers, and text that is not Unicode. It is also raised for data that contain themselves
    and for data with more than `MOST_VALUES` values.
    """
    left = MOST_VALUES

    def copied(value, path, above):
        nonlocal left
        left -= 1
        if isinstance(value, dict | list | tuple):
            if left < 0 or id(value) in above or len(above) > DEEPEST:
                raise InputError(source, ".".join(path[:3]), _LIMITS)
            above = {*above, id(value)}
        if isinstance(value, list | tuple):
            return [copied(item, (*path, str(k)), above) for k, item in enumerate(value)]
        if isinstance(value, dict):
            for key in value:
                if not isinstance(key, str):
                    raise InputError(source, ".".join(path), f"expected keys that are text, got {_short(key)}")
                copied(key, path, above)
            return {key: copied(item, (*path, key), above) for key, item in value.items()}
        if isinstance(value, os.PathLike):
            value = os.fspath(value)
        value = name_of_function(value) or value
        fault = _fault(value)
        if fault:
            raise InputError(source, ".".join(path), fault)
        return value

    return copied(data, (), frozenset())


GIVEN: dict[str, Callable] = {}
"""Functions that a Python program passed in data, by their `name_of_function`."""


def name_of_function(value):
    """Return ``module:function`` for a plain or compiled function and store it in `GIVEN`; else an empty text."""
    plain = getattr(value, "py_func", value)
    name = getattr(plain, "__qualname__", "") if callable(plain) and not isinstance(plain, type) else ""
    if not name.isidentifier():
        return ""
    GIVEN[f"{plain.__module__}:{name}"] = value
    return f"{plain.__module__}:{name}"


def _fault(value):
    """Return the fault of a single value; empty if the value is valid in JSON."""
    if isinstance(value, bool) or value is None:
        return ""
    if isinstance(value, int):
        return "" if abs(value) < 2**63 else "expected a number of at most 18 digits, got a longer one"
    if isinstance(value, float):
        return "" if math.isfinite(value) else f"expected a finite number, got {value}"
    if isinstance(value, str):
        bad = [c for c in value if c == "\0" or "\ud800" <= c <= "\udfff"]
        return f"expected text, got the character {bad[0]!a}" if bad else ""
    return f"expected text, a number, a list or a mapping, got {_short(value)}"


def _explain(error, schema):
    """Return field and expectation of a validation error, from the descriptions in the schema."""
    field = ".".join(str(part) for part in error.absolute_path)
    if error.validator == "additionalProperties":
        known = sorted(error.schema.get("properties", {}))
        unknown = min(str(key) for key in set(error.instance) - set(known))
        field = ".".join(filter(None, [field, unknown]))
        return field, f"unknown key; expected one of {', '.join(known)}{similar(unknown, known)}"
    if error.validator == "required":
        missing = [key for key in error.validator_value if key not in error.instance]
        field = ".".join(filter(None, [field, missing[0]]))
        text = error.schema["properties"].get(missing[0], {}).get("description", "a value")
        return field, f"expected {text}, but the key is missing"
    root, description = schema, schema.get("description", "a valid value")
    for part in error.absolute_schema_path:  # the innermost description on the path to the failed rule
        if part not in schema:  # jsonschema leaves out "$ref"
            schema = root["$defs"][schema["$ref"].rpartition("/")[2]]
            description = schema.get("description", description)
        schema = schema[part]
        if isinstance(schema, dict) and isinstance(schema.get("description"), str):
            description = schema["description"]
    hint = similar(error.instance, error.validator_value) if error.validator == "enum" else ""
    return field, f"expected {description}{_bound(error, description)}, got {_short(error.instance)}{hint}"


_BOUNDS = {
    "minimum": "at least", "maximum": "at most", "exclusiveMinimum": "above", "exclusiveMaximum": "below",
    "minItems": "of at least", "maxItems": "of at most",
}  # fmt: skip


def _bound(error, description):
    """Return the bound that a number or the length of a list violates, unless the description states this bound."""
    said = {float(number) for number in _NUMBER.findall(description)} | ({0.0} if "negative" in description else set())
    value = error.validator_value
    if error.validator not in _BOUNDS or {float(value), abs(float(value))} & said:
        return ""
    return f", {_BOUNDS[error.validator]} {value:g}"


_NUMBER = re.compile(r"\d+(?:\.\d+)?(?:e[+-]?\d+)?")


def _short(value):
    text = repr(value)
    return text if len(text) <= 80 else text[:77] + "..."


def _fill_defaults(data, schema, root):
    for key, part in schema.get("properties", {}).items():
        if key not in data and "default" in part:
            data[key] = copy.deepcopy(part["default"])
        if key in data:
            if part.get("type") == "integer":
                data[key] = int(data[key])  # 3.0 is an integer to JSON
            _fill_inside(data[key], part, root)
    if isinstance(schema.get("additionalProperties"), dict):
        for item in data.values():
            _fill_inside(item, schema["additionalProperties"], root)


def _fill_inside(value, part, root):
    if isinstance(value, dict) and "object" in part.get("type", ()):
        _fill_defaults(value, part, root)
    if isinstance(value, list) and isinstance(part.get("items"), dict):
        for item in value:
            if isinstance(item, dict):
                _fill_defaults(item, part["items"], root)

"""YAML as people write it, and documents that are made to kill a parser."""

import time

import pytest

from wrcore.errors import InputError
from wrcore.errors.checked_yaml import DEEPEST, MOST_VALUES, _Loader, check, parse_value, read_yaml

MERGES = "a0: &a0 {x: 1}\n" + "".join(f"a{i}: &a{i} {{<<: [{', '.join(6 * [f'*a{i - 1}'])}]}}\n" for i in range(1, 15))


@pytest.fixture
def read(tmp_path):
    def read(text):
        path = tmp_path / "file.yaml"
        path.write_bytes(text if isinstance(text, bytes) else text.encode())
        return read_yaml(path)

    return read


@pytest.fixture(scope="module")
def longest_that_is_read(tmp_path_factory):
    """Time in s that a file with nearly as many values as are allowed takes."""
    path = tmp_path_factory.mktemp("longest") / "file.yaml"
    path.write_text("a: [" + "1," * (MOST_VALUES - 10) + "]")
    began = time.process_time()
    read_yaml(path)
    return time.process_time() - began


@pytest.mark.parametrize("text", [
    "a: " + "[" * 100_000, "a: " + "{a: " * 50_000, "".join(" " * i + "a:\n" for i in range(DEEPEST + 2)), MERGES,
    "a: &a [*a]", "a: &a {<<: *a}", "a: &a [1, 1, 1, 1, 1, 1, 1, 1, 1]\n"
    + "".join(f"a{i}: &a{i} [{', '.join(9 * ['*a' + str(i - 1 or '')])}]\n" for i in range(1, 9)),
    "a: [" + "1," * 150_000 + "]", "a: " + "x" * 5_000_000,
], ids=["lists", "mappings", "blocks", "merges", "itself", "merges itself", "aliases", "values", "bytes"])  # fmt: skip
def test_what_no_person_wrote_is_refused_before_it_is_built(read, text, longest_that_is_read):
    began = time.process_time()
    with pytest.raises(InputError, match="expected .*at most"):
        read(text)
    assert time.process_time() - began < 3.0 * longest_that_is_read
    assert len(text) > 4_000_000 or parse_value(text) == text  # the command line has a limit of its own


def test_no_key_is_looked_for_among_all_before_it(read, monkeypatch):
    """100 000 keys took 5 s as each was compared with all before it; counted here, as times depend on the machine."""
    compared = 0

    class Key(str):
        __slots__ = ()
        __hash__ = str.__hash__

        def __eq__(self, other):
            nonlocal compared
            compared += 1
            return str.__eq__(self, other)

    monkeypatch.setitem(_Loader.yaml_constructors, "tag:yaml.org,2002:str", lambda _, node: Key(node.value))
    count = 4_000
    keys = list(read("".join(f"k{i}: 1\n" for i in range(count))))
    assert len(keys) == count and {type(key) for key in keys} == {Key}
    assert compared <= count
    with pytest.raises(InputError, match="given twice"):
        read("a: 1\na: 2\n")
    assert 0 < compared


@pytest.mark.parametrize(
    "text", ["020", "1:30", "1_000", "0x10", "0b1", "2001-02-03", "60E1", "1:30.5", "0o17", "1e5x"]
)
def test_what_only_a_machine_takes_for_a_number_stays_text(read, text):
    """YAML 1.1 reads 020 as 16 and 1:30 as 90."""
    assert read(f"a: {text}\nb: [{text}]\n") == {"a": text, "b": [text]}
    assert parse_value(text) == text


@pytest.mark.parametrize("text, value", [
    ("0", 0), ("-5", -5), ("+3", 3), ("1e-6", 1e-6), ("1E-6", 1e-6), ("1.5e3", 1500.0), ("1.", 1.0), (".5", 0.5),
    ("1.0E6", 1e6), ("true", True), ("~", None), (".inf", float("inf")), ("-0.25", -0.25), ("00.5", 0.5),
])  # fmt: skip
def test_numbers(read, text, value):
    found = read(f"a: {text}")["a"]
    assert found == value and type(found) is type(value)


@pytest.mark.parametrize("text", [
    b"a: 1\r\nb:\r\n  c: x\r\n", b"\xef\xbb\xbfa: 1\nb:\n  c: x\n", b"a: 1\rb:\r  c: x\r", b"a:\t1\nb:\n  c:\tx\n",
], ids=["CRLF", "BOM", "CR", "tabs between"])  # fmt: skip
def test_files_of_any_editor(read, text):
    assert read(text) == {"a": 1, "b": {"c": "x"}}


@pytest.mark.parametrize("text, says", [
    (b"a:\n\tb: 1\n", "line 2: .*has a tab"), ("a: 1\n".encode("utf-16"), "UTF-8"),
    ("a: 1\na: 2\n", "'a' is given twice"), ("a: *b", "undefined alias"), ("? [1]\n: 2", "expected YAML"),
])  # fmt: skip
def test_other_files_are_one_clear_line(read, text, says):
    with pytest.raises(InputError, match=says):
        read(text)


def test_a_merge_gives_way_to_what_is_written_beside_it(read):
    assert read("a: &a {x: 1, y: 2}\nb: {<<: *a, x: 3}\n")["b"] == {"x": 3, "y": 2}


def test_what_was_sound_once_is_looked_at_again_where_it_or_the_schema_changed():
    schema = {"properties": {"a": {"type": "integer", "maximum": 3, "description": "at most 3"}}}
    data = {"a": 3}
    for _ in range(2):
        check(data, schema, "here")
    data["a"] = 4
    for _ in range(2):
        with pytest.raises(InputError, match="here: a: expected at most 3"):
            check(data, schema, "here")
    narrower = {"properties": {"a": {"type": "integer", "maximum": 2, "description": "at most 2"}}}
    with pytest.raises(InputError, match="at most 2"):
        check({"a": 3}, narrower, "here")

"""Reader of MATLAB files of version 5 (MAT-File Format, The MathWorks): arrays of numbers, texts and structures.

scipy.io.loadmat crashes the process on some damaged files; this reader raises a ValueError for them. It skips cells,
objects, functions and sparse arrays, and executes nothing. Files of version 4 are read by scipy.
"""

import math
import struct
import zlib

import numpy as np

NUMBERS = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 9: "f8", 12: "i8", 13: "u8"}
"""NumPy types of the data types of elements, without the byte order."""

TEXTS = {16: "utf-8", 17: "utf-16", 18: "utf-32"}
"""Encodings of the data types of texts."""

MATRIX, COMPRESSED = 14, 15
"""Data types of arrays and of compressed elements."""

STRUCTURE, CHARACTERS, FIRST_NUMBER, LAST_NUMBER = 2, 4, 6, 15
"""Classes of arrays: structures, texts, and the first and the last class of numbers."""

COMPLEX = 0x0800
"""Flag of arrays with an imaginary part."""

HEADER = 128
"""Length of the header, bytes."""

LARGEST = 2**32
"""Largest number of bytes of a compressed element after decompression."""

DEEPEST = 8
"""Largest number of structures inside each other."""


def read_mat5(path):
    """Return arrays of numbers, texts (str) and structures (dict) of a file by name; ValueError for a damaged file."""
    with open(path, "rb") as file:
        data = file.read()
    order = {b"IM": "<", b"MI": ">"}.get(data[126:128])
    if len(data) < HEADER or order is None:
        raise ValueError("a header without a byte order")
    found, at = {}, HEADER
    while at + 8 <= len(data):
        kind, content, at = _element(data, at, order)
        if kind == COMPRESSED:
            kind, content, _ = _element(_decompressed(content), 0, order)
        if kind == MATRIX:
            name, value = _array(content, order, DEEPEST)
            if value is not None:
                found[name] = value
    return found


def _decompressed(content):
    try:
        data = zlib.decompressobj().decompress(content, LARGEST)
    except zlib.error as error:
        raise ValueError(f"damaged compressed data ({error})") from None
    return data


def _element(data, at, order):
    """Return data type and bytes of the element at an offset, and the offset of the next element."""
    if at + 8 > len(data):
        raise ValueError("an end within an element")
    kind, size = struct.unpack_from(f"{order}II", data, at)
    if kind >> 16:  # a small element: size and type share four bytes, four bytes of data follow
        kind, size, begin, end = kind & 0xFFFF, kind >> 16, at + 4, at + 8
        if size > 4:
            raise ValueError("a small element of more than four bytes")
    else:
        begin, end = at + 8, at + 8 + (size if kind == COMPRESSED else -(-size // 8) * 8)
    if begin + size > len(data):
        raise ValueError("an element longer than the file")
    return kind, data[begin : begin + size], end


def _array(content, order, depth):
    """Return name and value of an array; the value is None for arrays that are skipped."""
    if not content:
        return "", None
    kind, flags, at = _element(content, 0, order)
    if kind != 6 or len(flags) != 8:
        raise ValueError("an array without flags")
    flags = struct.unpack(f"{order}II", flags)[0]
    kind, shape, at = _element(content, at, order)
    shape = tuple(map(int, _numbers(kind, shape, order)))
    kind, name, at = _element(content, at, order)
    name = bytes(name).decode("latin-1")
    if not shape or min(shape) < 0 or len(shape) > 32:
        raise ValueError(f"an array of shape {shape}")
    array_class, count = flags & 0xFF, math.prod(shape)
    if array_class == STRUCTURE and count == 1 and depth:
        return name, _structure(content, at, order, depth - 1)
    if array_class == CHARACTERS:
        return name, _text(content, at, order)
    if not FIRST_NUMBER <= array_class <= LAST_NUMBER or flags & COMPLEX:
        return name, None
    kind, values, _ = _element(content, at, order)
    values = _numbers(kind, values, order)
    if values.size != count:
        raise ValueError(f"an array {name!r} with {values.size} values in place of {count}")
    return name, values.astype(values.dtype.newbyteorder("=")).reshape(shape, order="F")


def _numbers(kind, content, order):
    if kind not in NUMBERS:
        raise ValueError(f"an unknown data type {kind}")
    dtype = np.dtype(NUMBERS[kind]).newbyteorder(order)
    if len(content) % dtype.itemsize:
        raise ValueError("an end within a number")
    return np.frombuffer(content, dtype)


def _text(content, at, order):
    kind, data, _ = _element(content, at, order)
    if kind in TEXTS:
        little = "-le" if order == "<" else "-be"
        return bytes(data).decode(TEXTS[kind] + ("" if kind == 16 else little), "replace")
    return "".join(chr(code) for code in _numbers(kind, data, order) if 0 < code < 0xD800)


def _structure(content, at, order, depth):
    kind, width, at = _element(content, at, order)
    width = _numbers(kind, width, order)
    kind, names, at = _element(content, at, order)
    if width.size != 1 or not 0 < width[0] <= 256 or len(names) % int(width[0]):
        raise ValueError("a structure without names of fields")
    width, found = int(width[0]), {}
    for begin in range(0, len(names), width):
        kind, field, at = _element(content, at, order)
        if kind != MATRIX:
            raise ValueError("a structure whose field is no array")
        value = _array(field, order, depth)[1]
        if value is not None:
            found[bytes(names[begin : begin + width]).partition(b"\0")[0].decode("latin-1")] = value
    return found

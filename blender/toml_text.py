# SPDX-License-Identifier: GPL-3.0-or-later
"""Values as TOML text and back. Numbers keep all 64 bits: a value read again from its text is equal to the value."""

import functools
import re
import struct
import tomllib

_BARE_KEY = re.compile(r"[A-Za-z0-9_-]+")
# Control characters that TOML's strings have no short escape for.
_ESCAPES = {'"': '\\"', "\\": "\\\\", "\b": "\\b", "\t": "\\t", "\n": "\\n", "\f": "\\f", "\r": "\\r"}


def read(text, name):
    """The tables of a TOML text, as dicts and lists. `name` is that of the file, for the error.

    Raises ValueError, in one sentence with the line, if the text is not TOML."""
    try:
        return tomllib.loads(text.removeprefix("\ufeff"))
    except tomllib.TOMLDecodeError as error:
        raise ValueError(f"{name} is not TOML: {error}") from None


@functools.lru_cache(maxsize=4096)
def value_of(text):
    """The value of a TOML expression such as `[0.1, 2.0]`. Lists are shared between calls: do not change them."""
    return tomllib.loads(f"value = {text}")["value"]


def text_of(value):
    """The TOML expression of a bool, an int, a float, a str, or a list or dict of these, on one line.

    Raises TypeError for any other type."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, int):
        return str(value)
    if isinstance(value, float):
        return repr(value)
    if isinstance(value, str):
        return '"' + "".join(map(_escaped, value)) + '"'
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(map(text_of, value)) + "]"
    if isinstance(value, dict):
        pairs = (f"{_key_text(key)} = {text_of(item)}" for key, item in value.items())
        return "{ " + ", ".join(pairs) + " }" if value else "{}"
    raise TypeError(f"a value of the type {type(value).__name__} cannot be in a scene")


def assignment(name, value):
    """The line `name = value`. A list of tables takes a line for each of them."""
    if isinstance(value, list) and value and all(isinstance(item, dict) for item in value):
        return f"{_key_text(name)} = [\n" + "".join(f"    {text_of(item)},\n" for item in value) + "]\n"
    return f"{_key_text(name)} = {text_of(value)}\n"


def as_single(number):
    """A number rounded to 32 bits, as a float; infinite if it is too large for them."""
    try:
        return struct.unpack("<f", struct.pack("<f", number))[0]
    except OverflowError:
        return float("inf") if number > 0 else float("-inf")


def shortest(single):
    """The float with the fewest decimal digits that rounds to this 32-bit number: 0.1 for 0.10000000149."""
    for digits in range(1, 9):
        number = float(f"{single:.{digits}g}")
        if as_single(number) == single:
            return number
    return float(f"{single:.9g}")


def _escaped(character):
    if character in _ESCAPES:
        return _ESCAPES[character]
    return f"\\u{ord(character):04X}" if ord(character) < 0x20 or ord(character) == 0x7F else character


def _key_text(key):
    return key if _BARE_KEY.fullmatch(key) else text_of(key)

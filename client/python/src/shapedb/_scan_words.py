# SPDX-License-Identifier: Apache-2.0
"""Words and numbers of lines of text, as client/io/text.h has them."""

from __future__ import annotations

import re
from typing import List, Optional

from ._errors import InvalidInput

BLANKS = " \t\r\v\f"
_WORD = re.compile(r"[^ \t\r\v\f\n]+")
_REAL = re.compile(r"(?:\+(?!-))?(-?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eEdD][+-]?[0-9]+)?)")
_NO_NUMBER = re.compile(
    r"(?:\+(?!-))?-?(?:inf|infinity|nan(?:\(\w*\))?|(?:[0-9]+\.?[0-9]*|\.[0-9]+)#(?:inf|ind|.*nan).*)", re.IGNORECASE | re.ASCII)
_INTEGER = re.compile(r"(?:\+(?!-))?-?[0-9]{1,400}")
_COUNT = re.compile(r"\+?[0-9]{1,400}")
_LONGEST = 40
_INNER_COMMA = re.compile(r"[0-9],[0-9]")


def malformed(what: str) -> InvalidInput:
    return InvalidInput("malformed_file", what)


def not_finite(where: str, vertex: int) -> InvalidInput:
    return InvalidInput("non_finite_coordinate",
                        f"{where}: vertex {vertex} has a coordinate that is NaN or infinite; remove the vertex")


def words_of(line: str) -> List[str]:
    """`line` has one letter for each byte; only ASCII blanks part words."""
    return _WORD.findall(line)


def without_comment(line: str) -> str:
    """The line up to a '#', but for one within a number: "1.#QNAN" is what Windows writes for NaN."""
    sign = line.find("#")
    while sign > 0 and line[sign - 1] == ".":
        sign = line.find("#", sign + 1)
    return line if sign < 0 else line[:sign]


def real_of(word: str) -> Optional[float]:
    """The whole word as a decimal number; the exponent may be a Fortran one ("1D0"). NaN for "nan" and "inf" of all
    kinds, None for anything else."""
    match = _REAL.fullmatch(word)
    if match is None:
        return float("nan") if _NO_NUMBER.fullmatch(word) else None
    return float(match[1].replace("d", "e").replace("D", "e"))


def integer_of(word: str) -> Optional[int]:
    """None for what is no integer or does not fit into 64 bits."""
    value = int(word) if _INTEGER.fullmatch(word) else 1 << 63
    return value if -(1 << 63) <= value < 1 << 63 else None


def count_of(word: str) -> Optional[int]:
    value = int(word) if _COUNT.fullmatch(word) else 1 << 64
    return value if value < 1 << 64 else None


def printable(word: str) -> str:
    """For messages: shortened, without control characters."""
    text = "".join(letter if " " <= letter <= "~" else "?" for letter in word[:_LONGEST])
    return text + ("..." if len(word) > _LONGEST else "")


def in_quotes(word: str) -> str:
    """For messages: the printable word in quotes; "nothing" if empty."""
    return f"'{printable(word)}'" if word else "nothing"


def in_quotes_not_a_number(word: str) -> str:
    """in_quotes of what stands where a number should, and advice if it is one with a decimal comma."""
    comma = word.find(",")
    decimal = comma > 0 and _INNER_COMMA.fullmatch(word[comma - 1:comma + 2])
    return in_quotes(word) + (": decimals are written with a point, not with a comma" if decimal else "")


def count_text(count: int, singular: str, plural: str = "") -> str:
    """ "1 point", "3 points"; "1 vertex", "3 vertices"."""
    return f"{count} {singular if count == 1 else plural or singular + 's'}"

# SPDX-License-Identifier: Apache-2.0
"""Results in words, as the `shapedb` command puts them."""

from __future__ import annotations

import html
import math
import re
from typing import TYPE_CHECKING, List, Optional, Sequence

import numpy as np

if TYPE_CHECKING:
    from ._points import FloatArray
    from ._search_types import Fit, Hit, Why

_VERDICTS = {
    "same_object": "same object",
    "same_object_bent": "same object, bent",
    "part": "query is part of it",
    "same_kind": "same kind",
    "unrelated": "unrelated",
}
# What Unicode has shown as nothing (Default_Ignorable_Code_Point) and Python calls printable.
_IGNORED = re.compile("[\u034f\u115f\u1160\u17b4\u17b5\u180b-\u180f\u2065\u3164\ufe00-\ufe0f\uffa0\ufff0-\ufff8"
                      "\U000e0000-\U000e0fff]")
_LISTED_PAIRS = 3
_SHARE_WORTH_LISTING = 0.01
_ELSEWHERE = 0.1  # centres further apart, in units of the common size, do not lie on each other


def likeness(verdict: Optional[str], mirrored: Optional[bool]) -> str:
    """What two shapes are to each other: a verdict in words, and whether one is the mirror image of the other."""
    words = [] if verdict is None else [_VERDICTS.get(verdict, verdict)]
    if mirrored and verdict not in ("same_kind", "unrelated"):  # of different objects neither is the other's image
        words.append("mirrored")
    return ", ".join(words)


def safe(text: str) -> str:
    """Text of strangers without what a terminal would obey."""
    return _IGNORED.sub("?", "".join(c if c.isprintable() else "?" for c in text))


def percent(share: float) -> str:
    """0.1234 -> "12 %"."""
    value = 100.0 * share
    if value == 0.0:
        return "0 %"
    return (f"{value:.2g}" if abs(value) < 9.95 else f"{value:.0f}") + " %"


def joined(words: Sequence[str]) -> str:
    """"a", "a and b", "a, b and c"."""
    return " and ".join([", ".join(words[:-1]), words[-1]] if len(words) > 1 else words)


def why(explanation: "Why") -> str:
    """An explanation."""
    name = safe(explanation.name)
    lines: List[str] = []
    if explanation.verdict is not None:
        right = percent(explanation.reliability)
        lines.append(f"{name}: {explanation.words} (such verdicts are right in {right} of cases)")
    if explanation.matches:
        matched = {match.query for match in explanation.matches}
        volume = sum(_at(explanation.query_shares, index) for index in matched)
        parts = len(explanation.query_shares)
        lines.append(f"{len(matched)} of {parts} {'part' if parts == 1 else 'parts'} of the query match "
                     f"({percent(volume)} of its volume)")
        lines += _pairs(explanation)
        lines.append(_motion(explanation, name))
        lines += _unmatched(explanation, name)
    else:
        lines.append(f"no part of the query matches a part of {name}")
    if explanation.terms:
        terms = ", ".join(f"{term.name} {term.distance:.2f}" for term in explanation.terms)
        lines.append(f"Differences (0 = identical, 1 = typical of unrelated shapes): {terms}.")
    if explanation.fit is not None:
        lines.append(fit(explanation.fit, "the query", name))
    return "\n".join(lines)


def _at(shares: Sequence[float], index: int) -> float:
    return shares[index] if index < len(shares) else 0.0


def _pairs(explanation: "Why") -> List[str]:
    lines: List[str] = []
    for match in explanation.matches[:_LISTED_PAIRS]:
        if lines and match.share < _SHARE_WORTH_LISTING:
            break
        elsewhere = "similar but elsewhere: " if match.distance > _ELSEWHERE else ""
        lines.append(f"  part {match.query + 1} <-> part {match.hit + 1}: {percent(match.share)} of the match, "
                     f"{elsewhere}centres {percent(match.distance)} apart")
    more = len(explanation.matches) - len(lines)
    if more > 0:
        slight = explanation.matches[len(lines)].share < _SHARE_WORTH_LISTING
        lines.append(f"  and {more} more" + (" below 1 %" if slight else ""))
    return lines


def _motion(explanation: "Why", name: str) -> str:
    if explanation.degenerate:
        return "One of the two is a single part, so any rotation fits."
    steps = ["mirrored"] if explanation.reflected else []
    degrees = rotation_degrees(explanation.motion)
    if f"{degrees:.0f}" != "0":
        steps.append(f"turned by {degrees:.0f} degrees")
    if abs(explanation.scale - 1.0) >= 5e-4:
        steps.append(f"scaled by {explanation.scale:.4g}")
    return f"To match, {name} is {joined(steps)}." if steps else f"{name} is in the same pose."


def _unmatched(explanation: "Why", name: str) -> List[str]:
    def parts(indices: Sequence[int]) -> str:
        return ("part " if len(indices) == 1 else "parts ") + joined([str(index + 1) for index in indices])

    sides = []
    if explanation.unmatched_query:
        volume = sum(_at(explanation.query_shares, index) for index in explanation.unmatched_query)
        sides.append(f"{parts(explanation.unmatched_query)} of the query ({percent(volume)} of its volume)")
    if explanation.unmatched_hit:
        sides.append(f"{parts(explanation.unmatched_hit)} of {name}")
    return [f"Unmatched: {joined(sides)}."] if sides else []


def rotation_degrees(motion: "FloatArray") -> float:
    """By how much a motion turns, without its mirroring."""
    linear = motion[:3, :3]
    determinant = float(np.linalg.det(linear))
    rotation = linear / abs(determinant)**(1.0 / 3.0)
    trace = float(np.trace(rotation))
    cosine = (trace - 1.0) / 2.0 if determinant > 0.0 else (trace + 1.0) / 2.0
    return math.degrees(math.acos(min(1.0, max(-1.0, cosine))))


def fit(found: "Fit", query: str, other: str) -> str:
    """How one shape lies on the other."""
    best = found.best
    text = (f"{percent(best.explained_query)} of {query} lies on {other}, {percent(best.explained_other)} of what "
            f"{query} should show of it is there")
    if found.kind == "one_sided":
        text += f"; {query} is taken for a scan from one side"
    if found.kind == "piece":
        text += f"; {query} is taken for a piece"
    text += f".\nWhere they meet, they are {percent(best.residual)} of the size of {query} apart."
    if found.left_right_open:
        text += "\nThe points do not tell left from right."
    if len(found.axes) == 1:
        text += "\nAny turn about one axis fits as well."
    elif found.axes:
        text += "\nIt may be turned any way."
    others = len(found.alternatives)
    if others:
        text += f"\n{others} other {'pose fits' if others == 1 else 'poses fit'} as well."
    return text


_COLUMNS = ("rank", "score", "verdict", "label", "key")


def _rows(hits: Sequence["Hit"]) -> List[List[str]]:
    return [[str(rank), f"{hit.score:.3f}", likeness(hit.verdict, hit.mirrored), hit.label or "", hit.key]
            for rank, hit in enumerate(hits, 1)]


def table(hits: Sequence["Hit"]) -> str:
    """Hits as a table of text."""
    if not hits:
        return "no hits"
    rows = [list(_COLUMNS)] + [[safe(cell) for cell in row] for row in _rows(hits)]
    widths = [max(len(row[column]) for row in rows) for column in range(len(_COLUMNS))]
    return "\n".join("  ".join(cell.rjust(width) if column == 0 else cell.ljust(width)
                               for column, (cell, width) in enumerate(zip(row, widths))).rstrip() for row in rows)


def html_table(hits: Sequence["Hit"]) -> str:
    """Hits as a table for a notebook."""
    def line(cells: Sequence[str], tag: str) -> str:
        return "<tr>" + "".join(f"<{tag}>{html.escape(cell)}</{tag}>" for cell in cells) + "</tr>"

    return "<table>" + line(_COLUMNS, "th") + "".join(line(row, "td") for row in _rows(hits)) + "</table>"

# SPDX-License-Identifier: Apache-2.0
"""Results in words."""

import dataclasses

import numpy as np
import pytest
import shapedb
from shapedb import _text

import solids


def pose(motion=np.eye(4), **changes):
    values = {"motion": motion, "scale": 1.0, "reflected": False, "score": 0.9, "explained_query": 0.87,
              "explained_other": 0.5, "residual": 0.0068, **changes}
    return shapedb.Pose(**values)


def fit(**changes):
    values = {"best": pose(), "kind": "whole", "misfit": 0.1, "certainty": 1.0, "left_right_open": False,
              "alternatives": (), "axes": (), **changes}
    return shapedb.Fit(**values)


def why(**changes):
    matches = (shapedb.SegmentMatch(0, 0, 0.72, 0.003), shapedb.SegmentMatch(1, 1, 0.2, 0.4),
               shapedb.SegmentMatch(2, 3, 0.005, 0.0))
    values = {"name": "cup", "verdict": "same_kind", "reliability": 0.83, "similarity": 1.0, "dissimilarity": 0.2,
              "terms": (shapedb.Term("chords", 0.171, 1.0),), "matches": matches, "unmatched_query": (3,),
              "unmatched_hit": (2, 4), "degenerate": False, "query_shares": (0.6, 0.3, 0.08, 0.02),
              "motion": np.eye(4), "scale": 1.0, "reflected": False, "fit": None, **changes}
    return str(shapedb.Why(**values))


def test_why():
    assert why().splitlines() == [
        "cup: same kind (such verdicts are right in 83 % of cases)",
        "3 of 4 parts of the query match (98 % of its volume)",
        "  part 1 <-> part 1: 72 % of the match, centres 0.3 % apart",
        "  part 2 <-> part 2: 20 % of the match, similar but elsewhere: centres 40 % apart",
        "  and 1 more below 1 %",
        "cup is in the same pose.",
        "Unmatched: part 4 of the query (2 % of its volume) and parts 3 and 5 of cup.",
        "Differences (0 = identical, 1 = typical of unrelated shapes): chords 0.17.",
    ]
    assert why(matches=(), verdict=None, terms=()) == "no part of the query matches a part of cup"
    assert "any rotation fits" in why(degenerate=True)
    assert "cup\x1b" not in why(name="cup\x1b[2J") and "cup?[2J" in why(name="cup\x1b[2J")
    turn = np.eye(4)
    turn[:3, :3] = 2.0 * np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1]])
    assert "To match, cup is turned by 90 degrees and scaled by 2." in why(motion=turn, scale=2.0)
    turn[:3, :3] = np.diag([1, 1, -1])
    assert "To match, cup is mirrored." in why(motion=turn, reflected=True)
    turn[:3, :3] = solids.rotation(1) @ np.diag([-1, 1, 1])
    assert "mirrored, turned by" in why(motion=turn, reflected=True).replace(" and ", ", ")


def test_mirrored_twins_are_told_unless_left_and_right_look_alike():
    twin = fit(best=pose(reflected=True))
    assert twin.mirrored and not fit().mirrored and not fit(best=pose(reflected=True), left_right_open=True).mirrored
    assert why(verdict="same_object", fit=twin).startswith("cup: same object, mirrored (such")
    assert why(verdict="unrelated", fit=twin).startswith("cup: unrelated (such")
    assert why(verdict="same_kind", fit=twin).startswith("cup: same kind (such")
    assert _text.likeness(None, True) == "mirrored" and _text.likeness(None, None) == ""


def test_a_fit():
    assert str(fit()).splitlines() == [
        "87 % of the query lies on the other, 50 % of what the query should show of it is there.",
        "Where they meet, they are 0.68 % of the size of the query apart."]
    axis = shapedb.FreeAxis(np.zeros(3), np.eye(3)[0])
    text = str(fit(kind="piece", left_right_open=True, axes=(axis,), alternatives=(pose(), pose())))
    for words in ("taken for a piece", "left from right", "Any turn about one axis", "2 other poses fit as well"):
        assert words in text
    assert "turned any way" in str(fit(axes=(axis,) * 3)) and "one side" in str(fit(kind="one_sided"))


@pytest.mark.parametrize("share, text", [(0, "0 %"), (1, "100 %"), (0.1234, "12 %"), (0.0123, "1.2 %")])
def test_percent(share, text):
    assert _text.percent(share) == text


@pytest.mark.parametrize("degrees", [0, 1, 90, 179])
@pytest.mark.parametrize("scale", [0.01, 1, 50])
def test_rotations_are_measured_at_any_scale(degrees, scale):
    angle = np.radians(degrees)
    about_z = np.array([[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]])
    base = solids.rotation(4)
    motion = np.eye(4)
    motion[:3, :3] = scale * base @ about_z @ base.T
    assert abs(_text.rotation_degrees(motion) - degrees) < 1e-4
    motion[:3, :3] = scale * base @ about_z @ np.diag([1, 1, -1]) @ base.T
    assert abs(_text.rotation_degrees(motion) - degrees) < 1e-4


def test_a_table_of_hits_hides_what_terminals_obey():
    shape = shapedb.Shape("c", "a\x1bkey", 1, 1, "ready", 4, b"", {"label": "<b>"}, None, None)
    hit = shapedb.Hit("a\x1bkey", 0.5, "same_object_bent", 0.7, shape, 0.5, None, None, None)
    assert _text.table([hit]).splitlines()[1] == "   1  0.500  same object, bent  <b>    a?key"
    assert "&lt;b&gt;" in _text.html_table([hit]) and hit.label == "<b>"
    assert dataclasses.replace(hit, key="b").key == "b"


def test_text_of_strangers_shows_what_would_hide():
    for hidden in "\x1b\x9b\u200b\u200c\u034f\u115f\u3164\ufe0f\U000e0001\U000e0041":
        assert _text.safe(f"a{hidden}b") == "a?b"
    assert _text.safe("Schränke 山/川 שלום") == "Schränke 山/川 שלום"

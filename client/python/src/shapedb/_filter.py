# SPDX-License-Identifier: Apache-2.0
"""Filters (docs/filters.md) with values of strangers in them."""

from __future__ import annotations


def quote(value: str) -> str:
    """A value as a filter takes it, whatever its characters: `filter=f"label={shapedb.quote(label)}"`."""
    return '"' + value.replace("\\", "\\\\").replace('"', '\\"') + '"'

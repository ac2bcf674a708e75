#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Draws the figures of docs/concepts.md again, of the Stanford bunny in SHAPEDB_DATA (docs/data.md).

  SHAPEDB_DATA=... scripts/figures.py [FOLDER]    docs/images/ by default

What is drawn is what the server answers: segments, signature, quality, motion. Only projection and colours are made here. Needs
the Python package and the server of BUILD_DIR [build], and matplotlib.
"""

import io
import os
import sys

ROOT = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
BUILD = os.path.join(ROOT, os.environ.get("BUILD_DIR", "build"))
sys.path.insert(0, os.path.join(BUILD, "python", "src"))
os.environ.setdefault("SHAPEDBD", os.path.join(BUILD, "bin", "shapedbd"))

import matplotlib  # noqa: E402
matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402
import numpy as np  # noqa: E402
import shapedb  # noqa: E402
from PIL import Image  # noqa: E402

PARTS = ["#c8433a", "#3f7fbf", "#4d9c52", "#e0a11b", "#8a5fb0", "#2fa3a0", "#b05a86", "#7a7a35"]
GREY, ORANGE = "#9aa0a6", "#d9702b"


def turn(degrees_about_y, degrees_about_x):
    a, b = np.radians([degrees_about_y, degrees_about_x])
    about_y = np.array([[np.cos(a), 0, np.sin(a)], [0, 1, 0], [-np.sin(a), 0, np.cos(a)]])
    about_x = np.array([[1, 0, 0], [0, np.cos(b), -np.sin(b)], [0, np.sin(b), np.cos(b)]])
    return about_x @ about_y


FRONT = turn(25, 12)


def some(points, count, *others):
    chosen = np.random.default_rng(1).permutation(len(points))[:count]
    return [points[chosen]] + [other[chosen] for other in others]


def shaded(colours, depth):
    """Darker behind."""
    rgb = np.array([matplotlib.colors.to_rgb(colour) for colour in colours]) if not isinstance(colours, str) else \
        np.tile(matplotlib.colors.to_rgb(colours), (len(depth), 1))
    near = (depth - depth.min()) / max(np.ptp(depth), 1e-12)
    return np.clip(rgb * (0.62 + 0.38 * near)[:, None], 0, 1)


def draw(axes, points, colours, view=FRONT, size=1.6, title="", alpha=1.0):
    seen = points @ view.T
    order = np.argsort(seen[:, 2])
    axes.scatter(seen[order, 0], seen[order, 1], s=size, linewidths=0, alpha=alpha, c=shaded(colours, seen[:, 2])[order])
    axes.set_aspect("equal")
    axes.axis("off")
    axes.set_title(title, fontsize=11)


def figure(width, height, columns):
    picture, axes = plt.subplots(1, columns, figsize=(width, height), facecolor="white")
    return picture, axes


def save(picture, folder, name):
    path = os.path.join(folder, name)
    picture.tight_layout()
    memory = io.BytesIO()
    picture.savefig(memory, dpi=100, bbox_inches="tight", pad_inches=0.1)
    plt.close(picture)
    small = Image.open(memory).convert("RGB").quantize(240, Image.Quantize.MAXCOVERAGE, dither=Image.Dither.NONE)
    small.save(path, optimize=True)
    print(f"{path}: {os.path.getsize(path) // 1024} KiB, {small.width} x {small.height}")


def by_part(segments):
    return [PARTS[part % len(PARTS)] if part >= 0 else GREY for part in segments]


def parts(client, scan, folder):
    result = client.segment(scan)
    picture, axes = figure(10, 3.6, 3)
    points, segments = some(result.points, 14000, result.segments)
    draw(axes[0], points, "#7f8fa0", title="the scan: points, nothing else")
    draw(axes[1], points, by_part(segments), title=f"its {result.report.segments} segments")
    draw(axes[2], points, "#c9cdd2", size=0.5, alpha=0.5, title="its signature: weighted points")
    for number, point in enumerate(result.signature.points):
        at = FRONT @ np.asarray(point.position)
        axes[2].scatter(at[0], at[1], s=9000 * (point.weight / result.report.volume) ** (2 / 3), zorder=3,
                        color=PARTS[number % len(PARTS)], alpha=0.75, edgecolors="white", linewidths=0.8)
    save(picture, folder, "concept-parts.png")


def interior(client, whole, one_side, folder):
    picture, axes = figure(10, 3.6, 3)
    good, poor = client.segment(whole), client.segment(one_side)
    points, segments = some(good.points, 12000, good.segments)
    draw(axes[0], points, by_part(segments), title=f"ten scans together: quality {good.report.quality:.2f}")
    points, segments = some(poor.points, 12000, poor.segments)
    draw(axes[1], points, by_part(segments), title=f"one of them: quality {poor.report.quality:.2f}")
    draw(axes[2], points, by_part(segments), view=turn(115, 12), title="the same from its side: the back is missing")
    save(picture, folder, "concept-interior.png")


def hit(client, stored, query, folder):
    pose = np.eye(4)
    pose[:3] = np.hstack([0.7 * turn(140, 30), [[0.09], [0.02], [0.0]]])
    stored = shapedb.transform(stored, pose)  # turned, moved and smaller, as if scanned elsewhere in another unit
    shapes = client.create_collection("figures")
    shapes.add("bunny", stored, wait=True)
    found = shapes.search(query, k=1)[0]
    picture, axes = figure(10, 3.6, 2)
    scan, other = some(query, 9000)[0], some(stored, 9000)[0]
    colours = [GREY] * len(other) + [ORANGE] * len(scan)
    draw(axes[0], np.concatenate([other, scan]), colours, title="a scan (orange) and a stored shape (grey) as they come")
    draw(axes[1], np.concatenate([shapedb.transform(other, found.motion), scan]), colours,
         title=f"laid on each other: {found.verdict.replace('_', ' ')}, score {found.score:.3f}")
    save(picture, folder, "concept-hit.png")


def views(stored, folder):
    picture, axes = figure(10, 2.8, 4)
    points, = some(stored, 14000)
    for axis, (about_y, about_x) in zip(axes, [(0, 0), (90, 0), (180, 30), (270, -30)]):
        view = turn(about_y, about_x)
        seen = points @ view.T
        # A depth buffer: of the points in one cell only the nearest is seen.
        cells = np.floor((seen[:, :2] - seen[:, :2].min(axis=0)) / 0.0028).astype(int)
        nearest = {}
        for index in np.argsort(seen[:, 2]):
            nearest[tuple(cells[index])] = index
        kept = [index for index, cell in enumerate(map(tuple, cells)) if seen[index, 2] > seen[nearest[cell], 2] - 0.006]
        draw(axis, points[kept], "#6d8fb3", view=view, size=2.2)
    save(picture, folder, "concept-views.png")


def main():
    folder = sys.argv[1] if len(sys.argv) > 1 else os.path.join(ROOT, "docs", "images")
    data = os.environ.get("SHAPEDB_DATA")
    if not data:
        sys.exit("figures: SHAPEDB_DATA is not set (docs/data.md)")
    read = {name: shapedb.read_scan(os.path.join(data, "scans", name + ".ply"))
            for name in ("bunny-ten-range-scans", "bunny-range-scan-000", "bunny-zippered")}
    with shapedb.local() as client:
        parts(client, read["bunny-ten-range-scans"], folder)
        interior(client, read["bunny-ten-range-scans"], read["bunny-range-scan-000"], folder)
        hit(client, read["bunny-zippered"], read["bunny-range-scan-000"], folder)
    views(read["bunny-zippered"], folder)


if __name__ == "__main__":
    main()

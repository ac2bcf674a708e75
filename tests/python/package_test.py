# SPDX-License-Identifier: Apache-2.0
"""Wheel and source distribution: built without network, installed into an empty folder, used from there."""

import os
import subprocess
import sys
import tarfile
import zipfile
from pathlib import Path

import pytest

PACKAGE = Path(os.environ["PYTHON_PACKAGE"])
START = """
import numpy as np, shapedb, sys
assert shapedb.__file__.startswith(sys.argv[1]), shapedb.__file__
points = np.random.default_rng(1).normal(size=(200, 3))
with shapedb.local() as client:
    client.collection().add("cloud", points)
    print(shapedb.__version__, client.collection().get("cloud").point_count)
"""


def run(*command, **options):
    done = subprocess.run([sys.executable, *map(str, command)], capture_output=True, text=True, **options)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def built(tmp_path_factory):
    """As the target shapedb_python_wheel does: the wheel is made of the source distribution."""
    folder = tmp_path_factory.mktemp("dist")
    run("-m", "build", "--no-isolation", "--outdir", folder, PACKAGE)
    wheel, = folder.glob("*.whl")
    source, = folder.glob("*.tar.gz")
    return wheel, source


def test_what_is_in_them(built):
    wheel, source = built
    assert wheel.name.endswith("-py3-none-any.whl")
    names = zipfile.ZipFile(wheel).namelist()
    for name in ("shapedb/__init__.py", "shapedb/py.typed", "shapedb/_client.py", "shapedb/v1/shape_service_pb2.py",
                 "shapedb/v1/shape_service_pb2.pyi", "shapedb/v1/shape_service_pb2_grpc.py"):
        assert name in names
    assert not [name for name in names if not name.startswith(("shapedb/", "shapedb-"))]
    assert [name for name in tarfile.open(source).getnames() if name.endswith("src/shapedb/v1/types_pb2.py")]


def test_a_new_user_installs_the_wheel(built, tmp_path):
    run("-m", "pip", "install", "--quiet", "--no-index", "--no-build-isolation", "--no-deps", "--target",
        tmp_path / "site", built[0], cwd=tmp_path)
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
    environment["PYTHONPATH"] = str(tmp_path / "site")
    printed = run("-c", START, tmp_path / "site", cwd=tmp_path, env=environment)
    version = built[0].name.split("-")[1]
    assert printed.split() == [version, "200"]

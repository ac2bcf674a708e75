# SPDX-License-Identifier: Apache-2.0
"""A server for the tests of one file, and collections of their own in it."""

import itertools
import os
import tempfile

# Servers are started while channels are open, and grpcio would wait for these before each fork.
os.environ["GRPC_ENABLE_FORK_SUPPORT"] = "0"
# What it caches belongs to no source tree.
os.environ.setdefault("HYPOTHESIS_STORAGE_DIRECTORY", os.path.join(tempfile.gettempdir(), "shapedb-hypothesis"))
for variable in list(os.environ):
    if variable.startswith("SHAPEDB_"):
        del os.environ[variable]

import hypothesis  # noqa: E402
import pytest  # noqa: E402
import shapedb  # noqa: E402

hypothesis.settings.register_profile("ci", max_examples=60, derandomize=True, deadline=None, database=None)
hypothesis.settings.load_profile("ci")

# Views take most of the time of a small scan, and concern only scans of one side.
QUICK = shapedb.Parameters(views=False)

_names = (f"test-{number}" for number in itertools.count(1))


@pytest.fixture(scope="module")
def client():
    with shapedb.local() as connected:
        yield connected


@pytest.fixture
def collection(client):
    return client.create_collection(next(_names), parameters=QUICK)

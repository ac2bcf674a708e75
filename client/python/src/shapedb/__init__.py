# SPDX-License-Identifier: Apache-2.0
"""Finds 3D objects that look like your scan: the Python client of ShapeDB.

    import shapedb

    with shapedb.local() as client:                  # or shapedb.Client("shapes.example:7878", ...)
        parts = client.create_collection("parts")
        parts.add("bolt", points, metadata={"label": "bolt"}, wait=True)
        for hit in parts.search(scan, k=5):
            print(hit.key, hit.score, hit.motion, hit.why)

`Client` blocks and may be used by any number of threads; `AsyncClient` has the same calls for asyncio. docs/python.md
walks through both.
"""

from ._admin_types import (BackupReport, CreatedKey, Health, Imported, Key, KeyLimits, Limit, Limits, RebuildProgress,
                           Restored, Role, ServerInfo, Stats)
from ._async_client import AsyncClient
from ._async_collection import AsyncCollection
from ._bulk import BulkResult, Item, scan_folder
from ._client import Client
from ._collection import Collection
from ._errors import REASONS, InvalidInput, ShapeDBError
from ._files import read_scan
from ._filter import quote
from ._frame import shapes_frame
from ._local import LocalClient, LocalServer, local
from ._points import Scan, as_points
from ._retry import RetryPolicy
from ._search_types import (Comparison, Fit, FitKind, FreeAxis, Group, Hit, Pose, SearchResult, SegmentMatch, Term,
                            Verdict, Why)
from ._show import show, transform
from ._types import (Added, AddMode, CollectionInfo, Deleted, Found, IngestEvent, InteriorDoubt, InteriorMethod,
                     InteriorSource, Metadata, MetadataUpdate, Order, Outcome, Page, Parameters, Preview, Profile, Progress,
                     ProgressListener, Retried, Segmentation, SegmentationReport, Shape, ShapeFailure, Signature,
                     State, Statistic, Unit, ValueCounts, WeightedPoint)
from ._version import __version__

__all__ = [
    "AddMode", "Added", "AsyncClient", "AsyncCollection", "BackupReport", "BulkResult", "Client", "Collection",
    "CollectionInfo", "Comparison", "CreatedKey", "Deleted", "Fit", "FitKind", "Found", "FreeAxis", "Group", "Health",
    "Hit", "Imported", "IngestEvent", "InteriorDoubt", "InteriorMethod", "InteriorSource", "InvalidInput", "Item",
    "Key", "KeyLimits", "Limit", "Limits", "LocalClient", "LocalServer", "Metadata", "MetadataUpdate", "Order",
    "Outcome", "Page", "Parameters", "Pose", "Preview", "Profile", "Progress", "ProgressListener", "REASONS", "RebuildProgress",
    "Restored", "Retried", "RetryPolicy", "Role", "Scan", "SearchResult", "SegmentMatch", "Segmentation",
    "SegmentationReport", "ServerInfo", "Shape", "ShapeDBError", "ShapeFailure", "Signature", "State", "Statistic",
    "Stats", "Term", "Unit", "ValueCounts", "Verdict", "WeightedPoint", "Why", "__version__", "as_points", "local",
    "quote", "read_scan", "scan_folder", "shapes_frame", "show", "transform",
]

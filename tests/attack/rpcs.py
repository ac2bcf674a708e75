# SPDX-License-Identifier: GPL-3.0-or-later
"""Every rpc: who may make it, written down apart from the server's own table, and how to make it by its description."""

from attacker import admin, align, collections, grpc, search, shapes

READER, WRITER, ADMIN = admin.ROLE_READER, admin.ROLE_WRITER, admin.ROLE_ADMIN

# Every rpc: the role it needs, and what it touches. Written down here apart from the server's own table.
COLLECTION, NOTHING, WHOLE_SERVER = "the collection it names", "nothing stored", "the whole server"
RULES = {
    "ShapeService": {
        "AddShape": (WRITER, COLLECTION), "GetShape": (READER, COLLECTION), "ListShapes": (READER, COLLECTION),
        "CountShapes": (READER, COLLECTION), "DeleteShape": (WRITER, COLLECTION),
        "WatchIngest": (READER, COLLECTION), "GetSignature": (READER, COLLECTION),
        "GetSegments": (READER, COLLECTION), "Segment": (READER, NOTHING),
        "GetShapes": (READER, COLLECTION), "GetPoints": (READER, COLLECTION), "GetPreviews": (READER, COLLECTION),
        "CountByValue": (READER, COLLECTION),
        "DeleteShapes": (WRITER, COLLECTION), "UpdateMetadata": (WRITER, COLLECTION),
        "RetryShapes": (WRITER, COLLECTION),
    },
    "SearchService": {
        "SearchByKey": (READER, COLLECTION), "SearchByScan": (READER, COLLECTION),
        "SearchByScanInStages": (READER, COLLECTION),
        "SearchBySignature": (READER, COLLECTION), "SearchBatch": (READER, COLLECTION),
        "Compare": (READER, COLLECTION),
    },
    "AlignService": {"Align": (READER, COLLECTION)},
    "CollectionService": {
        "CreateCollection": (ADMIN, COLLECTION), "GetCollection": (READER, COLLECTION),
        "ListCollections": (READER, NOTHING), "DeleteCollection": (ADMIN, COLLECTION),
        "RenameCollection": (ADMIN, COLLECTION), "SetAlias": (ADMIN, COLLECTION), "DeleteAlias": (ADMIN, COLLECTION),
    },
    "AdminService": {
        "Rebuild": (ADMIN, COLLECTION), "CancelRebuild": (ADMIN, COLLECTION), "Backup": (ADMIN, WHOLE_SERVER),
        "Restore": (ADMIN, WHOLE_SERVER), "Check": (ADMIN, WHOLE_SERVER), "Stats": (ADMIN, WHOLE_SERVER),
        "ServerInfo": (READER, NOTHING), "CreateKey": (ADMIN, WHOLE_SERVER), "ListKeys": (ADMIN, WHOLE_SERVER),
        "RevokeKey": (ADMIN, WHOLE_SERVER), "ExportCollection": (ADMIN, COLLECTION),
        "ImportCollection": (ADMIN, COLLECTION),
    },
}


def messages(rpc, collection):
    """What is sent to an rpc so that it concerns a collection; harmless where it is allowed."""
    ref = shapes.ShapeRef(collection=collection, key="nobody")
    by_scan = search.SearchByScanRequest(header=search.SearchByScanHeader(
        options=search.SearchOptions(collection=collection, k=1), point_count=4))
    special = {
        "AddShape": [shapes.AddShapeRequest(header=shapes.AddShapeHeader(
            collection=collection, key="k", point_count=3))],
        "SearchByKey": [search.SearchByKeyRequest(options=search.SearchOptions(collection=collection, k=1), key="k")],
        "SearchByScan": [by_scan],
        "SearchByScanInStages": [by_scan],
        "SearchBySignature": [search.SearchBySignatureRequest(
            options=search.SearchOptions(collection=collection, k=1))],
        "SearchBatch": [search.SearchBatchRequest(options=search.SearchOptions(collection=collection, k=1))],
        "Compare": [search.CompareRequest(query=shapes.ShapeRef(collection="open", key="k"), other=ref)],
        "Align": [align.AlignRequest(header=align.AlignHeader(query_points=4, key=ref))],
        "Segment": [shapes.SegmentRequest(header=shapes.SegmentHeader(point_count=3))],
        "CreateCollection": [collections.CreateCollectionRequest(name=collection)],
        "GetCollection": [collections.GetCollectionRequest(name=collection)],
        "DeleteCollection": [collections.DeleteCollectionRequest(name=collection)],
        "RenameCollection": [collections.RenameCollectionRequest(name=collection, new_name="open")],
        "SetAlias": [collections.SetAliasRequest(alias="open", collection=collection)],
        "DeleteAlias": [collections.DeleteAliasRequest(alias=collection)],
        "ImportCollection": [admin.ImportCollectionRequest(header=admin.ImportCollectionHeader(
            collection=collection))],
        "CreateKey": [admin.CreateKeyRequest(name="", role=READER)],
    }
    return special.get(rpc)


def methods():
    for module in (shapes, search, align, collections, admin):
        for service in module.DESCRIPTOR.services_by_name.values():
            for method in service.methods:
                yield service, method


def request_of(method, collection):
    given = messages(method.name, collection)
    if given is not None:
        return given
    message = method.input_type._concrete_class()
    if "collection" in method.input_type.fields_by_name:
        message.collection = collection
    elif "shape" in method.input_type.fields_by_name:
        message.shape.collection = collection
        message.shape.key = "nobody"
    return [message]


def call(channel, service, method, collection, metadata=()):
    """Makes any rpc by its description; the status code."""
    path = f"/{service.full_name}/{method.name}"
    sends = request_of(method, collection)
    serialize = method.input_type._concrete_class.SerializeToString
    parse = method.output_type._concrete_class.FromString
    kind = ("stream" if method.client_streaming else "unary") + "_" + (
        "stream" if method.server_streaming else "unary")
    make = getattr(channel, kind)(path, request_serializer=serialize, response_deserializer=parse)
    argument = iter(sends) if method.client_streaming else sends[0]
    try:
        answer = make(argument, timeout=30, metadata=metadata)
        if method.server_streaming:
            list(answer)
        return grpc.StatusCode.OK
    except grpc.RpcError as error:
        return error.code()

# SPDX-License-Identifier: Apache-2.0
"""What calls say of several servers with one database."""

import asyncio

import numpy as np
import shapedb
from shapedb.v1 import search_service_pb2 as search_pb
from shapedb.v1 import shape_service_pb2 as pb

from fake import Fake

POINTS = np.eye(4, 3)


def searched(server, **options):
    with shapedb.Client(server.address) as client:
        return client.collection("c").search(key="a", **options)


def test_changes_of_shapes_are_told():
    shape = pb.GetShapeResponse().shape
    answers = [pb.GetShapeResponse(shape=shape, change=12), pb.GetShapeResponse(shape=shape),
               pb.DeleteShapeResponse(shape=shape, change=13),
               pb.AddShapeResponse(outcome="OUTCOME_CREATED", shape=shape, change=14)]
    with Fake(*answers) as server, shapedb.Client(server.address) as client:
        things = client.collection("c")
        known, alone = things.get("a"), things.get("a")
        assert known.change == 12 and alone.change == 0
        assert known == alone, "of the same shape"
        assert things.delete("a").change == 13
        assert things.add("a", POINTS).shape.change == 14


def test_searches_demand_changes_and_allow_gaps():
    with Fake(search_pb.SearchResponse(candidates=6, covered=0.75)) as server:
        assert searched(server).covered == 1.0, "nobody allowed less"
        assert searched(server, at_least=12, allow_partial=True).covered == 0.75
        first, second = (request.options for request in server.searches)
        assert first.at_least == 0 and not first.allow_partial
        assert second.at_least == 12 and second.allow_partial
    with Fake(search_pb.SearchResponse(candidates=6)) as server:
        assert searched(server, allow_partial=True).covered == 1.0, "an older server"
    with Fake(search_pb.SearchResponse()) as server:
        assert searched(server, allow_partial=True).covered == 0.0


def test_so_do_many_searches_and_those_of_asyncio():
    answer = search_pb.SearchBatchResponse(responses=[search_pb.SearchResponse(covered=0.5)])

    async def search(address):
        async with shapedb.AsyncClient(address) as client:
            return await client.collection("c").search_batch(["a"], at_least=3, allow_partial=True)

    with Fake(answer) as server:
        assert [result.covered for result in asyncio.run(search(server.address))] == [0.5]
        assert server.searches[0].options.at_least == 3 and server.searches[0].options.allow_partial

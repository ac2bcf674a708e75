# SPDX-License-Identifier: Apache-2.0
"""A server that fails as it is told, to see what a client does then."""

import concurrent.futures

import grpc
from shapedb.v1 import search_service_pb2_grpc as search_stubs
from shapedb.v1 import shape_service_pb2 as pb
from shapedb.v1 import shape_service_pb2_grpc as stubs


class Fake(stubs.ShapeServiceServicer, search_stubs.SearchServiceServicer):
    """`answers`: what becomes of one call after the other: a function that is given the context, or a message."""

    def __init__(self, *answers):
        self.answers = list(answers)
        self.uploads = []
        self.searches = []
        self.metadata = []
        self.deadlines = []

    def _next(self, context):
        self.metadata.append(dict(context.invocation_metadata()))
        self.deadlines.append(context.time_remaining())
        answer = self.answers.pop(0) if len(self.answers) > 1 else self.answers[0]
        return answer(context) if callable(answer) else answer

    def CountShapes(self, request, context):
        return self._next(context)

    def GetShape(self, request, context):
        return self._next(context)

    def DeleteShape(self, request, context):
        return self._next(context)

    def SearchByKey(self, request, context):
        self.searches.append(request)
        return self._next(context)

    def SearchBatch(self, request, context):
        self.searches.append(request)
        return self._next(context)

    def AddShape(self, requests, context):
        self.uploads.append([message.SerializeToString(deterministic=True) for message in requests])
        return self._next(context)

    def WatchIngest(self, request, context):
        yield self._next(context)

    def __enter__(self):
        # The pool of the server: one thread for each call that may hang.
        self._server = grpc.server(concurrent.futures.ThreadPoolExecutor(4))
        stubs.add_ShapeServiceServicer_to_server(self, self._server)
        search_stubs.add_SearchServiceServicer_to_server(self, self._server)
        self.port = self._server.add_insecure_port("127.0.0.1:0")
        self.address = f"127.0.0.1:{self.port}"
        self._server.start()
        return self

    def __exit__(self, *error):
        self._server.stop(0).wait()


def fails(code, name=None, pushback=None, message="as told"):
    """A call that fails."""
    trailing = []
    if name is not None:
        trailing.append(("shapedb-error", name))
    if pushback is not None:
        trailing.append(("grpc-retry-pushback-ms", str(pushback)))

    def answer(context):
        context.set_trailing_metadata(trailing)
        context.abort(code, message)

    return answer


COUNTED = pb.CountShapesResponse(count=7)

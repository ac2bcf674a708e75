# SPDX-License-Identifier: GPL-3.0-or-later
"""Reads while rebuilds are put in place: none may fail, however many switches there are."""

import threading
import unittest

from attacker import Server, admin, ball, grpc, main, search, shapes, types


class Switches(unittest.TestCase):
    def test_are_never_seen_by_readers(self):
        with Server() as server, server.connect() as client:
            for i in range(12):
                client.add(f"ball {i}", ball(400, 1 + 0.2 * i))
            ref = shapes.ShapeRef(key="ball 3")
            options = search.SearchOptions(k=5, verify=False)
            reads = [
                lambda c: c.shapes.GetSignature(shapes.GetSignatureRequest(shape=ref), timeout=30),
                lambda c: c.search.SearchByKey(search.SearchByKeyRequest(options=options, key="ball 3"), timeout=30),
                lambda c: c.search.Compare(
                    search.CompareRequest(query=ref, other=shapes.ShapeRef(key="ball 7")), timeout=30),
                lambda c: c.search.SearchBatch(search.SearchBatchRequest(
                    options=options,
                    queries=[search.SearchBatchRequest.Query(key=f"ball {i}") for i in range(6)]), timeout=30),
            ]
            stop = threading.Event()
            failures = []
            counts = [0] * len(reads)

            def read(which):
                with server.connect() as reader:
                    while not stop.is_set():
                        try:
                            reads[which](reader)
                            counts[which] += 1
                        except grpc.RpcError as error:
                            failures.append((which, error.details()))

            threads = [threading.Thread(target=read, args=(which,)) for which in range(len(reads))]
            for thread in threads:
                thread.start()
            for switch in range(6):
                change = types.SignatureParameters(max_points=5 + switch % 2)
                request = admin.RebuildRequest(collection="default", signature=change)
                self.assertTrue(list(client.admin.Rebuild(request, timeout=120))[-1].finished)
            stop.set()
            for thread in threads:
                thread.join()
            self.assertEqual(failures, [])
            self.assertGreater(min(counts), 20)


if __name__ == "__main__":
    main()

# SPDX-License-Identifier: GPL-3.0-or-later
"""The server is killed at random times under load, again and again: what it acknowledged is there after each restart.

SHAPEDB_TEST_SCALE multiplies the number of kills, SHAPEDB_TEST_SEED chooses other times and changes.
"""

import hashlib
import os
import random
import threading
import time
import unittest

from attacker import Server, admin, ball, collections, eventually, grpc, main, pack, shapes, types

# Taken away, since the server refuses variables of this kind that it does not know.
SCALE = max(1, int(os.environ.pop("SHAPEDB_TEST_SCALE", "1")))
KILLS = 20 * SCALE
SEED = int(os.environ.pop("SHAPEDB_TEST_SEED", "1"))
WRITERS = 3
KEYS = 8  # of each writer
CLOUDS = [ball(60 + 30 * i, 1 + 0.1 * i) for i in range(12)]
HASHES = [hashlib.sha256(pack(cloud)).digest() for cloud in CLOUDS]


class Outcomes:
    """What one thing may be: what was acknowledged last, and what was asked for since without an answer."""

    def __init__(self, value):
        self.possible = [value]
        self.acknowledged = 0

    def ask(self, value):
        self.possible.append(value)

    def acknowledge(self, value):
        self.possible = [value]
        self.acknowledged += 1

    def refused(self):
        """The last one asked for will not come."""
        self.possible.pop()

    def found(self, value):
        """True when it may be that; then it is that."""
        if value not in self.possible:
            return False
        self.possible = [value]
        return True


class Load:
    """Clients that change one server until it dies."""

    def __init__(self, seed, max_points):
        self.random = random.Random(seed)
        self.shapes = {f"writer {w} key {k}": Outcomes(None) for w in range(WRITERS) for k in range(KEYS)}
        self.max_points = Outcomes(max_points)
        self.unexpected = []

    def acknowledged(self):
        return sum(outcomes.acknowledged for outcomes in self.shapes.values()) + self.max_points.acknowledged

    def start(self, server):
        self.stop = threading.Event()
        seeds = [self.random.random() for _ in range(WRITERS + 1)]
        work = [(self.write, w) for w in range(WRITERS)] + [(self.rebuild, None)]
        self.threads = [threading.Thread(target=self.until_death, args=(server, body, argument, random.Random(seed)))
                        for (body, argument), seed in zip(work, seeds)]
        for thread in self.threads:
            thread.start()

    def join(self):
        self.stop.set()
        for thread in self.threads:
            thread.join()

    def until_death(self, server, body, argument, dice):
        with server.connect() as client:
            while not self.stop.is_set():
                try:
                    body(client, argument, dice)
                except grpc.RpcError as error:
                    if error.code() in (grpc.StatusCode.UNAVAILABLE, grpc.StatusCode.CANCELLED,
                                        grpc.StatusCode.UNKNOWN) and not server.running():
                        return
                    if not eventually(lambda: not server.running(), 1):
                        self.unexpected.append(f"{error.code()}: {error.details()}")
                    return

    def write(self, client, writer, dice):
        key = f"writer {writer} key {dice.randrange(KEYS)}"
        outcomes = self.shapes[key]
        if dice.random() < 0.2 and outcomes.possible != [None]:
            outcomes.ask(None)
            client.shapes.DeleteShape(shapes.DeleteShapeRequest(shape=shapes.ShapeRef(key=key)), timeout=30)
            outcomes.acknowledge(None)
            return
        which = dice.randrange(len(CLOUDS))
        note = str(dice.randrange(1000))
        value = (HASHES[which], note)
        outcomes.ask(value)
        client.add(key, CLOUDS[which], wait=dice.random() < 0.2, timeout=30, metadata={"note": note})
        outcomes.acknowledge(value)

    def rebuild(self, client, _, dice):
        wanted = dice.choice([5, 6, 7, 8])
        request = admin.RebuildRequest(collection="default", signature=types.SignatureParameters(max_points=wanted))
        self.max_points.ask(wanted)
        try:
            if list(client.admin.Rebuild(request, timeout=60))[-1].finished:
                self.max_points.acknowledge(wanted)
        except grpc.RpcError as error:
            # One with other parameters, from before the last kill, is still running.
            if error.code() not in (grpc.StatusCode.ALREADY_EXISTS, grpc.StatusCode.FAILED_PRECONDITION):
                raise
            self.max_points.refused()
            time.sleep(0.02)


def max_points_of(client):
    collection = client.collections.GetCollection(collections.GetCollectionRequest(name="default"), timeout=30)
    return collection.signature.max_points


def stored(client):
    found = {}
    cursor = ""
    while True:
        page = client.shapes.ListShapes(shapes.ListShapesRequest(page_size=1000, cursor=cursor), timeout=30)
        for shape in page.shapes:
            found[shape.key] = (shape.sha256, shape.metadata["note"])
        cursor = page.next_cursor
        if not cursor:
            return found


class Kills(unittest.TestCase):
    def test_lose_nothing_that_was_acknowledged(self):
        dice = random.Random(SEED)
        with Server() as server:
            with server.connect() as client:
                load = Load(SEED, max_points_of(client))
            for kill in range(KILLS):
                load.start(server)
                time.sleep(dice.uniform(0.02, 0.6))
                server.process.kill()
                server.process.wait()
                load.join()
                server.process.stdout.close()
                server.start()
                with server.connect() as client:
                    self.compare(client, load, kill)
            with server.connect() as client:
                self.settle(client)
                self.compare(client, load, KILLS)
            print(f"{KILLS} kills, {load.acknowledged()} changes acknowledged")
            self.assertGreater(load.acknowledged(), 2 * KILLS, "the server was hardly used")
            self.assertEqual(server.stop(), 0)

    def compare(self, client, load, kill):
        self.assertEqual(load.unexpected, [], f"kill {kill}")
        found = stored(client)
        for key, outcomes in load.shapes.items():
            possible = list(outcomes.possible)
            self.assertTrue(outcomes.found(found.pop(key, None)), f"kill {kill}: {key} is none of {possible}")
        self.assertEqual(found, {}, f"kill {kill}: nobody asked for these")
        # A rebuild that was running goes on, and may end later: what was possible stays so.
        self.assertIn(max_points_of(client), load.max_points.possible, f"kill {kill}")
        problems = [line for part in client.admin.Check(admin.CheckRequest(), timeout=60) for line in part.problems]
        self.assertEqual(problems, [], f"kill {kill}")
        self.assertEqual(client.admin.Stats(admin.StatsRequest(), timeout=30).missing_commits, 0, f"kill {kill}")

    def settle(self, client):
        """Everything that was waiting comes to its end, and nothing failed because of the kills."""
        def waiting():
            return client.admin.Stats(admin.StatsRequest(), timeout=30)

        self.assertTrue(eventually(lambda: waiting().shapes_pending == 0), "shapes are still pending")
        self.assertEqual(waiting().shapes_failed, 0, "a kill is no reason to fail a scan")


if __name__ == "__main__":
    main()

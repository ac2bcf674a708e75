# SPDX-License-Identifier: GPL-3.0-or-later
"""Two servers on one database: one of them, or the database, is killed at random times under load, again and again.
What was acknowledged is there, on both servers, and no scan is lost or failed.

SHAPEDB_TEST_SCALE multiplies the number of kills, SHAPEDB_TEST_SEED chooses other times and changes.
"""

import random
import threading
import time
import unittest

from attacker import Server, admin, eventually, grpc, main, shapes
from kill_test import CLOUDS, HASHES, KEYS, SCALE, SEED, WRITERS, Outcomes, stored
from postgres import Postgres

KILLS = 6 * SCALE
CUT_OFF = (grpc.StatusCode.UNAVAILABLE, grpc.StatusCode.CANCELLED, grpc.StatusCode.UNKNOWN)


class Writers:
    """Clients that send each change to one of the servers, until they are cut off."""

    def __init__(self, servers, seed):
        self.servers = servers
        self.random = random.Random(seed)
        self.shapes = {f"writer {w} key {k}": Outcomes(None) for w in range(WRITERS) for k in range(KEYS)}
        self.unexpected = []

    def acknowledged(self):
        return sum(outcomes.acknowledged for outcomes in self.shapes.values())

    def start(self):
        self.stop = threading.Event()
        self.killed = threading.Event()
        self.threads = [threading.Thread(target=self.run, args=(w, random.Random(self.random.random())))
                        for w in range(WRITERS)]
        for thread in self.threads:
            thread.start()

    def join(self):
        self.stop.set()
        for thread in self.threads:
            thread.join()

    def run(self, writer, dice):
        clients = [server.connect() for server in self.servers]
        try:
            while not self.stop.is_set():
                self.write(dice.choice(clients), writer, dice)
        except grpc.RpcError as error:
            # From here on it is not known what its last change came to.
            if error.code() not in CUT_OFF or not self.killed.wait(10):
                self.unexpected.append(f"{error.code()}: {error.details()}")
        finally:
            for client in clients:
                client.__exit__(None, None, None)

    def write(self, client, writer, dice):
        key = f"writer {writer} key {dice.randrange(KEYS)}"
        outcomes = self.shapes[key]
        if dice.random() < 0.2 and outcomes.possible != [None]:
            outcomes.ask(None)
            client.shapes.DeleteShape(shapes.DeleteShapeRequest(shape=shapes.ShapeRef(key=key)), timeout=60)
            outcomes.acknowledge(None)
            return
        which = dice.randrange(len(CLOUDS))
        note = str(dice.randrange(1000))
        outcomes.ask((HASHES[which], note))
        client.add(key, CLOUDS[which], timeout=60, metadata={"note": note})
        outcomes.acknowledge((HASHES[which], note))


class SharedKills(unittest.TestCase):
    def test_lose_nothing_that_was_acknowledged(self):
        dice = random.Random(SEED)
        with Postgres() as database:
            flags = ("--store-engine", "postgres", "--postgres-uri", database.uri, "--postgres-job-lease-seconds", "2")
            with Server(*flags, "--postgres-server-name", "one") as one, \
                    Server(*flags, "--postgres-server-name", "two") as two:
                load = Writers([one, two], SEED)
                for kill in range(KILLS):
                    load.start()
                    time.sleep(dice.uniform(0.3, 2))
                    load.killed.set()
                    self.kill_and_start(dice.choice([one, two, database]), [one, two])
                    load.join()
                    self.assertEqual(load.unexpected, [], f"kill {kill}")
                    self.compare([one, two], load, kill)
                self.settle(one)
                self.compare([one, two], load, KILLS)
                print(f"{KILLS} kills, {load.acknowledged()} changes acknowledged")
                self.assertGreater(load.acknowledged(), 2 * KILLS, "the servers were hardly used")
                self.assertEqual(one.stop(), 0)
                self.assertEqual(two.stop(), 0)

    def kill_and_start(self, victim, servers):
        if isinstance(victim, Postgres):
            victim.kill()
            for server in servers:
                with server.connect() as client:
                    self.assertTrue(eventually(lambda: not client.serving(), 10), "health notices")
            victim.start()
            return
        victim.process.kill()
        victim.process.wait()
        victim.process.stdout.close()
        victim.start()

    def compare(self, servers, load, kill):
        with servers[0].connect() as client:
            found = stored(client)
            with servers[1].connect() as other:
                self.assertEqual(stored(other), found, f"kill {kill}")
            for key, outcomes in load.shapes.items():
                possible = list(outcomes.possible)
                self.assertTrue(outcomes.found(found.pop(key, None)), f"kill {kill}: {key} is none of {possible}")
            self.assertEqual(found, {}, f"kill {kill}: nobody asked for these")
            problems = [line for part in client.admin.Check(admin.CheckRequest(), timeout=60) for line in part.problems]
            self.assertEqual(problems, [], f"kill {kill}")

    def settle(self, server):
        with server.connect() as client:
            def stats():
                return client.admin.Stats(admin.StatsRequest(), timeout=30)

            self.assertTrue(eventually(lambda: stats().shapes_pending == 0, 60), "shapes are still pending")
            self.assertEqual(stats().shapes_failed, 0, "a kill is no reason to fail a scan")


if __name__ == "__main__":
    main()

# SPDX-License-Identifier: GPL-3.0-or-later
"""Servers on one database: one of them, or the database, is killed at random times under load, again and again.

For tests of several kinds of them: a test derives from Kills, and says which servers there are.
"""

import contextlib
import random
import threading
import time

from attacker import Server, admin, eventually, grpc, search, shapes
from kill_test import CLOUDS, HASHES, KEYS, SCALE, SEED, WRITERS, Outcomes, stored
from postgres import Postgres

CUT_OFF = (grpc.StatusCode.UNAVAILABLE, grpc.StatusCode.CANCELLED, grpc.StatusCode.UNKNOWN)
ANCHOR = "anchor"  # what searches look for: it never changes


class Known(Outcomes):
    """Also what may be found of it at a moment, by searches too."""

    def __init__(self, value):
        super().__init__(value)
        self.changes = 0

    def ask(self, value):
        self.changes += 1
        super().ask(value)

    def acknowledge(self, value, searched=True):
        super().acknowledge(value)
        self.searched = searched
        self.changes += 1

    def found(self, value):
        # Whether the signature is there is another question.
        self.searched = len(self.possible) == 1 and self.searched
        return super().found(value)

    searched = True  # searches are to find it, once nothing else is asked for

    def certain(self):
        """(True, the value) if it is known what searches find."""
        possible = list(self.possible)
        return (len(possible) == 1 and self.searched, possible[0])


class Writers:
    """Clients that send each change to one of the servers, until they are cut off."""

    def __init__(self, servers, seed, waits=1.0):
        """`waits`: the part of the scans whose signature is waited for."""
        self.waits = waits
        self.servers = servers
        self.random = random.Random(seed)
        self.shapes = {f"writer {w} key {k}": Known(None) for w in range(WRITERS) for k in range(KEYS)}
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
        waits = dice.random() < self.waits
        client.add(key, CLOUDS[which], wait=waits, timeout=60, metadata={"note": note})
        outcomes.acknowledge((HASHES[which], note), waits)


class Searchers:
    """Clients that search all the time, each one server, and compare what they find with what is known. From its
    start to its `stop`."""

    def __init__(self, servers, known):
        """`known`: {key: Known}, which others change meanwhile."""
        self.known = known
        self.wrong = []
        self.answered = 0
        self.refused = {}  # {gRPC code: times}
        self.last = {}  # {server: when it answered last}
        self.longest = {}  # {server: seconds between two answers}
        self.lock = threading.Lock()
        self.over = threading.Event()
        self.threads = [threading.Thread(target=self.run, args=(server,)) for server in servers]
        for thread in self.threads:
            thread.start()

    def __enter__(self):
        return self

    def __exit__(self, *error):
        self.over.set()
        for thread in self.threads:
            thread.join()

    def reset(self):
        """The longest waits are counted from now."""
        with self.lock:
            self.longest = {}
            self.last = {server: time.monotonic() for server in self.last}

    def run(self, server):
        while not self.over.is_set():
            try:
                with server.connect() as client:
                    while not self.over.is_set():
                        self.once(server, client)
                        time.sleep(0.1)  # scans are segmented by what searches leave
            except grpc.RpcError as error:
                with self.lock:
                    self.refused[error.code()] = self.refused.get(error.code(), 0) + 1
                    if error.code() not in (*CUT_OFF, grpc.StatusCode.DEADLINE_EXCEEDED):
                        self.wrong.append(f"{error.code()}: {error.details()}")
                time.sleep(0.05)

    def once(self, server, client):
        before = {key: (known.changes, *known.certain()) for key, known in self.known.items()}
        found = searched(client)
        now = time.monotonic()
        wrong = []
        for key, (changes, certain, value) in before.items():
            if certain and self.known[key].changes == changes and found.get(key) != value:
                # Nobody asked for anything meanwhile.
                wrong.append(f"{key} is {value}, found is {found.get(key)}")
        wrong += [f"{key} was never asked for" for key in found if key not in self.known]
        with self.lock:
            self.wrong += wrong
            self.answered += 1
            self.longest[server] = max(self.longest.get(server, 0), now - self.last.get(server, now))
            self.last[server] = now



def searched(client, timeout=60):
    """What a search finds: {key: what is stored}."""
    request = search.SearchByKeyRequest(key=ANCHOR, include_self=True,
                                        options=search.SearchOptions(k=100, no_explanation=True, verify=False))
    hits = client.search.SearchByKey(request, timeout=timeout).hits
    return {hit.shape.key: (hit.shape.sha256, hit.shape.metadata["note"]) for hit in hits}


class Kills:
    """Of a TestCase."""

    def run_kills(self, kills, names, *flags, searches):
        """With servers of these names and flags. `searches`: searches go on meanwhile."""
        dice = random.Random(SEED)
        with contextlib.ExitStack() as stack:
            database = stack.enter_context(Postgres())
            servers = [stack.enter_context(Server(
                "--store-engine", "postgres", "--postgres-uri", database.uri, "--postgres-job-lease-seconds", "2",
                "--postgres-server-name", name, *flags)) for name in names]
            load = Writers(servers, SEED, 0.5 if searches else 1.0)
            with servers[0].connect() as client:
                client.add(ANCHOR, CLOUDS[0], metadata={"note": "here"})
                load.shapes[ANCHOR] = Known((HASHES[0], "here"))
            searchers = stack.enter_context(Searchers(servers, load.shapes)) if searches else None
            recoveries = []
            for kill in range(kills):
                load.start()
                time.sleep(dice.uniform(0.3, 2))
                load.killed.set()
                self.kill_and_start(dice.choice([*servers, database]), servers)
                started = time.monotonic()
                if searches:
                    self.assertTrue(eventually(lambda: serving(servers), 30), f"kill {kill}: shards have no server")
                    recoveries.append(time.monotonic() - started)
                    self.assertEqual(searchers.wrong[:3], [], f"kill {kill}")
                load.join()
                self.assertEqual(load.unexpected, [], f"kill {kill}")
                self.compare(servers, load, kill)
            self.settle(servers[0])
            self.compare(servers, load, kills)
            print(f"{kills} kills, {load.acknowledged()} changes acknowledged")
            # Of the scans some servers segment, others are told once in a second: with searches there are fewer.
            self.assertGreater(load.acknowledged(), kills if searches else 2 * kills, "the servers were hardly used")
            if searches:
                print(f"{searchers.answered} searches answered, refused: "
                      f"{ {code.name: times for code, times in searchers.refused.items()} }; after a start all shards "
                      f"have a server within {max(recoveries):.1f} s, {sorted(recoveries)[kills // 2]:.1f} s in the "
                      f"median; longest wait of a client for an answer {max(searchers.longest.values()):.1f} s")
                self.assertGreater(searchers.answered, 5 * kills, "hardly any search was answered")
                searchers.__exit__()
                self.assertEqual(searchers.wrong[:3], [])
            for server in servers:
                self.assertEqual(server.stop(), 0)

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
            for server in servers[1:]:
                with server.connect() as other:
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


def serving(servers, service="shapedb.v1.SearchService"):
    """All of them say so."""
    for server in servers:
        with server.connect() as client:
            if not client.serving(service):
                return False
    return True

# SPDX-License-Identifier: GPL-3.0-or-later
"""Links that nothing comes through any more, a transaction that does not end, and a database of a newer program: what
clients of three servers see, and when all is well again."""

import threading
import time
import unittest

from attacker import collections, eventually, grpc, main, reason
from clusters import LEASE, SEARCH, TIMEOUT, Changes, Cluster, Link, free_address, seconds_until
from kill_test import CLOUDS
from postgres import Postgres

SLACK = 10.0  # of a machine that does other things too
database = None


def setUpModule():
    global database
    database = unittest.enterModuleContext(Postgres())


def asked_through(link):
    host, port = link.target
    return ("--cluster-listen", f"{host}:{port}", "--cluster-advertise", f"127.0.0.1:{link.port}")


class CutLinks(unittest.TestCase):
    def test_a_server_without_the_database_is_silent_and_the_others_go_on(self):
        with Link(database.folder + "/.s.PGSQL.5432") as link:
            uri = database.another()
            far = uri.replace(f"host={database.folder}", f"host=127.0.0.1 port={link.port}")
            with Cluster(database, uri=uri, uris={"three": far}) as cluster:
                cluster.fill("one", 6)
                three = cluster.clients["three"]
                with cluster.searchers() as searches, Changes(cluster, "one") as changes:
                    time.sleep(1)
                    searches.reset()
                    link.cut()
                    # As its leases end, not only when the database has not answered for so long.
                    noticed = seconds_until(lambda: not three.serving(SEARCH), TIMEOUT - 0.5)
                    self.assertIsNotNone(noticed, "health notices")
                    others = seconds_until(lambda: self.answers(cluster, "one", "two"), LEASE + SLACK)
                    self.assertIsNotNone(others, "the others have its shards")
                    began = time.monotonic()
                    with self.assertRaises(grpc.RpcError) as refused:
                        cluster.look("three")
                    self.assertEqual(refused.exception.code(), grpc.StatusCode.UNAVAILABLE)
                    took = time.monotonic() - began
                    self.assertLess(took, 2 * TIMEOUT + SLACK)
                    before = changes.acknowledged
                    self.assertTrue(eventually(lambda: changes.acknowledged > before + 3, 20), "writes go on")
                    longest = max(searches.longest[cluster.servers[name]] for name in ("one", "two"))
                    self.assertLess(longest, LEASE + 2 + SLACK)
                    link.mend()
                    back = seconds_until(lambda: three.serving(SEARCH), 2 * TIMEOUT + SLACK)
                    self.assertIsNotNone(back, "health recovers")
                self.assertEqual(searches.wrong[:3], [])
                self.assertEqual(changes.refused, [])
                self.settled(cluster)
                print(f"link to the database cut: not serving after {noticed:.1f} s, a call by it refused after "
                      f"{took:.1f} s; the others without an answer for {longest:.1f} s; serving again {back:.1f} s "
                      f"after it was mended")

    def test_a_server_that_the_others_cannot_ask_is_not_needed_with_two_replicas(self):
        with Link(free_address()) as link:
            flags = {"three": asked_through(link)}
            with Cluster(database, replicas=2, own_flags=flags) as cluster:
                cluster.fill("one", 6)
                with cluster.searchers() as searches, Changes(cluster, "one") as changes:
                    time.sleep(1)
                    searches.reset()
                    link.cut()
                    time.sleep(2)
                    answered = searches.answered
                    self.assertTrue(eventually(lambda: searches.answered > answered + 5, 20), "searches go on")
                    longest = max(searches.longest.values())
                    link.mend()
                    back = seconds_until(lambda: self.quick(cluster), SLACK)
                    self.assertIsNotNone(back, "searches are as quick as before")
                self.assertEqual(searches.wrong[:3], [])
                self.assertEqual(searches.refused, {})
                self.assertEqual(changes.refused, [])
                self.assertLess(longest, LEASE + SLACK)
                self.settled(cluster)
                print(f"link between servers cut, two replicas: no search refused, the longest took {longest:.1f} s; "
                      f"quick again {back:.1f} s after it was mended")

    def test_with_one_replica_its_part_is_refused_until_the_link_is_back(self):
        with Link(free_address()) as link:
            flags = {"three": asked_through(link)}
            with Cluster(database, own_flags=flags) as cluster:
                cluster.fill("one", 6)
                with cluster.searchers() as searches, Changes(cluster, "one") as changes:
                    link.cut()
                    began = time.monotonic()
                    with self.assertRaises(grpc.RpcError) as refused:
                        cluster.look("one")
                    took = time.monotonic() - began
                    self.assertEqual(refused.exception.code(), grpc.StatusCode.UNAVAILABLE)
                    self.assertLess(took, LEASE + 2 + SLACK)
                    # It can ask the others.
                    self.assertTrue(self.answers(cluster, "three"))
                    link.mend()
                    back = seconds_until(lambda: self.answers(cluster, "one", "two"), SLACK)
                    self.assertIsNotNone(back)
                self.assertEqual(searches.wrong[:3], [])
                self.assertEqual(changes.refused, [])
                self.settled(cluster)
                print(f"link between servers cut, one replica: refused after {took:.1f} s, answered again {back:.1f} s "
                      f"after it was mended")

    def answers(self, cluster, *names):
        try:
            return all(cluster.look(name) for name in names)
        except grpc.RpcError:
            return False

    def quick(self, cluster):
        began = time.monotonic()
        return self.answers(cluster, *cluster.servers) and time.monotonic() - began < LEASE / 2

    def settled(self, cluster):
        """All searches find just what was acknowledged, on all servers."""
        cluster.settle("one")
        for name in cluster.servers:
            self.assertEqual(cluster.look(name), cluster.expected(), name)


class StalledTransactions(unittest.TestCase):
    WRITERS = 12  # more than a server has connections

    def test_hold_up_the_writes_of_their_collection_alone(self):
        with Cluster(database, ("one", "two"), flags=("--postgres-connections", "6")) as cluster:
            cluster.fill("one", 4)
            one = cluster.clients["one"]
            one.collections.CreateCollection(collections.CreateCollectionRequest(name="other"), timeout=30)
            stalled = database.psql("BEGIN; SELECT name FROM collection WHERE name = 'default' FOR UPDATE;\n",
                                    cluster.uri)
            self.assertEqual(stalled.stdout.readline().strip(), "default")
            with cluster.searchers() as searches:
                time.sleep(1)
                searches.reset()
                outcomes = []
                threads = [threading.Thread(target=self.write, args=(cluster, i, outcomes))
                           for i in range(self.WRITERS)]
                for thread in threads:
                    thread.start()
                time.sleep(1)
                self.assertEqual(one.serving(SEARCH), True)
                began = time.monotonic()
                self.assertTrue(eventually(lambda: self.adds_to_other(one), 2 * TIMEOUT + SLACK))
                other = time.monotonic() - began
                for thread in threads:
                    thread.join()
                longest = max(searches.longest.values())
                self.assertEqual(searches.refused, {})
                # The database gives up what the servers have given up, while the lock is held.
                waiting = ("SELECT count(*) FROM pg_stat_activity WHERE application_name IN ('one', 'two') AND "
                           "wait_event IN ('tuple', 'transactionid')")
                self.assertTrue(eventually(lambda: database.query(waiting) == "0", TIMEOUT + SLACK), "they pile up")
                stalled.communicate("ROLLBACK;\n")
                back = seconds_until(lambda: self.writes(cluster), SLACK)
                self.assertIsNotNone(back)
            self.assertEqual(searches.wrong[:3], [])
            self.assertEqual([o for o in outcomes if o[:2] != (grpc.StatusCode.UNAVAILABLE, "unavailable")], [])
            print(f"stalled transaction: {len(outcomes)} writes refused after {min(o[3] for o in outcomes):.1f} to "
                  f"{max(o[3] for o in outcomes):.1f} s ({outcomes[0][2]}); one to another collection took "
                  f"{other:.1f} s; searches waited {longest:.1f} s at most; writes again {back:.1f} s after its end")
            # First for a connection, then for the lock.
            self.assertLess(max(o[3] for o in outcomes), 2 * TIMEOUT + SLACK)
            self.assertLess(longest, 2)

    def adds_to_other(self, client):
        """False: all connections for writes are taken by those that wait, and the client has to try again."""
        try:
            client.add("free", CLOUDS[0], collection="other", wait=False, timeout=30)
            return True
        except grpc.RpcError as error:
            self.assertIn("all connections for writing are in use", error.details())
            return False

    def write(self, cluster, number, outcomes):
        began = time.monotonic()
        try:
            cluster.clients["one"].add(f"stalled {number}", CLOUDS[0], wait=False, timeout=60)
            outcomes.append((grpc.StatusCode.OK, "", "", time.monotonic() - began))
        except grpc.RpcError as error:
            outcomes.append((error.code(), reason(error), error.details(), time.monotonic() - began))

    def writes(self, cluster):
        try:
            cluster.write("one", "after it")
            return True
        except grpc.RpcError:
            return False


class OlderPrograms(unittest.TestCase):
    def test_refuse_to_start_and_those_that_run_go_on(self):
        with Cluster(database, ("one", "two")) as cluster:
            cluster.fill("one", 2)
            known = int(database.query("SELECT max(number) FROM schema_migration", cluster.uri))
            database.query(f"INSERT INTO schema_migration VALUES ({known + 1}, 'of a newer one', 'x', 0)", cluster.uri)
            with self.assertRaises(RuntimeError) as refused:
                cluster.another("three")
            text = str(refused.exception)
            self.assertIn(f"the database has migration {known + 1} (of a newer one), this program knows {known}", text)
            self.assertIn("use the newer program", text)
            cluster.write("one", "still", True)
            cluster.delete("two", "shape 0")
            for name in cluster.servers:
                self.assertTrue(cluster.clients[name].serving(SEARCH))
                self.assertEqual(cluster.look(name), cluster.expected(), name)
            print("an older program: " + text.strip().splitlines()[-1])


if __name__ == "__main__":
    main()

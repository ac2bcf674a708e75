# SPDX-License-Identifier: GPL-3.0-or-later
"""The database of several servers is lost and its standby promoted, or has no more room: what is acknowledged is there,
and the servers go on without a restart."""

import time
import unittest

from attacker import admin, eventually, grpc, main, reason
from clusters import SEARCH, TIMEOUT, Changes, Cluster, seconds_until
from postgres import Postgres
from shared_kills import serving

SLACK = 10.0  # of a machine that does other things too


def checked(test, cluster):
    """All servers find just what was acknowledged, and the database is in order."""
    test.assertIsNotNone(seconds_until(lambda: serving(cluster.servers.values()), 2 * TIMEOUT + SLACK))
    cluster.settle("one")
    for key, known in cluster.known.items():
        if len(known.possible) > 1:
            known.found(cluster.look("one").get(key))
    for name in cluster.servers:
        test.assertEqual(cluster.look(name), cluster.expected(), name)
    problems = [line for part in cluster.clients["one"].admin.Check(admin.CheckRequest(), timeout=60)
                for line in part.problems]
    test.assertEqual(problems, [])


def synchronous(primary):
    """What is acknowledged from now on is on the standby, too."""
    primary.query("ALTER SYSTEM SET synchronous_standby_names = 'standby'")
    primary.query("ALTER SYSTEM SET synchronous_commit = 'on'")
    primary.reload()
    if not eventually(lambda: primary.query("SELECT sync_state FROM pg_stat_replication") == "sync", 30):
        raise RuntimeError("the standby does not follow")


def wrote(cluster, name):
    try:
        cluster.write(name, "after it", True)
        return True
    except grpc.RpcError:
        return False


class Standbys(unittest.TestCase):
    """In this order, for the last one ends without its primary."""

    @classmethod
    def setUpClass(cls):
        cls.primary = cls.enterClassContext(Postgres())
        cls.standby = cls.enterClassContext(Postgres(standby_of=cls.primary))
        synchronous(cls.primary)

    def test_1_one_that_is_lost_holds_up_writes_alone(self):
        primary, standby = self.primary, self.standby
        with Cluster(primary, ("one", "two")) as cluster:
            cluster.fill("one", 6)
            with cluster.searchers() as searches:
                time.sleep(0.5)
                searches.reset()
                standby.kill()
                refused = self.refused(cluster, "nobody knows")
                self.assertIn("it may or may not be stored", refused[1])
                self.assertEqual(self.refused(cluster, "later")[0], grpc.StatusCode.UNAVAILABLE)
                self.assertTrue(serving(cluster.servers.values()))
                longest = max(searches.longest.values())
                self.assertEqual(searches.refused, {})
                standby.start()
                back = seconds_until(lambda: wrote(cluster, "two"), 2 * TIMEOUT + SLACK)
                self.assertIsNotNone(back, "writes work again")
            checked(self, cluster)
            self.assertEqual(searches.wrong[:3], [])
            print(f"synchronous standby lost: a write refused after {refused[2]:.1f} s, searches waited "
                  f"{longest:.1f} s at most; writes again {back:.1f} s after its return")

    def test_2_servers_go_on_with_one_that_is_promoted(self):
        primary, standby = self.primary, self.standby
        uri = (f"host={primary.folder},{standby.folder} user=postgres dbname=shapes "
               "target_session_attrs=read-write")
        with Cluster(primary, uri=uri) as cluster:
            cluster.fill("one", 6)
            with cluster.searchers() as searches, Changes(cluster, "one") as one, Changes(cluster, "two") as two:
                time.sleep(2)
                searches.reset()
                lost = time.monotonic()
                primary.kill()
                noticed = seconds_until(lambda: not any(
                    client.serving(SEARCH) for client in cluster.clients.values()), SLACK)
                self.assertIsNotNone(noticed, "health notices")
                with self.assertRaises(grpc.RpcError) as refused:
                    cluster.look("one")
                self.assertEqual(refused.exception.code(), grpc.StatusCode.UNAVAILABLE)
                standby.promote()
                promoted = time.monotonic()
                before = [one.acknowledged, two.acknowledged]
                self.assertTrue(eventually(lambda: one.acknowledged > before[0] and two.acknowledged > before[1],
                                           TIMEOUT + SLACK))
                after = time.monotonic() - promoted
                searched = seconds_until(lambda: serving(cluster.servers.values()), TIMEOUT + SLACK)
                self.assertIsNotNone(searched)
                time.sleep(0.5)
            self.assertEqual(searches.wrong[:3], [])
            for changes in (one, two):
                self.assertLessEqual({code for code, *_ in changes.refused}, {grpc.StatusCode.UNAVAILABLE})
            # What the standby has is what was acknowledged: it is asked here.
            checked(self, cluster)
            print(f"promotion: not serving {noticed:.1f} s after the loss, promoted after {promoted - lost:.1f} s; "
                  f"writes of all servers {after:.1f} s after that; calls failed for "
                  f"{max(one.longest, two.longest, *searches.longest.values()):.1f} s at most; "
                  f"{one.acknowledged + two.acknowledged} changes acknowledged, "
                  f"{len(one.refused) + len(two.refused)} refused")

    def refused(self, cluster, key):
        began = time.monotonic()
        with self.assertRaises(grpc.RpcError) as refused:
            cluster.write("one", key)
        return refused.exception.code(), refused.exception.details(), time.monotonic() - began


class FullDisks(unittest.TestCase):
    def test_writes_are_refused_until_there_is_room(self):
        with Postgres("autovacuum=off", disk="64m") as database, Cluster(database, ("one", "two")) as cluster:
            cluster.fill("one", 6)
            with cluster.searchers() as searches:
                # All that is free, and more than that to store.
                database.on_disk("dd", "if=/dev/zero", f"of={database.folder}/disk/ballast", "bs=64k")
                refusals = []
                began = time.monotonic()
                while len(refusals) < 10 and time.monotonic() < began + 60:
                    try:
                        cluster.write("one", f"more {len(cluster.known)}")
                    except grpc.RpcError as error:
                        refusals.append((error.code(), reason(error), error.details()))
                self.assertEqual({(code, name) for code, name, _ in refusals},
                                 {(grpc.StatusCode.RESOURCE_EXHAUSTED, "storage_full")}, refusals)
                answered = searches.answered
                self.assertTrue(eventually(lambda: searches.answered > answered + 10, 20), "searches go on")
                self.assertTrue(serving(cluster.servers.values()))
                self.assertEqual(searches.refused, {})
                database.on_disk("rm", f"{database.folder}/disk/ballast")
                back = seconds_until(lambda: wrote(cluster, "two"), SLACK)
                self.assertIsNotNone(back, "writes work again")
                for key, known in cluster.known.items():
                    if len(known.possible) > 1:
                        known.refused()  # that it was refused is a promise too
                checked(self, cluster)
            self.assertEqual(searches.wrong[:3], [])
            print(f"full disk: {len(refusals)} writes refused ({refusals[0][2]}), searches went on; writes again "
                  f"{back:.1f} s after there was room")


if __name__ == "__main__":
    main()

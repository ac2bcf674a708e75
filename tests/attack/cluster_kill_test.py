# SPDX-License-Identifier: GPL-3.0-or-later
"""Three servers that hold the shards between them: one of them, or the database, is killed at random times under load.
What was acknowledged is there, and each search that is answered is answered right, also in between.

SHAPEDB_TEST_SCALE multiplies the number of kills, SHAPEDB_TEST_SEED chooses other times and changes.
"""

import unittest

from attacker import main
from shared_kills import SCALE, Kills

KILLS = 2 * SCALE


class ClusterKills(Kills, unittest.TestCase):
    def run_cluster(self, replicas):
        self.run_kills(KILLS, ["one", "two", "three"], "--cluster-replicas", str(replicas),
                       "--cluster-lease-milliseconds", "1000", searches=True)

    def test_with_one_replica(self):
        self.run_cluster(1)

    def test_with_two_replicas(self):
        self.run_cluster(2)


if __name__ == "__main__":
    main()

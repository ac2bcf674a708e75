# SPDX-License-Identifier: GPL-3.0-or-later
"""Two servers on one database: one of them, or the database, is killed at random times under load, again and again.
What was acknowledged is there, on both servers, and no scan is lost or failed.

SHAPEDB_TEST_SCALE multiplies the number of kills, SHAPEDB_TEST_SEED chooses other times and changes.
"""

import unittest

from attacker import main
from shared_kills import SCALE, Kills


class SharedKills(Kills, unittest.TestCase):
    def test_lose_nothing_that_was_acknowledged(self):
        self.run_kills(6 * SCALE, ["one", "two"], searches=False)


if __name__ == "__main__":
    main()

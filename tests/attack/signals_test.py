# SPDX-License-Identifier: GPL-3.0-or-later
"""What signals do to a server: it ends cleanly, or goes on. Crashes and SIGKILL are others' tests."""

import signal
import subprocess
import threading
import unittest

from attacker import Server, ball, eventually, main, shapes, types, upload

DRAIN = [signal.SIGTERM, signal.SIGINT, signal.SIGHUP, signal.SIGQUIT, signal.SIGPWR, signal.SIGXCPU]
METRICS = ["--metrics-listen", "127.0.0.1:0"]
IGNORED = [signal.SIGUSR1, signal.SIGUSR2, signal.SIGALRM, signal.SIGVTALRM, signal.SIGIO, signal.SIGPIPE, signal.SIGXFSZ,
           signal.SIGRTMIN, signal.SIGRTMIN + 5, signal.SIGRTMAX]


def send(server, number):
    # The enumeration of Python lacks some of them.
    subprocess.run(["kill", f"-{int(number)}", str(server.process.pid)], check=True)


class Signals(unittest.TestCase):
    def test_that_end_the_server_let_calls_finish(self):
        for number in DRAIN:
            with self.subTest(number), Server(*METRICS) as server, server.connect() as client:
                rest = threading.Event()

                def slow():
                    yield from list(upload("slow", ball(200)))[:1]
                    rest.wait(30)
                    yield from list(upload("slow", ball(200)))[1:]

                call = client.shapes.AddShape.future(slow(), timeout=60)
                self.assertTrue(eventually(lambda: server.begun() == 1))
                send(server, number)
                self.assertTrue(eventually(lambda: f"draining signal={int(number)}" in server.log(), 10), server.log())
                if number == signal.SIGXCPU:
                    send(server, number)  # as the system does every second
                rest.set()
                self.assertEqual(call.result().shape.key, "slow")
                self.assertEqual(server.process.wait(30), 0)
                self.assertIn("stopped", server.log())

    def test_of_people_end_it_at_once_the_second_time(self):
        for second in (signal.SIGTERM, signal.SIGQUIT):
            with self.subTest(second), Server(*METRICS) as server, server.connect() as client:
                stop = threading.Event()

                def idle():
                    yield from list(upload("idle", ball(200)))[:1]
                    stop.wait(30)

                call = client.shapes.AddShape.future(idle(), timeout=60)
                self.assertTrue(eventually(lambda: server.begun() == 1))
                send(server, signal.SIGTERM)
                self.assertTrue(eventually(lambda: "draining" in server.log(), 10))
                send(server, second)
                self.assertEqual(server.process.wait(10), 130)
                stop.set()
                self.assertIsNotNone(call.exception())

    def test_of_other_daemons_end_nothing(self):
        with Server() as server, server.connect() as client:
            for number in IGNORED:
                send(server, number)
                self.assertEqual(client.count(), 0, number)
            self.assertTrue(server.running())
            self.assertNotIn("draining", server.log())
            self.assertEqual(server.stop(), 0)


if __name__ == "__main__":
    main()

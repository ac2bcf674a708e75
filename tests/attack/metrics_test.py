# SPDX-License-Identifier: GPL-3.0-or-later
"""The numbers for Prometheus, as Prometheus reads them; and that the dashboard, the alert rules and the documentation
speak of the ones that exist."""

import contextlib
import json
import os
import re
import socket
import time
import unittest
import urllib.request

from attacker import Server, ball, eventually, grpc, main, search

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
LABELS = {"rpc", "code", "state", "kind", "version", "schema", "le"}
SUFFIXES = ("_bucket", "_sum", "_count")


class Page:
    """The text format, version 0.0.4."""

    def __init__(self, text):
        self.kinds, self.helps, self.values = {}, {}, {}
        for line in text.splitlines():
            if re.match(r"(# \w+ )?exposer_", line):
                continue  # of the library that serves the page
            if line.startswith("# HELP "):
                name, self.helps[name] = line[7:].split(" ", 1)[0], line[7:].split(" ", 1)[1]
            elif line.startswith("# TYPE "):
                name, kind = line[7:].split(" ")
                assert name not in self.kinds, name + " comes twice"
                self.kinds[name] = kind
            elif line:
                match = re.fullmatch(r'([a-z_]+)(?:\{(.*)\})? (\S+)', line)
                assert match, line
                labels = dict(re.findall(r'([a-z_]+)="([^"]*)"', match[2] or ""))
                self.values[match[1], tuple(sorted(labels.items()))] = float(match[3])

    def value(self, name, **labels):
        return self.values.get((name, tuple(sorted(labels.items()))))

    def family(self, name):
        for suffix in SUFFIXES:
            if name.endswith(suffix) and name[:-len(suffix)] in self.kinds:
                return name[:-len(suffix)]
        return name


def read(name):
    with open(os.path.join(ROOT, name)) as file:
        return file.read()


def serve():
    return Server("--metrics-listen", "127.0.0.1:0")


def scrape(server):
    port = re.search(r"metrics are served .*port=(\d+)", server.log())[1]
    with urllib.request.urlopen(f"http://127.0.0.1:{port}/metrics", timeout=10) as answer:
        return Page(answer.read().decode())


class Numbers(unittest.TestCase):
    def test_tell_what_happened(self):
        with serve() as server, server.connect() as client:
            client.add("ball", ball(400))
            client.add("egg", ball(600, 1.5))
            client.search.SearchByKey(search.SearchByKeyRequest(
                options=search.SearchOptions(k=1, verify=False), key="ball"), timeout=30)
            with self.assertRaises(grpc.RpcError):
                client.search.SearchByKey(search.SearchByKeyRequest(
                    options=search.SearchOptions(k=1), key="nobody"), timeout=30)
            page = scrape(server)
            self.assertEqual(page.value("shapedb_calls_total", rpc="AddShape", code="OK"), 2)
            self.assertEqual(page.value("shapedb_calls_total", rpc="SearchByKey", code="NOT_FOUND"), 1)
            self.assertEqual(page.value("shapedb_call_duration_seconds_count", rpc="SearchByKey"), 2)
            self.assertEqual(page.value("shapedb_received_point_bytes_total"), 12 * 1_000)
            self.assertEqual(page.value("shapedb_shapes", state="ready"), 2)
            self.assertEqual(page.value("shapedb_segmented_scans_total"), 2)
            self.assertEqual(page.value("shapedb_searches_total"), 1)
            self.assertEqual(page.value("shapedb_index_signatures"), 2)
            self.assertEqual(page.value("shapedb_accepting_connections"), 1)
            self.assertGreater(page.value("process_resident_memory_bytes"), 1 << 20)
            self.assertAlmostEqual(page.value("process_resident_memory_bytes"), server.resident(), delta=16 << 20)
            self.assertGreater(page.value("shapedb_connections"), 0)

    def test_keep_their_names_whoever_calls(self):
        """No label has a value that a client chooses."""
        with serve() as server, server.connect() as client:
            before = {name for name, _ in scrape(server).values}
            for i in range(30):
                with self.assertRaises(grpc.RpcError):
                    client.search.SearchByKey(search.SearchByKeyRequest(
                        options=search.SearchOptions(k=1, collection=f"made-up-{i}"), key=f"key {i}"), timeout=30)
            page = scrape(server)
            calls = [labels for name, labels in page.values if name == "shapedb_calls_total"]
            self.assertEqual(len(calls), 1)
            self.assertTrue(before <= {name for name, _ in page.values})

    def test_the_server_does_not_start_without_them(self):
        with serve() as server:
            port = re.search(r"metrics are served .*port=(\d+)", server.log())[1]
            with self.assertRaises(RuntimeError) as error:
                Server("--metrics-listen", f"127.0.0.1:{port}")
            self.assertIn("metrics cannot be served", str(error.exception))


class SlowReaders(unittest.TestCase):
    def test_cannot_hold_the_listener(self):
        with serve() as server:
            port = int(re.search(r"metrics are served .*port=(\d+)", server.log())[1])
            halves = [socket.create_connection(("127.0.0.1", port)) for _ in range(32)]
            for i, half in enumerate(halves):  # mute ones, and some that never end their request
                if i % 2:
                    half.sendall(b"GET /metrics HTTP/1.1\r\nHost: a\r\nX-Long: ")
            began = time.monotonic()
            self.assertTrue(eventually(lambda: answers(server), 30))
            self.assertLess(time.monotonic() - began, 20)
            for half in halves:
                half.settimeout(30)
                with contextlib.suppress(ConnectionResetError):
                    while half.recv(1_000):
                        pass
                half.close()


def answers(server):
    try:
        scrape(server)
        return True
    except OSError:
        return False


class Names(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        with serve() as server, server.connect() as client:
            client.add("ball", ball(400))
            cls.page = scrape(server)

    def test_follow_the_rules_of_prometheus(self):
        for name, kind in self.page.kinds.items():
            with self.subTest(name):
                self.assertRegex(name, r"^(shapedb|process)(_[a-z]+)+$")
                self.assertEqual(name.endswith("_total"), kind == "counter")
                self.assertNotRegex(name, r"_(ms|milliseconds|minutes|kib|mib|kb|mb|percent)(_|$)")
                self.assertRegex(self.page.helps[name], r"^[A-Z1].*\.$")
                if kind == "histogram":
                    self.assertTrue(name.endswith("_seconds"))
        for name, labels in self.page.values:
            self.assertIn(self.page.family(name), self.page.kinds)
            self.assertLessEqual({label for label, _ in labels}, LABELS, name)

    def used(self, text):
        return set(re.findall(r"\b(?:shapedb|process)_[a-z_]+\b", text))

    def known(self):
        # Of servers with TLS, and of those that hold shards.
        optional = {"shapedb_tls_certificate_expiry_timestamp_seconds", "shapedb_shards",
                    "shapedb_shards_follow_changes"}
        histograms = {n + s for n, kind in self.page.kinds.items() if kind == "histogram" for s in SUFFIXES}
        return set(self.page.kinds) | optional | histograms

    def test_are_all_documented_and_no_others(self):
        table = re.findall(r"^\| `([a-z_]+)`", read("docs/metrics.md"), re.M)
        self.assertEqual(len(table), len(set(table)))
        self.assertEqual(set(table), (self.known() - {n + s for n in self.page.kinds for s in SUFFIXES}))

    def test_in_the_dashboard_exist(self):
        dashboard = json.loads(read("docker/grafana-dashboard.json"))
        queries = [target["expr"] for panel in dashboard["panels"] for target in panel.get("targets", [])]
        self.assertGreaterEqual(len(queries), 10)
        for query in queries:
            with self.subTest(query):
                self.assertLessEqual(self.used(query), self.known())
                self.assertTrue(self.used(query))
        units = {panel["fieldConfig"]["defaults"].get("unit") for panel in dashboard["panels"]
                 if panel["type"] != "row"}
        self.assertNotIn(None, units, "each panel says its unit")

    def test_in_the_alert_rules_exist(self):
        rules = read("docker/prometheus-rules.yaml")
        expressions = re.findall(r"^ +expr: (.*)$", rules, re.M)
        self.assertGreaterEqual(len(expressions), 6)
        for expression in expressions:
            with self.subTest(expression):
                self.assertTrue(self.used(expression) or expression.startswith("up{"))
                self.assertLessEqual(self.used(expression), self.known())
        self.assertEqual(len(re.findall(r"^ +summary: ", rules, re.M)), len(expressions))


class Traces(unittest.TestCase):
    TRACE = "4bf92f3577b34da6a3ce929d0e0e4736"

    def test_are_written_to_the_log_line_of_the_call(self):
        good = f"00-{self.TRACE}-00f067aa0ba902b7-01"
        bad = [good.upper(), good[:-1], "ff" + good[2:], good.replace(self.TRACE, "0" * 32), good + "x",
               good.replace("00f067aa0ba902b7", "0" * 16), "nonsense", good + "-x", good + "-"]
        with Server("--log-format", "json") as server, server.connect() as client:
            from attacker import shapes
            client.shapes.CountShapes(shapes.CountShapesRequest(), timeout=10, metadata=(("traceparent", good),))
            for value in bad:
                client.shapes.CountShapes(shapes.CountShapesRequest(), timeout=10,
                                          metadata=(("traceparent", value),))
            lines = lambda: [json.loads(line) for line in server.log().splitlines() if '"CountShapes"' in line]
            self.assertTrue(eventually(lambda: len(lines()) == 1 + len(bad), 10))
            self.assertEqual([line.get("trace") for line in lines()], [self.TRACE] + [None] * len(bad))

    def test_are_written_to_each_line_of_the_call(self):
        from attacker import admin
        trace = (("traceparent", f"00-{self.TRACE}-00f067aa0ba902b7-01"),)
        with Server("--log-format", "json") as server, server.connect() as client:
            backup = list(client.admin.Backup(admin.BackupRequest(), timeout=30))
            client.admin.Restore(iter(backup), timeout=30, metadata=trace)
            header = admin.ImportCollectionRequest(header=admin.ImportCollectionHeader(collection="copy"))
            export = client.admin.ExportCollection(admin.ExportCollectionRequest(), timeout=30)
            client.admin.ImportCollection(iter([header] + [admin.ImportCollectionRequest(chunk=chunk)
                                                           for chunk in export]), timeout=30, metadata=trace)
            for words in ("database replaced by a backup", "collection imported"):
                lines = [json.loads(line) for line in server.log().splitlines() if words in line]
                self.assertEqual([line.get("trace") for line in lines], [self.TRACE], words)


if __name__ == "__main__":
    main()

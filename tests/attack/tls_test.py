# SPDX-License-Identifier: GPL-3.0-or-later
"""TLS: what listens beyond loopback, certificates that change while calls run, and clients that must show one."""

import os
import subprocess
import tempfile
import threading
import time
import unittest

from attacker import Client, SecuredServer, Server, admin, eventually, grpc, main

READER = admin.ROLE_READER


class Certificates:
    """An authority and what it signs, made with openssl."""

    def __init__(self, folder):
        self.folder = folder
        self.run("req", "-x509", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:P-256", "-nodes", "-days", "2",
                 "-keyout", self.path("ca.key"), "-out", self.path("ca.pem"), "-subj", "/CN=authority")

    def path(self, name):
        return os.path.join(self.folder, name)

    def run(self, *arguments):
        subprocess.run(["openssl", *arguments], check=True, capture_output=True)

    def read(self, name):
        with open(self.path(name), "rb") as file:
            return file.read()

    def sign(self, name):
        """NAME.key and NAME.pem, for localhost."""
        self.run("req", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:P-256", "-nodes", "-keyout",
                 self.path(name + ".key"), "-out", self.path(name + ".csr"), "-subj", "/CN=" + name)
        with open(self.path("names"), "w") as file:
            file.write("subjectAltName=DNS:localhost,IP:127.0.0.1")
        self.run("x509", "-req", "-in", self.path(name + ".csr"), "-CA", self.path("ca.pem"), "-CAkey",
                 self.path("ca.key"), "-CAcreateserial", "-days", "2", "-extfile", self.path("names"), "-out",
                 self.path(name + ".pem"))

    def install(self, name, part):
        """Puts a file of `name` where the server reads it, as certbot does: in one step."""
        with open(self.path("new"), "wb") as file:
            file.write(self.read(f"{name}.{part}"))
        os.replace(self.path("new"), self.path("server." + part))


class Tls(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory(prefix="shapedb-tls-")
        self.addCleanup(folder.cleanup)
        self.certificates = Certificates(folder.name)
        for name in ("first", "second", "client"):
            self.certificates.sign(name)
        self.install("first")

    def install(self, name):
        self.certificates.install(name, "pem")
        self.certificates.install(name, "key")

    def server(self, *flags):
        path = self.certificates.path
        return SecuredServer("--tls-certificate", path("server.pem"), "--tls-key", path("server.key"), *flags,
                             listen="0.0.0.0:0")

    def connect(self, server, key, **client):
        credentials = grpc.ssl_channel_credentials(self.certificates.read("ca.pem"), **client)
        return Client(f"localhost:{server.port}", key=key, credentials=credentials)

    def serial(self, server):
        """Of the certificate that a new connection is shown."""
        shown = subprocess.run(["openssl", "s_client", "-connect", f"127.0.0.1:{server.port}", "-alpn", "h2"],
                               input=b"", capture_output=True).stdout
        return subprocess.run(["openssl", "x509", "-noout", "-subject"], input=shown, capture_output=True,
                              check=True).stdout.decode().strip()

    def test_beyond_loopback_only_with_tls_and_a_key(self):
        with self.assertRaises(RuntimeError) as error:
            Server(listen="0.0.0.0:0")
        self.assertIn("tls.certificate", str(error.exception))
        path = self.certificates.path
        with self.assertRaises(RuntimeError) as error:
            Server("--tls-certificate", path("server.pem"), "--tls-key", path("server.key"), listen="0.0.0.0:0")
        self.assertIn("shapedbd key create", str(error.exception))
        with self.server() as server:
            key = server.make(READER).secret
            with self.connect(server, key) as client:
                self.assertEqual(client.count(), 0)
                self.assertTrue(client.serving())
            with self.connect(server, None) as client, self.assertRaises(grpc.RpcError) as error:
                client.count()
            self.assertEqual(error.exception.code(), grpc.StatusCode.UNAUTHENTICATED)
            with Client(server.address, key=key) as plain, self.assertRaises(grpc.RpcError) as error:
                plain.count(timeout=5)
            self.assertEqual(error.exception.code(), grpc.StatusCode.UNAVAILABLE, "no TLS, no answer")

    def test_certificates_are_replaced_without_a_dropped_call(self):
        with self.server() as server:
            key = server.make(READER).secret
            self.assertIn("first", self.serial(server))
            failures, calls, stop = [], [0], threading.Event()

            def read():
                while not stop.is_set():
                    try:
                        with self.connect(server, key) as client:  # a new connection each time
                            client.count()
                        calls[0] += 1
                    except grpc.RpcError as error:
                        failures.append(error.details())

            reader = threading.Thread(target=read)
            with self.connect(server, key) as lasting:
                lasting.count()
                reader.start()
                for name in ("second", "first", "second"):
                    self.install(name)
                    self.assertTrue(eventually(lambda n=name: n in self.serial(server), 60), name)
                lasting.count()
            stop.set()
            reader.join()
            self.assertEqual(failures, [])
            self.assertGreater(calls[0], 20)

    def test_a_mismatched_pair_keeps_the_old_and_says_so(self):
        with self.server() as server:
            key = server.make(READER).secret
            self.certificates.install("second", "pem")  # and not its key
            self.assertTrue(eventually(lambda: "does not belong to" in server.log(), 60))
            time.sleep(2)
            self.assertIn("first", self.serial(server))
            with self.connect(server, key) as client:
                client.count()
            self.certificates.install("second", "key")
            self.assertTrue(eventually(lambda: "second" in self.serial(server), 60))
        with self.assertRaises(RuntimeError) as error:
            self.certificates.install("first", "pem")
            self.server()
        self.assertIn("does not belong to", str(error.exception))

    def test_clients_may_have_to_show_a_certificate(self):
        with self.server("--tls-client-ca", self.certificates.path("ca.pem")) as server:
            key = server.make(READER).secret
            with self.connect(server, key) as client, self.assertRaises(grpc.RpcError) as error:
                client.count(timeout=5)
            self.assertEqual(error.exception.code(), grpc.StatusCode.UNAVAILABLE)
            shown = {"private_key": self.certificates.read("client.key"),
                     "certificate_chain": self.certificates.read("client.pem")}
            with self.connect(server, key, **shown) as client:
                self.assertEqual(client.count(), 0)


if __name__ == "__main__":
    main()

# SPDX-License-Identifier: GPL-3.0-or-later
"""The documentation as a site: it builds, every link and anchor in it leads somewhere, and nothing is loaded from elsewhere."""

import os
import re
import shutil
import subprocess
import tempfile
import unittest
from html.parser import HTMLParser
from urllib.parse import unquote, urlsplit

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
THEME = "/usr/share/mkdocs/themes/material"
LOADING = {"script": "src", "img": "src", "link": "href", "iframe": "src", "source": "src", "video": "src", "audio": "src"}


class Page(HTMLParser):
    def __init__(self, text):
        super().__init__()
        self.anchors = set()
        self.links = []
        self.loaded = []
        self.text = []
        self.list_items = 0
        self.feed(text)

    def handle_starttag(self, tag, attributes):
        named = dict(attributes)
        self.anchors.update(value for key, value in attributes if key in ("id", "name") and value)
        if tag == "a" and named.get("href"):
            self.links.append(named["href"])
        self.list_items += tag == "li"
        if tag in LOADING and named.get(LOADING[tag]):
            self.loaded.append((named.get("rel"), named[LOADING[tag]]))

    def handle_data(self, data):
        self.text.append(data)


def build(folder):
    done = subprocess.run([os.path.join(ROOT, "scripts/site.sh"), folder], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    return done.returncode, done.stdout


@unittest.skipUnless(shutil.which("mkdocs") and os.path.isdir(THEME), "mkdocs and mkdocs-material are not installed")
class Site(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.mkdtemp(prefix="shapedb-site-")
        cls.addClassCleanup(shutil.rmtree, cls.folder)
        code, printed = build(cls.folder)
        assert code == 0, printed
        cls.pages = {}
        for name in sorted(os.listdir(cls.folder)):
            if name.endswith(".html"):
                with open(os.path.join(cls.folder, name), encoding="utf-8") as file:
                    cls.pages[name] = Page(file.read())

    def test_has_a_page_for_each_of_docs(self):
        sources = {name[:-3] + ".html" for name in os.listdir(os.path.join(ROOT, "docs")) if name.endswith(".md")}
        self.assertEqual(set(self.pages), sources)

    def test_every_page_is_reached_from_the_start(self):
        seen, todo = set(), ["index.html"]
        while todo:
            name = todo.pop()
            if name in seen or name not in self.pages:
                continue
            seen.add(name)
            todo += [urlsplit(link).path for link in self.pages[name].links if not urlsplit(link).scheme]
        self.assertEqual(seen, set(self.pages))

    def test_links_and_anchors_lead_somewhere(self):
        lost = []
        for name, page in self.pages.items():
            for link in page.links:
                parts = urlsplit(link)
                if parts.scheme:
                    self.assertIn(parts.scheme, ("http", "https"), link)
                    continue
                path = unquote(parts.path) or name
                if path in (".", "./"):
                    path = "index.html"
                if not os.path.isfile(os.path.join(self.folder, path)):
                    lost.append(f"{name}: {link}")
                elif parts.fragment and path in self.pages and unquote(parts.fragment) not in self.pages[path].anchors:
                    lost.append(f"{name}: {link}")
        self.assertEqual(lost, [])

    def test_loads_nothing_from_elsewhere(self):
        for name, page in self.pages.items():
            for rel, address in page.loaded:
                if rel != "canonical":
                    self.assertFalse(address.startswith("/"), f"{name} is in a folder, or below one: {address}")
                    self.assertFalse(urlsplit(address).netloc, f"{name} loads {address}")
                    self.assertTrue(os.path.isfile(os.path.join(self.folder, urlsplit(address).path)), f"{name}: {address}")
        for folder, _, files in os.walk(self.folder):
            for file in files:
                if file.endswith(".css"):
                    with open(os.path.join(folder, file), encoding="utf-8") as style:
                        self.assertNotRegex(style.read(), r"url\(['\"]?(https?:)?//")

    def test_can_be_searched(self):
        with open(os.path.join(self.folder, "search/search_index.json"), encoding="utf-8") as file:
            index = file.read()
        for words in ("malformed_filter", "SearchByScan", "--drop-plane"):
            self.assertIn(words, index)

    def test_shows_no_markers_and_keeps_lists(self):
        for name, page in self.pages.items():
            text = "".join(page.text)
            for marker in ("<!-- setup", "<!-- not run", "<!-- output"):
                self.assertTrue(marker not in text or name == "development.html", f"{name} shows {marker}")
        self.assertIn("openssl req -x509", "".join(self.pages["security.html"].text))
        source = os.path.join(ROOT, "docs/tutorial.md")
        with open(source, encoding="utf-8") as file:
            items = len(re.findall(r"^[-*] ", file.read(), re.MULTILINE))
        navigation = self.pages["index.html"].list_items
        self.assertGreaterEqual(self.pages["tutorial.html"].list_items, items)
        self.assertGreater(navigation, 30)


class Building(unittest.TestCase):
    @unittest.skipUnless(shutil.which("mkdocs") and os.path.isdir(THEME), "mkdocs and mkdocs-material are not installed")
    def test_refuses_a_link_that_leads_nowhere(self):
        with tempfile.TemporaryDirectory(prefix="shapedb-site-") as folder:
            for name in ("docs", "scripts", "mkdocs.yml"):
                source = os.path.join(ROOT, name)
                (shutil.copytree if os.path.isdir(source) else shutil.copy)(source, os.path.join(folder, name))
            with open(os.path.join(folder, "docs/tutorial.md"), "a", encoding="utf-8") as file:
                file.write("\nSee [there](no-such-page.md).\n")
            done = subprocess.run([os.path.join(folder, "scripts/site.sh"), os.path.join(folder, "site")],
                                  stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
            self.assertNotEqual(done.returncode, 0)
            self.assertIn("no-such-page.md", done.stdout)


if __name__ == "__main__":
    unittest.main()

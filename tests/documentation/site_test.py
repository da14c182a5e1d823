#!/usr/bin/python3
"""docs.sh builds the site and the API reference without a warning, and in what it has built each link leads somewhere, no page needs
another host, and the search works from disk."""
import html.parser
import os
import re
import shutil
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path
from urllib.parse import unquote, urlsplit

ROOT = Path(__file__).resolve().parents[2]
MIN_PAGES, MIN_CLASSES = 30, 100
NEEDED = {'sphinx-build': 'python3-sphinx', 'doxygen': 'doxygen'}
THEME = ('furo', 'myst_parser')
DOXYGENS_OWN = '#nested-classes'  # It links to this anchor from each page, also from those that do not have it.


class Page(html.parser.HTMLParser):
    """What a page links to, what it loads, and its anchors."""

    def __init__(self, text):
        super().__init__()
        self.links, self.loads, self.anchors = [], [], set()
        self.feed(text)

    def handle_starttag(self, tag, attributes):
        attributes = dict(attributes)
        self.anchors |= {attributes[name] for name in ('id', 'name') if attributes.get(name)}
        for name in ('src', 'data', 'href'):
            if target := attributes.get(name):
                (self.links if tag in ('a', 'area') or attributes.get('rel') in ('search', 'index', 'next', 'prev') else self.loads).append(target)


class Site(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = Path(cls.enterClassContext(tempfile.TemporaryDirectory()))
        cls.built = subprocess.run([ROOT / 'docs.sh', cls.folder / 'site'], capture_output=True, text=True, timeout=280, check=False)
        cls.texts = {path.relative_to(cls.folder): path.read_text(errors='replace') for path in sorted(cls.folder.rglob('*.html'))}
        cls.pages = {path: Page(text) for path, text in cls.texts.items()}

    def test_it_is_built_without_warnings(self):
        self.assertEqual((self.built.returncode, self.built.stderr), (0, ''))
        self.assertGreater(len(self.pages), MIN_PAGES)

    def test_links_lead_somewhere(self):
        self.assertEqual([fault for path in self.pages for fault in self.broken(path)], [])

    def broken(self, path):
        page = self.pages[path]
        for target in page.links + page.loads:
            parts = urlsplit(target)
            if parts.scheme or parts.netloc or target == DOXYGENS_OWN:
                continue
            found = (self.folder / path.parent / unquote(parts.path)).resolve().relative_to(self.folder.resolve()) if parts.path else path
            if not (self.folder / found).is_file():
                yield f'{path}: {target} leads nowhere'
            elif parts.fragment and found in self.pages and unquote(parts.fragment) not in self.pages[found].anchors:
                yield f'{path}: {target} leads to no anchor'

    def test_no_page_needs_another_host(self):
        loads = [(path, target) for path, page in self.pages.items() for target in page.loads]
        styles = [(path.relative_to(self.folder), target) for path in self.folder.rglob('*.css')
                  for target in re.findall(r'url\(["\']?([^)"\']*)|@import ["\']([^"\']*)', path.read_text()) for target in target if target]
        self.assertGreater(len(loads), MIN_PAGES)
        self.assertEqual([f'{path}: {target}' for path, target in loads + styles if re.match(r'(https?:)?//|/', target)], [])

    def test_it_is_searched_and_read_in_a_browser(self):
        script = Path(__file__).with_name('site_page.mjs')
        done = subprocess.run([ROOT / 'tests/support/run_page_test.sh', script], capture_output=True, text=True, timeout=200, check=False,
                              env={**os.environ, 'SITE': str(self.folder / 'site')})
        if done.returncode == 77:
            self.skipTest(done.stdout.strip())
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)

    def test_every_document_is_a_page(self):
        documents = [*ROOT.glob('*.md'), *(ROOT / 'docs').rglob('*.md')]
        self.assertEqual([str(document) for document in documents
                          if Path('site', document.relative_to(ROOT)).with_suffix('.html') not in self.pages], [])

    def test_every_public_header_is_in_the_reference(self):
        headers = [path.name for path in (ROOT / 'include').rglob('*.hpp')]
        files = re.sub(r'<[^>]*>', ' ', self.texts[Path('site/api/files.html')])
        self.assertEqual([name for name in headers if not re.search(rf'\b{re.escape(name)}\b', files)], [])

    def test_every_class_of_the_reference_says_what_it_is(self):
        classes = dict(re.findall(
            r'<a class="el" href="((?:class|struct)\w+)\.html"[^>]*>[^<]*</a></td><td class="desc">(.*?)</td>',
            self.texts[Path('site/api/annotated.html')]))
        self.assertGreater(len(classes), MIN_CLASSES)
        self.assertEqual([page for page, text in classes.items() if not text], [])


def main():
    missing = [package for program, package in NEEDED.items() if not shutil.which(program)]
    missing += [name for name in THEME if subprocess.run([sys.executable, '-c', f'import {name}'], capture_output=True, check=False).returncode]
    if missing:
        print(f'skipped: there is no {", ".join(missing)} (cmake/packages/docs.txt)')
        sys.exit(77)
    unittest.main()


if __name__ == '__main__':
    main()

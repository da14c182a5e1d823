#!/usr/bin/python3
"""Checks that ARCHITECTURE.md, HACKING.md, docs/inside.md, docs/recipes.md and docs/long_tests.md speak of what exists: each path, file, class and function that they name in backquotes or in
a diagram. (Links: tests/documentation/markdown_links.py.)"""
import re
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
DOCUMENTS = ('ARCHITECTURE.md', 'HACKING.md', 'docs/inside.md', 'docs/recipes.md', 'docs/long_tests.md')
FOLDERS = ('apps', 'cmake', 'config', 'docs', 'examples', 'include', 'src', 'tests')
SOURCES = {'.cpp', '.hpp', '.py', '.js', '.sh', '.json', '.txt', '.md', '.html', '.cmake'}
# Names of others: of the Python servers that ours replace, and of libraries.
FOREIGN = {'session_server.py', 'simulation_server.py', 'SessionHandler.get', 'MonitorHandler', 'LoadHandler', 'retrieve_load', 'update_load',
           'setup_project', 'setup_project_from_github', 'send_email', 'start_webots', 'next_available_port', 'kill_webots', 'cleanup_webots_instance',
           'update_snapshot', 'on_message', 'co_await', 'co_spawn', 'asio::thread_pool', 'asio::post', 'asio/awaitable.hpp',
           'throw_if_cancelled(false)', 'getaddrinfo'}
MIN_NAMES = 80  # With fewer, this check no longer understands how the documents are written.

CODE = re.compile(r'(?<!`)`([^`\n]+)`(?!`)')
DIAGRAM = re.compile(r'^```(?!bash)\w*\n(.*?)^```', re.M | re.S)
CLASS = re.compile(r'\b(?:[A-Z][a-z0-9]+){2,}\b')
NAME = re.compile(r'[A-Za-z_][\w:]*(?:\(\))?')
PATH = re.compile(r'[\w.*<>{},-]+(?:/[\w.*<>{},-]*)+')


class Tree:
    """The files, and the words that the sources contain."""

    def __init__(self, files, text):
        self.files = files
        self.stems = {Path(f).stem for f in files} | {Path(f).name for f in files}
        self.text = text
        self.words = set(re.findall(r'\w+', text))

    def has_path(self, path):
        """Whether a file or folder, with or without its ending, is at this path below the root, `src` or the public headers. `*` is anything."""
        for choice in alternatives(path.rstrip('/')):
            pattern = re.escape(choice).replace(r'\*', '[^/]*')
            pattern = re.compile(rf'(?:src/|include/webots_cloud/)?{pattern}(?:\.\w+|/.*)?')
            if not any(pattern.fullmatch(f) for f in self.files):
                return False
        return True

    def has_name(self, name):
        """Whether the sources know the words; of `Class::member`, whether the member belongs to the class."""
        parts = re.findall(r'\w+', name)
        if not all(part in self.words or part in self.stems for part in parts):
            return False
        return all(self.has_member(owner, member) for owner, member in zip(parts, parts[1:]) if '::' in name)

    def has_member(self, owner, member):
        return (re.search(rf'\b{owner}::(?:Impl::)?{member}\b', self.text) or
                re.search(rf'\b(?:class|struct|namespace) {owner}\b[^;{{]*\{{(?:(?!\n}};).)*\b{member}\b', self.text, re.S))


def alternatives(path):
    """`a/{b,c}_d` is `a/b_d` and `a/c_d`."""
    match = re.search(r'\{([^}]*)\}', path)
    return [path] if not match else [a for word in match.group(1).split(',')
                                     for a in alternatives(path[:match.start()] + word + path[match.end():])]


def names(text):
    """(name, is it a path) for each in backquotes that is a path, a CamelCase class or a snake_case word, and for those words in
    diagrams."""
    diagrams = ' '.join(DIAGRAM.findall(text))
    yield from ((name, False) for name in CLASS.findall(diagrams) + re.findall(r'\b[a-z]+(?:_[a-z]+)+\b', diagrams))
    for code in CODE.findall(re.sub(r'^```.*?^```', '', text, flags=re.M | re.S)):
        for word in code.split():
            if word in FOREIGN or word.startswith(('/', '-', 'build/', '$')):
                continue
            if PATH.fullmatch(word):
                yield word, True
            elif re.fullmatch(r'[\w*{},]+(?:\.(?:cpp|hpp|py|sh|txt|md|json))?', word) and ('*' in word or '{' in word or '.' in word):
                yield word, 'anywhere'
            elif NAME.fullmatch(word) and ('_' in word or '::' in word or CLASS.search(word)):
                yield word, False


def faults(name, text, tree):
    for word, kind in names(text):
        if kind == 'anywhere':
            found = all(any(re.fullmatch(re.escape(choice).replace(r'\*', r'\w*'), stem) for stem in tree.stems)
                        for choice in alternatives(word))
        else:
            found = tree.has_path(word) if kind else tree.has_name(word)
        if not found:
            yield f'{name}: there is no {word}'


def self_test():
    """A check that finds nothing must be able to find something."""
    tree = Tree(['src/core/git/pack_reader.cpp', 'docs/a.md', 'test.sh'], 'class PackReader; void read_pack();\nstruct Pack\n{\n    int size;\n};\nvoid Pack::Impl::read();')
    good = ['`core/git`', '`src/core/git/pack_*`', '`core/git/{pack}_reader`', '`PackReader`', '`read_pack()`', '`pack_reader`', '`test.sh`',
            '`pack_*`', '`co_await`', 'PackWriter', '`word`', '`Pack::size`', '`Pack::read`']
    bad = ['`core/gut`', '`src/core/git/pock_*`', '`core/git/{pack,pick}_reader`', '`PackWriter`', '`write_pack()`', '`pack_writer`', '`tests.sh`',
           '`pick_*`', '`PackReader::size`', '`Pack::read_pack`', '```\nPackWriter\n```\n']
    assert not (found := [f for text in good for f in faults('a.md', text, tree)]), found
    missed = [text for text in bad if not list(faults('a.md', text, tree))]
    assert not missed, missed


def main():
    self_test()
    paths = [p for p in ROOT.iterdir() if p.is_file()]
    paths += [p for folder in FOLDERS for p in (ROOT / folder).rglob('*') if p.is_file() and '__pycache__' not in p.parts]
    # The documents themselves and this list of foreign names prove nothing.
    sources = [p for p in paths if p.suffix in SOURCES and p.name not in DOCUMENTS and p != Path(__file__).resolve()]
    tree = Tree([str(p.relative_to(ROOT)) for p in paths], '\n'.join(p.read_text(errors='replace') for p in sources if p.suffix != '.md'))
    texts = {name: (ROOT / name).read_text() for name in DOCUMENTS}
    found = [fault for name, text in texts.items() for fault in faults(name, text, tree)]
    count = sum(len(list(names(text))) for text in texts.values())
    print('\n'.join(found) or f'{count} names in {" and ".join(DOCUMENTS)} exist')
    assert count >= MIN_NAMES, f'only {count} names were found'
    return 1 if found else 0


if __name__ == '__main__':
    sys.exit(main())

#!/usr/bin/python3
"""Checks that every sentence that docs/protocol.md quotes is one that the programs say: its words, between the variable parts, must be in
the sources. A text that is changed there has to be changed on that page, too."""
import re
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
DOCUMENT = 'docs/protocol.md'
SPEAKERS = ('src', 'include', 'examples/demo_simulator', 'tests/support')  # the last plays the websites
MIN_TEXTS = 80  # texts; with fewer, something here can no longer read what people write

# Said by others than our programs, or to a person who reads the page.
FOREIGN = {'docker system prune --volumes'}
PREFIXES = re.compile(r'^(?:loading: Error: |Error: |loading: Wrong message: |loading: )')
VARIABLE = re.compile(r'<[^<>]*>|\.\.\.')
SENTENCE = re.compile(r"\b[A-Za-z']+ [a-z']+ [a-z']+\b")


def spoken(source):
    """The literals of a source, those that are put together without anything between them as one."""
    source = re.sub(r'\\"', '\x00', source)
    source = re.sub(r'"\s*(?:,\s*)?"', '', source)
    return source.replace('\x00', '"')


def quoted(document):
    """(line, words) for each piece of a sentence between backticks, outside of code blocks."""
    text = re.sub(r'^```.*?^```', lambda m: '\n' * m.group().count('\n'), document, flags=re.M | re.S)
    for match in re.finditer(r'`([^`\n]+)`', text):
        for piece in VARIABLE.split(PREFIXES.sub('', match.group(1))):
            words = piece.strip(' .,;:"[]')
            if SENTENCE.search(words) and words not in FOREIGN:
                yield text.count('\n', 0, match.start()) + 1, words


def self_test():
    """A check that finds nothing must be able to find something."""
    code = spoken('concat("There is no project \\"", name,\n "\\" on "\n "this server."); f("too", " many of them")')
    page = 'x `loading: Error: There is no project "<name>" on this server.` y `too many of them` `git -a`\n```\n`not read at all`\n```\n'
    found = list(quoted(page))
    assert found == [(1, 'There is no project'), (1, 'on this server'), (1, 'too many of them')], found
    assert all(words in code for _, words in found), code
    assert 'on that server' not in code


def main():
    self_test()
    files = (p for folder in SPEAKERS for p in (ROOT / folder).rglob('*') if p.suffix in {'.cpp', '.hpp', '.py', '.js'})
    said = '\n'.join(spoken(p.read_text(errors='replace')) for p in files)
    texts = list(quoted((ROOT / DOCUMENT).read_text()))
    faults = [f'{DOCUMENT}:{line}: nobody says "{words}"' for line, words in texts if words not in said]
    print('\n'.join(faults) or f'{len(texts)} texts of {DOCUMENT} are said somewhere')
    assert len(texts) >= MIN_TEXTS, f'only {len(texts)} texts were found: are they written in a new way?'
    return 1 if faults else 0


if __name__ == '__main__':
    sys.exit(main())

#!/usr/bin/python3
"""Every link of every Markdown file that leads into the repository leads to something: to a file or a folder, and where it has an anchor to
a heading. Anchors are those that forges make of headings. Pictures are shown somewhere, and small."""
import re
import sys
from pathlib import Path
from urllib.parse import unquote

ROOT = Path(__file__).resolve().parents[2]
FOLDERS = ('apps', 'cmake', 'config', 'docs', 'examples', 'include', 'src', 'tests')
MAX_PICTURE = 150000  # bytes
MIN_LINKS = 300  # With fewer, this check no longer understands how the documents are written.

FENCED = re.compile(r'^( *)(```+|~~~+).*?^ *\2`*~* *$', re.M | re.S)
CODE = re.compile(r'(`+)(?!`).*?(?<!`)\1(?!`)', re.S)
LINK = re.compile(r'!?\[(?:[^\[\]]|!?\[[^\[\]]*\]\([^)]*\))*\]\(<?([^)\s>]+)>?\s*(?:"[^"]*")?\)')
ABSOLUTE = re.compile(r'[a-z][a-z0-9+.-]*:|//')


def prose(text):
    """The text without code, which may look like links, and with as many lines."""
    blank = lambda match: '\n' * match.group().count('\n')  # noqa: E731
    return CODE.sub(lambda match: '`' + blank(match), FENCED.sub(blank, text))


def slug(heading):
    """The anchor of a heading: small letters, blanks as hyphens, and of other signs only hyphens and underscores."""
    heading = re.sub(r'!?\[([^\]]*)\]\([^)]*\)', r'\1', heading)
    return re.sub(r'[^\w\- ]', '', heading.strip().lower().replace('`', '')).replace(' ', '-')


def anchors(text):
    found = set()
    for heading in re.findall(r'^#{1,6} +(.*?)#* *$', FENCED.sub('', text), re.M):
        anchor, number = slug(heading), 0
        while anchor in found:  # The second of two equal headings has "-1" at its end.
            number += 1
            anchor = f'{slug(heading)}-{number}'
        found.add(anchor)
    return found


def links(text):
    """(number of the line, target) of each link that leads into the repository."""
    text = prose(text)
    for match in LINK.finditer(text):
        for target in [match.group(1), *re.findall(r'!\[[^\]]*\]\(([^)]*)\)', match.group()[1:])]:
            if not ABSOLUTE.match(target):
                yield text.count('\n', 0, match.start()) + 1, unquote(target)


def faults(path, text, read):
    """What is wrong with the links of a document; `read` returns the text of a path, '' of a folder, and None of nothing."""
    for line, target in links(text):
        file, _, anchor = target.partition('#')
        found = read(path.parent / file) if file else text
        if found is None:
            yield f'{path}:{line}: the link {target} leads nowhere'
        elif anchor and anchor not in anchors(found):
            yield f'{path}:{line}: the link {target} leads to no heading'


def read_file(path):
    path = ROOT / path
    if path.is_dir():
        return ''
    return path.read_text(errors='replace') if path.is_file() and path.resolve().is_relative_to(ROOT) else None


def self_test():
    """A check that finds nothing must be able to find something."""
    texts = {'docs/b.md': '# The `x` of *us*, 2\n## Twice\n## Twice\n```\n# no heading\n```\n', 'docs': '', 'c.png': 'x'}
    read = lambda path: texts.get(re.sub(r'\w+/\.\./', '', str(path)))  # noqa: E731
    good = ['[a](b.md)', '[a](b.md#the-x-of-us-2)', '[a](b.md#twice-1)', '[a](https://x.y/z#q)', '![p](../c.png)', '[a](../docs)', '`[a](nowhere)`',
            '```\n[a](nowhere)\n```', '# Here\n[a](#here)', '[![p](../c.png)](b.md)', '[a](mailto:x@y.z)', '[`a`](b.md "title")']
    bad = ['[a](nowhere)', '[a](b.md#no-heading)', '[a](b.md#thrice)', '![p](../d.png)', '[a](#here)', '[![p](../d.png)](b.md)', '[![p](../c.png)](nowhere)',
           '[`a`](nowhere)', 'x `y` [a](nowhere) `z`']
    assert not (found := [f for text in good for f in faults(Path('docs/a.md'), text, read)]), found
    missed = [text for text in bad if not list(faults(Path('docs/a.md'), text, read))]
    assert not missed, missed


def documents():
    """The Markdown files, relative to the root."""
    paths = [*ROOT.glob('*.md'), *(p for folder in FOLDERS for p in (ROOT / folder).rglob('*.md') if 'node_modules' not in p.parts)]
    return sorted(path.relative_to(ROOT) for path in paths)


def picture_faults():
    """Pictures that nobody shows, and those that are too large for a page with several of them."""
    shown = {(path.parent / target.partition('#')[0]).as_posix() for path in documents() for _, target in links((ROOT / path).read_text())}
    shown = {re.sub(r'\w+/\.\./', '', target) for target in shown}
    for picture in sorted((ROOT / 'docs/images').iterdir()):
        name = picture.relative_to(ROOT).as_posix()
        if name not in shown:
            yield f'{name}: no document shows it'
        if picture.stat().st_size > MAX_PICTURE:
            yield f'{name}: it has more than {MAX_PICTURE} bytes; see tests/viewer/document_picture.mjs'


def main():
    self_test()
    texts = {path: (ROOT / path).read_text() for path in documents()}
    found = [fault for path, text in texts.items() for fault in faults(path, text, read_file)] + list(picture_faults())
    count = sum(len(list(links(text))) for text in texts.values())
    print('\n'.join(found) or f'{count} links in {len(texts)} documents lead somewhere')
    assert count >= MIN_LINKS, f'only {count} links were found'
    return 1 if found else 0


if __name__ == '__main__':
    sys.exit(main())

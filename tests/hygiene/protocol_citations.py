#!/usr/bin/python3
"""Finds citations of docs/protocol.md that lead nowhere: "Protocol sections 4.1.2 and 13, quirk Q6", "// 4.3, Q9.". Links and their anchors
are the business of tests/documentation/markdown_links.py."""
import re
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
DOCUMENT = 'docs/protocol.md'
FOLDERS = ('apps', 'cmake', 'config', 'docs', 'examples', 'include', 'src', 'tests')
KINDS = {'.cpp', '.hpp', '.py', '.js', '.md', '.sh', '.conf', '.cmake', '.txt', '.css', '.html', '.yml', '.service', '.json'}
MIN_CITATIONS = 300  # citations; with fewer, something here can no longer read what people write

NUMBER = r'\d{1,2}(?:\.\d{1,2}){0,2}(?![\w/]|\.\d)'
DOTTED = r'\d{1,2}(?:\.\d{1,2}){1,2}(?![\w%/]|\.\d)'
LIST = rf'({NUMBER}(?:(?:, and |, | and ){DOTTED})*(?: and {NUMBER})?)'
CITATIONS = (re.compile(rf'\b(?:[Pp]rotocol,? (?:sections? )?|[Ss]ections? |protocol\.md, ){LIST}'),
             re.compile(rf'^[ \t]*(?://+|#+)[ \t]+({DOTTED})', re.M))
OWN = (re.compile(rf'(?<![\w.\-/])(?<!TLS )(?<!HTTP )({DOTTED})(?! s\b| MB\b)'), re.compile(rf'\b[Ss]ections? {LIST}'))
QUIRK = re.compile(r'\bQ(\d{1,2})\b')


def sections(document):
    return set(re.findall(r'^#+ (\d{1,2}(?:\.\d{1,2}){0,2})[. ]', without_code(document), re.M))


def quirks(document):
    return set(re.findall(r'^\| Q(\d+) \|', document, re.M))


def without_code(text):
    """And without the targets of links, with as many lines."""
    for code in (r'(?ms)^```.*?^```', r'`[^`\n]*`', r'\]\([^)\n]*\)'):
        text = re.sub(code, lambda match: re.sub(r'[^\n]', ' ', match.group()), text)
    return text


def joined(text):
    """Comments over several lines become one, of the same length: the marks at the beginning of their lines are blanked."""
    return re.sub(r'\n[ \t]*(?:///?|#|\*)(?=\s)', lambda match: ' ' * len(match.group()), text)


def citations(name, text):
    """(offset, 'section' or 'quirk', number) for all that a file cites."""
    own, is_markdown = name == DOCUMENT, name.endswith('.md')
    flat = without_code(text) if own else text if is_markdown else joined(text)
    patterns = OWN if own else CITATIONS[:1] if is_markdown else CITATIONS
    for pattern in patterns:
        for match in pattern.finditer(text if pattern is CITATIONS[1] else flat):
            if not re.search(r'\bRFC \d+,? *$', flat[:match.start()][-20:]):
                yield from ((match.start(), 'section', number) for number in re.findall(NUMBER, match.group(1)))
    yield from ((match.start(), 'quirk', match.group(1)) for match in QUIRK.finditer(flat))


def faults(name, text, known, cited):
    """Of one file; what it cites is appended to `cited`."""
    for offset, kind, number in sorted(citations(name, text)):
        cited.append(number)
        if number not in known[kind]:
            yield f'{name}:{text.count(chr(10), 0, offset) + 1}: there is no {kind} {number} in {DOCUMENT}'


def self_test():
    """A check that finds nothing must be able to find something."""
    document = '# P\n## 4. S\n### 4.1 T\n#### 4.1.2 U\n## 13. Ours\n```\n## 5. no\n```\n| Q6 | a | b |\n| Q7 | a | b |\n'
    known = {'section': sections(document), 'quirk': quirks(document)}
    assert known == {'section': {'4', '4.1', '4.1.2', '13'}, 'quirk': {'6', '7'}}, known
    for count, text in ((0, '// Protocol section 4.1.2, steps 1 and 3, section 13 (forges), and quirks Q6 to Q7.'), (0, '// 4.1, Q7.'),
                        (0, '"""Protocol sections 4, 4.1 and\n13. x 9.9"""'), (0, '// Protocol 4.1: status 200 for 99 of them, 5 times.'),
                        (0, '// Base64 (RFC 4648, section 5).'), (0, '// 10.0.0.0/8 is a network.'), (1, '// Protocol section 5.'),
                        (2, '// Protocol sections 4.1 and 4.2, quirk Q9.'), (1, '// 4.7, Q6.'), (1, '/// so (protocol section\n/// 4.3).'),
                        (1, 'see docs/protocol.md, 4.9')):
        assert len(list(faults('a.cpp', text, known, []))) == count, text
    assert len(list(faults(DOCUMENT, 'See 4.1, 4.9, section 12, Q1; not TLS 1.3, 1.5 s or `9.9`.', known, []))) == 3


def files():
    yield from (p for p in ROOT.iterdir() if p.suffix in KINDS)
    for folder in FOLDERS:
        yield from (p for p in (ROOT / folder).rglob('*') if p.suffix in KINDS and p.is_file())


def main():
    self_test()
    document = (ROOT / DOCUMENT).read_text()
    known = {'section': sections(document), 'quirk': quirks(document)}
    cited, found = [], []
    for path in sorted(files()):
        if path != Path(__file__).resolve():
            found += faults(str(path.relative_to(ROOT)), path.read_text(errors='replace'), known, cited)
    print('\n'.join(found) or f'{len(cited)} citations of {DOCUMENT} lead somewhere')
    assert len(cited) >= MIN_CITATIONS, f'only {len(cited)} citations were found: are they written in a new way?'
    return 1 if found else 0


if __name__ == '__main__':
    sys.exit(main())

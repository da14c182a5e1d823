#!/usr/bin/python3
"""Finds citations of docs/protocol.md that lead nowhere: "Protocol sections 4.1.2 (steps 5 to 8) and 13, quirk Q6", "// 4.3, Q9.",
links such as protocol.md#4-simulation-server; and links of that page itself that are dead."""
import re
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
DOCUMENT = 'docs/protocol.md'
FOLDERS = ('apps', 'cmake', 'config', 'docs', 'examples', 'include', 'src', 'tests')
KINDS = {'.cpp', '.hpp', '.py', '.js', '.md', '.sh', '.conf', '.cmake', '.txt', '.css', '.html', '.yml', '.service', '.json'}
MIN_CITATIONS = 300  # citations; with fewer, something here can no longer read what people write

NUMBER = r'\d{1,2}(?:\.\d{1,2}){0,2}'
DOTTED = r'\d{1,2}(?:\.\d{1,2}){1,2}'


class Document:
    """What can be cited: sections with their steps, quirks, anchors."""

    def __init__(self, text):
        self.text = text
        self.steps = {}  # of each section
        self.quirks = set()
        self.anchors = anchors(text)
        section = None
        for line in without_code_blocks(text).splitlines():
            if heading := re.match(rf'#+ ({NUMBER})[. ]', line):
                section = heading.group(1)
                self.steps[section] = set()
            elif line.startswith('#'):
                section = None
            elif (step := re.match(r'(\d+)\. ', line)) and section:
                self.steps[section].add(int(step.group(1)))
            elif quirk := re.match(r'\| Q(\d+) \|', line):
                self.quirks.add(int(quirk.group(1)))

    def lacks(self, citation):
        """What is wrong with a citation; None: nothing."""
        kind, number, step = citation
        if kind == 'quirk':
            return None if number in self.quirks else f'there is no quirk Q{number}'
        if number not in self.steps:
            return f'there is no section {number}'
        if step is not None and step not in self.steps[number]:
            return f'section {number} has no step {step}'
        return None


def without_code_blocks(text):
    """With as many lines."""
    return re.sub(r'^```.*?^```', lambda m: '\n' * m.group().count('\n'), text, flags=re.M | re.S)


def anchors(text):
    """Those that GitHub gives the headings."""
    found = set()
    for line in without_code_blocks(text).splitlines():
        if heading := re.match(r'#+ (.*)', line):
            words = re.sub(r'\[([^\]]*)\]\([^)]*\)', r'\1', heading.group(1)).strip().lower()
            slug = re.sub(r'[^\w\- ]', '', words).replace(' ', '-')
            number = 0
            while (name := f'{slug}-{number}' if number else slug) in found:
                number += 1
            found.add(name)
    return found


def joined(text):
    """Comments over several lines become one, of the same length: the marks at the beginning of their lines are blanked."""
    return re.sub(r'\n[ \t]*(?:///?|#|\*)(?=\s)', lambda m: ' ' * len(m.group()), text)


def numbers(kind, first, last=None):
    return [(kind, number, None) for number in range(first, (last or first) + 1)]


TOKEN = re.compile(rf'(?P<number>(?<![\w.\-/]){NUMBER}(?![\w%/]|\.\d))|(?P<word>[A-Za-z`][^\s,;:()]*)|(?P<mark>[,()])|(?P<other>\S)')


def read_list(text):
    """The sections and steps that a clause names: what follows "Protocol section"."""
    found = []
    mode, expects, is_range, section, last = 'section', True, False, None, None
    for token in TOKEN.finditer(text):
        if number := token['number']:
            if '.' in number or (expects and mode == 'section'):
                mode, section = 'section', number
                found.append(('section', number, None))
            elif expects and mode == 'step' and section:
                first = last + 1 if is_range and last else int(number)
                found += [('section', section, step) for step in range(first, int(number) + 1)]
                last = int(number)
            expects = is_range = False
        elif token['mark'] == ')':
            mode = 'section' if mode == 'step' else mode
        elif token['mark'] or token['word'] in ('and', 'or'):
            expects, is_range = True, False
        elif token['word'] == 'to':
            expects = is_range = True
        elif token['word'] in ('step', 'steps', 'item', 'items'):
            mode, expects, is_range, last = 'step', True, False, None
        elif token['word'] in ('section', 'sections', 'protocol', 'Protocol'):
            mode, expects, is_range = 'section', True, False
        else:
            expects = is_range = False
    return found


def clauses(sentence):
    """Without what is said about each: "4.1.2: the order; 4.1.4: the close" are "4.1.2" and "4.1.4"."""
    for number, clause in enumerate(sentence.split(';')):
        if number == 0 or re.match(rf'\s*(?:and )?(?:[Pp]rotocol |[Ss]ections? )?{NUMBER}\b', clause):
            yield clause.split(':')[0]


BEGINNING = re.compile(rf'(?:\b[Pp]rotocol,? (?:sections? )?|\b[Ss]ections? |\bprotocol\.md, )(?={NUMBER}(?![\w/]|\.\d))')
COMMENT = re.compile(rf'^[ \t]*(?://+|#+)[ \t]+(?={DOTTED}(?![\w/]|\.\d))', re.M)
SENTENCE = re.compile(r'.*?(?=\.(?:\s|$|")|"""|\n\s*\n|$)', re.S)
QUIRK = re.compile(r'\bQ(\d{1,2})\b(?: to Q(\d{1,2})\b)?')
LINK = re.compile(r'\bprotocol\.md#([\w\-]+)')


def citations(text, is_markdown=False):
    """(offset, citation) for all that a file cites."""
    flat = joined(text)
    if is_markdown:  # a heading ends a sentence, and there are no comments
        flat = re.sub(r'\n(?=#)', '\n\n', text)
    beginnings = [m.end() for m in BEGINNING.finditer(flat) if not re.search(r'\bRFC \d+,? *$', flat[:m.start()][-20:])]
    if not is_markdown:
        beginnings += [m.end() for m in COMMENT.finditer(text)]
    for start in beginnings:
        for clause in clauses(SENTENCE.match(flat, start).group()):
            for citation in read_list(clause):
                yield start, citation
    for match in QUIRK.finditer(flat):
        for citation in numbers('quirk', int(match.group(1)), match.group(2) and int(match.group(2))):
            yield match.start(), citation


def own_citations(text):
    """Those of the document itself, where a number with a point is a section unless something else is said."""
    plain = text
    for code_or_link in (r'(?ms)^```.*?^```', r'`[^`\n]*`', r'\]\([^)\n]*\)'):
        plain = re.sub(code_or_link, lambda m: re.sub(r'[^\n]', ' ', m.group()), plain)
    for match in re.finditer(rf'(?<![\w.\-/])(?<!TLS )(?<!HTTP )({DOTTED})(?!\.\d|[\w%/]| s\b| MB\b)(?:, steps? (\d+))?', plain):
        yield match.start(), ('section', match.group(1), match.group(2) and int(match.group(2)))
    for match in re.finditer(r'\b[Ss]ections? (\d{1,2})\b(?!\.\d)(?: and (\d{1,2})\b(?!\.\d))?', plain):
        for number in filter(None, match.groups()):
            yield match.start(), ('section', number, None)
    for match in QUIRK.finditer(plain):
        yield match.start(), ('quirk', int(match.group(1)), None)


def line_of(text, offset):
    return text.count('\n', 0, offset) + 1


def check(name, text, document, found):
    """Faults of one file; what it cites is appended to `found`."""
    own = name == DOCUMENT
    cited = own_citations(text) if own else citations(text, name.endswith('.md'))
    for offset, citation in sorted(cited, key=lambda pair: pair[0]):
        found.append(citation)
        if fault := document.lacks(citation):
            yield f'{name}:{line_of(text, offset)}: {fault} in {DOCUMENT}'
    for match in LINK.finditer(text):
        found.append(('anchor', match.group(1), None))
        if match.group(1) not in document.anchors:
            yield f'{name}:{line_of(text, match.start())}: there is no heading #{match.group(1)} in {DOCUMENT}'


def dead_links(document, read):
    """Of the document's relative links; `read` gives a file of the tree, or None."""
    for match in re.finditer(r'\]\((?!https?:)([^)#\s]*)(?:#([^)\s]*))?\)', document.text):
        target, anchor = match.groups()
        place = f'{DOCUMENT}:{line_of(document.text, match.start())}'
        text = document.text if not target else read(target)
        if text is None:
            yield f'{place}: there is no {target}'
        elif anchor and anchor not in anchors(text):
            yield f'{place}: {target or DOCUMENT} has no heading #{anchor}'


def self_test():
    """A check that finds nothing must be able to find something."""
    document = Document('# P\n## 4. S\n### 4.1 T\n#### 4.1.2 U\n1. a\n2. b\n3. c\n\n## 13. Ours\n```\n## 5. no\n```\n'
                        '| Q6 | a | b |\n| Q7 | a | b |\n| Q8 | a | b |\n[x](a.md#b) [y](#4-s) [z](c.md)\n')
    assert set(document.steps) == {'4', '4.1', '4.1.2', '13'} and document.quirks == {6, 7, 8}, vars(document)
    good = ['// Protocol section 4.1.2, steps 1 and 3, section 13 (forges), and quirks Q6 to Q8.',
            '// 4.1, Q7.',
            '# 4.1: a; 4.1.2 steps 2 to 3, 4.1: b.',
            '/// told (protocol\n/// section 4.1.2, step 3).',
            '"""Protocol sections 4, 4.1 and\n13. x 9.9"""',
            '// Protocol 4.1: status 200 for 99 of them, 5 times.',
            '// Protocol 4.1.2, in order: the forge (step 3), the policy (4)',
            '// Base64 (RFC 4648, section 5).',
            '// 10.0.0.0/8 is a network.',
            '[p](../docs/protocol.md#4-s)']
    bad = {'// Protocol section 5.': 1,
           '// Protocol sections 4.1 and 4.2, quirk Q9.': 2,
           '// 4.7, Q6.': 1,
           '// Protocol 4.1.2 step 4; quirks Q5 and Q7.': 2,
           '// Protocol 4.1: x; 9.1: y.': 1,
           '/// so (protocol section\n/// 4.3).': 1,
           '"""Protocol sections 4.1.2 (steps 2 to 5) and\n12."""': 3,
           'Quirks Q7 to Q10.': 2,
           'see docs/protocol.md, 4.9': 1,
           '[p](protocol.md#5-s)': 1}
    for text in good:
        assert not (faults := list(check('a.cpp', text, document, []))), (text, faults)
    for text, count in bad.items():
        faults = list(check('a.cpp', text, document, []))
        assert len(faults) == count, (text, faults)
    files = {'a.md': '# A\n', 'c.md': ''}
    assert len(list(dead_links(document, files.get))) == 1 and len(list(dead_links(document, {'a.md': '## B\n'}.get))) == 1
    assert len(list(check(DOCUMENT, 'See 4.1, 4.9, section 12, Q1; not TLS 1.3, 1.5 s or `9.9`.', document, []))) == 3


def files():
    yield from (p for p in ROOT.iterdir() if p.suffix in KINDS)
    for folder in FOLDERS:
        yield from (p for p in (ROOT / folder).rglob('*') if p.suffix in KINDS and p.is_file())


def main():
    self_test()

    def read(target):
        path = ROOT / 'docs' / target
        return path.read_text(errors='replace') if path.is_file() else '' if path.is_dir() else None

    document = Document((ROOT / DOCUMENT).read_text())
    cited = []
    faults = list(dead_links(document, read))
    for path in sorted(files()):
        name = str(path.relative_to(ROOT))
        if path != Path(__file__).resolve():
            faults += check(name, path.read_text(errors='replace'), document, cited)
    print('\n'.join(faults) or f'{len(cited)} citations of {DOCUMENT} lead somewhere')
    assert len(cited) >= MIN_CITATIONS, f'only {len(cited)} citations were found: are they written in a new way?'
    return 1 if faults else 0


if __name__ == '__main__':
    sys.exit(main())

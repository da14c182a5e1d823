#!/usr/bin/python3
"""Finds statements that g++ 12.2 is known to miscompile (HACKING.md, "Coroutines").

The compiler destroys some temporaries of a full-expression twice when the expression contains co_await. So, statement by
statement, these are refused:
  braces     f({...}) or Type{...} in a statement with co_await: name the value first, then move it in
  capture    a lambda with captures in such a statement: use a named function, or a named object
  ternary    a conditional operator with a co_await in it: use if and else
  spawn      a lambda with captures given to co_spawn: captures die with the statement, the coroutine does not
"""
import re
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
FOLDERS = ('include', 'src', 'apps', 'examples', 'tests')


def without_comments_and_strings(text):
    """The text with comments and literals blanked, so that line numbers stay."""
    pattern = re.compile(r'//[^\n]*|/\*.*?\*/|R"(\w*)\(.*?\)\1"|"(?:\\.|[^"\\\n])*"|\'(?:\\.|[^\'\\\n])\'', re.S)
    return pattern.sub(lambda m: re.sub(r'[^\n]', ' ', m.group()), text)


def opens_block(before):
    """True when a brace after this text begins or ends a block, not a value."""
    return not re.search(r'[\w>=,(]\s*$', before) or re.search(r'\b(const|override|noexcept|final|else|do|try)\s*$', before)


def statements(text):
    """(line, statement) for each piece between ; { and } at statement level."""
    start, depth = 0, 0
    for i, c in enumerate(text):
        if c in '([':
            depth += 1
        elif c in ')]':
            depth -= 1
        elif depth <= 0 and (c == ';' or (c in '{}' and opens_block(text[start:i]))):
            depth = 0
            piece = text[start:i]
            yield text.count('\n', 0, start + len(piece) - len(piece.lstrip())) + 1, piece.strip()
            start = i + 1


CAPTURING_LAMBDA = re.compile(r'(?<![\w\])])\[[^\[\]]+\]\s*(\([^)]*\))?[^;]*?\{')
BRACES = re.compile(r'[\w>(,]\s*\{')


def faults(statement):
    if 'co_await' in statement:
        after_return = re.sub(r'^\s*(for|while|if|switch)\b', '', statement)
        if re.search(r'\?[^:]*co_await|:\s*co_await', after_return) and '?' in after_return:
            yield 'ternary'
        if CAPTURING_LAMBDA.search(after_return):
            yield 'capture'
        elif BRACES.search(after_return):
            yield 'braces'
    if 'co_spawn' in statement and re.search(r'co_spawn\([^;]*?\[[^\]]+\]\s*\([^)]*\)[^;{]*->\s*[\w:]*awaitable', statement):
        yield 'spawn'


def check(path, text):
    return [f'{path}:{line}: {fault}: {" ".join(statement.split())[:100]}'
            for line, statement in statements(without_comments_and_strings(text)) for fault in faults(statement)]


def self_test():
    """A lint that finds nothing must be able to find something."""
    bad = {
        'braces': ['co_await f({1, 2});', 'auto x = co_await g(Request{"a"});'],
        'capture': ['co_await f([p] { g(p); });'],
        'ternary': ['auto x = b ? co_await f() : co_await g();'],
        'spawn': ['co_spawn(ex, [x]() -> awaitable<void> { co_return; }, tok);'],
    }
    for fault, examples in bad.items():
        for example in examples:
            found = [f for _, s in statements(example) for f in faults(s)] or list(faults(example))
            assert fault in found, (fault, example, found)
    for good in ('auto x = co_await f(std::move(request));', 'if (!co_await f()) { g({1}); }', 'auto v = std::vector{1, 2};'):
        assert not [f for _, s in statements(good) for f in faults(s)], good


def main():
    self_test()
    found = []
    for folder in FOLDERS:
        for path in sorted((ROOT / folder).rglob('*.[ch]pp')):
            found += check(path.relative_to(ROOT), path.read_text())
    print('\n'.join(found) or 'no statement that g++ 12.2 is known to miscompile')
    return 1 if found else 0


if __name__ == '__main__':
    sys.exit(main())

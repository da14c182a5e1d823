#!/usr/bin/python3
"""No class that users of the library can name is an aggregate (HACKING.md, "Coroutines", rule 1).

g++ 12 destroys what an aggregate was made of twice where the braces stand in a statement with `co_await`. A declared default constructor
(`X() = default;`) makes a class no aggregate, and that statement can't be written. The compiler says what is one.

Argument: the C++ compiler.
"""
import os
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
HEADERS = ROOT / 'include'
COMMENTS_AND_TEXTS = re.compile(r'//[^\n]*|/\*.*?\*/|"(?:[^"\\\n]|\\.)*"|\'(?:[^\'\\\n]|\\.)\'', re.S)
PREPROCESSOR = re.compile(r'^\s*#(?:[^\n]*\\\n)*[^\n]*', re.M)
# What opens a scope, or says who may name what follows.
TOKENS = re.compile(r'(?P<head>[^{};]*)(?P<mark>[{};])')
ACCESS = re.compile(r'\b(public|protected|private)\s*:(?!:)')
CLASS = re.compile(r'(?:^|[\s>])(struct|class)\s+(\w+)\s*(?:final\s*)?(?::[^:].*)?$', re.S)
NAMESPACE = re.compile(r'\bnamespace\s+(?:WEBOTS_CLOUD_API\s+)?([\w:]+)\s*$')


def public_classes(text):
    """The qualified names of the classes that a header defines and others may name; templates have no type to ask for."""
    scopes = []  # (name or None, is a class, nameable from outside)
    for token in TOKENS.finditer(PREPROCESSOR.sub('', COMMENTS_AND_TEXTS.sub('', text))):
        head, mark = token['head'], token['mark']
        for access in ACCESS.findall(head):
            if scopes and scopes[-1][1]:
                scopes[-1] = (scopes[-1][0], True, access == 'public')
        if mark == '}':
            scopes.pop()
        elif mark == '{':
            head = ACCESS.sub('', head).strip()
            namespace, found = NAMESPACE.search(head), None if re.search(r'\benum\b', head) else CLASS.search(head)
            if namespace:
                scopes.append((namespace[1], False, True))
            elif found and not head.startswith('template') and all(name and nameable for name, _, nameable in scopes):
                yield '::'.join([*(name for name, _, _ in scopes), found[2]])
                scopes.append((found[2], True, found[1] == 'struct'))
            else:
                scopes.append((None, False, False))  # a function, an enumeration, a template, braces of a value


def aggregates(compiler, names):
    """Those of the classes that are aggregates, and what else the compiler does not like about the question."""
    headers = sorted(str(path.relative_to(HEADERS)) for path in HEADERS.rglob('*.hpp'))
    lines = [*(f'#include <{header}>' for header in headers), '#include <type_traits>',
             *(f'static_assert(!std::is_aggregate_v<{name}>, "AGGREGATE {name}");' for name in names)]
    with tempfile.TemporaryDirectory() as folder:
        source = Path(folder) / 'public_values.cpp'
        source.write_text('\n'.join(lines))
        ran = subprocess.run([compiler, '-std=c++20', '-fsyntax-only', f'-I{HEADERS}', str(source)], capture_output=True, text=True,
                             env=dict(os.environ, LC_ALL='C'))
    found = re.findall(r'error: .*AGGREGATE ([\w:]+)', ran.stderr)
    others = [line for line in ran.stderr.splitlines() if 'error: ' in line and 'AGGREGATE' not in line]
    assert (ran.returncode == 0) == (not found and not others), ran.stderr
    return found, others


SAMPLE = """
namespace WEBOTS_CLOUD_API a::b {
struct Plain { int x = 0; }; // struct Commented { }
class Kept { struct Hidden {}; public: struct Shown { int y; }; private: struct Other {}; };
struct Derived final : Plain {};
template<class T> struct Any { struct Inner {}; };
inline void f() { struct Local {}; }
enum class E { one };
struct Declared;
}
"""


def main():
    if len(sys.argv) < 2 or not shutil.which(sys.argv[1]):
        print('skipped: the first argument must be the C++ compiler')
        return 77
    assert list(public_classes(SAMPLE)) == ['a::b::Plain', 'a::b::Kept', 'a::b::Kept::Shown', 'a::b::Derived'], \
        list(public_classes(SAMPLE))
    assert aggregates(sys.argv[1], ['std::true_type', 'webots_cloud::Failure'])[0] == ['std::true_type'], 'the compiler finds none'
    names = [name for path in sorted(HEADERS.rglob('*.hpp')) for name in public_classes(path.read_text())]
    assert len(names) > 50 and len(names) == len(set(names)), names
    found, others = aggregates(sys.argv[1], names)
    print('\n'.join([*(f'{name} is an aggregate: declare "{name.rpartition("::")[2]}() = default;" (HACKING.md, "Coroutines")'
                       for name in found), *others]) or f'{len(names)} classes are no aggregates')
    return 1 if found or others else 0


if __name__ == '__main__':
    sys.exit(main())

#!/usr/bin/python3
"""Structs of parameters, configurations and facts hold values only, so that they can be copied, compared and read from files. What a part
calls (functions, other parts) is an argument of its constructor; optional ones are a struct whose name ends in Hooks."""
import re
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
STRUCT = re.compile(r'^(?:struct|class) (\w+(?:Params|Config|Facts))\b[^;{]*\{(.*?)^\};', re.M | re.S)
COLLABORATOR = re.compile(r'std::function\b|_ptr<|std::reference_wrapper\b|[\w>]\s*[&*]\s*[A-Za-z_]\w*\s*;')


def complaints(text):
    """(struct, member) for each collaborator."""
    for name, body in STRUCT.findall(text):
        for member in re.sub(r'//[^\n]*', '', body).split('\n'):
            assigned = member.split('=')[0] + ';'
            if COLLABORATOR.search(assigned) and '(' not in member.split('std::function')[0]:
                yield name, member.strip()


def main():
    for bad in ('std::function<void()> tell;', 'std::shared_ptr<Logs> logs;', 'Logs* logs = nullptr;', 'Logs& logs;'):
        assert list(complaints(f'struct XParams\n{{\n    XParams() = default;\n\n    {bad}\n}};\n')), bad
    good = 'struct XParams\n{\n    XParams() = default;\n\n    int a = 2 * b;\n    std::optional<int> c; ///< Of d & e;\n};\n'
    assert not list(complaints(good))
    headers = sorted((ROOT / 'include').rglob('*.hpp'))
    structs = sum(len(STRUCT.findall(path.read_text())) for path in headers)
    assert structs > 15, 'the checkout has lost its parameters'
    found = [f'{path.relative_to(ROOT)}: {name}: {member}' for path in headers for name, member in complaints(path.read_text())]
    print('\n'.join(found) or f'{structs} structs of parameters hold values only')
    return 1 if found else 0


if __name__ == '__main__':
    sys.exit(main())

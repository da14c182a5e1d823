#!/usr/bin/python3
"""In public headers each contract begins a line of its own, where who embeds the library finds it, and belongs to what follows it;
and a shared library exports what they declare."""
import re
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
CONTRACT = r'(?:Lifetime|Errors|Cancellation|Thread-safety|Thread|Precondition|Contract): '


def complaints(text):
    """Lines, counted from 1, with what is wrong there."""
    lines = text.split('\n')
    found = []
    for number, line in enumerate(lines, 1):
        comment = re.match(r'\s*///(?!<)(.*)$', line)
        if comment and re.search(r'\S.*\b' + CONTRACT, comment[1]):
            found.append((number, 'a contract in the middle of a line'))
        if re.search(r'//.*[.;`]\s+' + CONTRACT, line) and not comment:
            found.append((number, 'a contract in a remark behind code'))
        if line.startswith('namespace webots_cloud {'):
            found.append((number, 'what it declares is hidden: namespace WEBOTS_CLOUD_API webots_cloud'))
        if comment and number < len(lines):
            below = lines[number].strip()
            if not below or below.startswith('}'):
                found.append((number, 'it stands above nothing'))
    return found


def main():
    for bad in ('/// Runs.   Errors: none.', 'int a; ///< One.   Lifetime: long.', '/// Runs.\n\nvoid run();', 'namespace webots_cloud {'):
        assert complaints(bad), bad
    good = '/// Runs.\n///\n/// Errors: none.\n/// Thread-safety: none.\nvoid run();'
    assert not complaints(good), good
    headers = sorted((ROOT / 'include').rglob('*.hpp'))
    assert len(headers) > 30, 'the checkout has lost its headers'
    found = [f'{path.relative_to(ROOT)}:{number}: {what}' for path in headers for number, what in complaints(path.read_text())]
    print('\n'.join(found) or f'{len(headers)} public headers say their contracts on lines of their own')
    return 1 if found else 0


if __name__ == '__main__':
    sys.exit(main())

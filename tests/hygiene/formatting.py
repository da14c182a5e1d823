#!/usr/bin/python3
"""Every C++ file is as clang-format 14 leaves it: a change is never more than what it says."""
import shutil
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
FORMATTER = 'clang-format-14'  # others format differently
FOLDERS = ('include', 'src', 'apps', 'examples', 'tests')


def files():
    return sorted(str(p) for f in FOLDERS for p in (ROOT / f).rglob('*.[ch]pp'))


def complaints(paths):
    """What clang-format would change: a line for each place."""
    ran = subprocess.run([FORMATTER, '--dry-run', '--style=file', *paths], cwd=ROOT, capture_output=True, text=True, check=True)
    return [line for line in ran.stderr.splitlines() if 'clang-format-violations' in line]


def main():
    if not shutil.which(FORMATTER):
        print(f'skipped: {FORMATTER} is not installed')
        return 77
    paths = files()
    assert len(paths) > 50, 'the checkout has lost its sources'
    found = complaints(paths)
    print('\n'.join(line.replace(f'{ROOT}/', '') for line in found) or f'{len(paths)} files are formatted')
    if found:
        print(f'Run: git ls-files "*.cpp" "*.hpp" | xargs {FORMATTER} -i')
    return 1 if found else 0


if __name__ == '__main__':
    sys.exit(main())

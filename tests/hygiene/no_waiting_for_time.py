#!/usr/bin/python3
"""Tests wait for the thing itself, not for time, and conclude nothing from how long something took (HACKING.md, "Where things go").

Found are calls that sleep; assertions about what a clock of durations said; and those that something times out, which is how one waits for
nothing to happen. Benchmarks may do all that: it is what they are for.
"""
import ast
import re
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]

# File -> why it may sleep.
ALLOWED = {
    'tests/support/waiting.py': 'polls with a deadline, for all other tests',
    'tests/support/proxy.py': 'is a network with a latency',
    'tests/unit/adapters/network/network_fixture.hpp': 'polls with a deadline, for the unit tests of HTTP',
    'tests/viewer/fake_cloud.py': 'is a simulator that makes so many pictures a second',
    'tests/integration/waiting_room_test.py': 'is thirty people who come one after the other and stay for a while, and looks how long seats are free',
    'tests/integration/torture_test.py': 'chooses the moments of faults at random; whatever the moment, nothing may be left',
}

CLOCKS = {'monotonic', 'monotonic_ns', 'perf_counter', 'perf_counter_ns', 'process_time', 'thread_time'}
TIMEOUTS = {'TimeoutError', 'timeout'}
CPP_SLEEP = re.compile(r'\b(?:this_thread::sleep_(?:for|until)|usleep|nanosleep)\s*\(')
CPP_ASSERTION = re.compile(r'\bBOOST_(?:TEST|CHECK|REQUIRE)\w*\s*\((?:[^;"]|"(?:[^"\\]|\\.)*")*?\b(?:steady|high_resolution)_clock::now', re.S)


def name_of(function):
    """The last name of what is called."""
    return function.attr if isinstance(function, ast.Attribute) else function.id if isinstance(function, ast.Name) else ''


def sleeps(function):
    """True for `time.sleep`, `asyncio.sleep` and `sleep`; objects may have a method of that name."""
    owner = function.value if isinstance(function, ast.Attribute) else None
    return name_of(function) == 'sleep' and (owner is None or isinstance(owner, ast.Name) and owner.id in ('time', 'asyncio'))


def calls(tree):
    return (node for node in ast.walk(tree) if isinstance(node, ast.Call))


def knows_durations(tree, timed):
    """True when an expression asks a clock, or names what was made of its answer."""
    return any(name_of(call.func) in CLOCKS for call in calls(tree)) or \
        any(isinstance(node, ast.Name) and node.id in timed for node in ast.walk(tree))


def timed_names(tree):
    """The names in a function that stand for answers of a clock, or for what was made of them."""
    timed, before = set(), None
    while before != timed:
        before = set(timed)
        for node in ast.walk(tree):
            if isinstance(node, (ast.Assign, ast.AugAssign, ast.NamedExpr)) and knows_durations(node.value, timed):
                targets = node.targets if isinstance(node, ast.Assign) else [node.target]
                timed |= {part.id for target in targets for part in ast.walk(target) if isinstance(part, ast.Name)}
    return timed


def of_python(text):
    """(line, what is wrong), each once."""
    tree = ast.parse(text)
    found = {(call.lineno, 'sleeps') for call in calls(tree) if sleeps(call.func)}
    for function in (node for node in ast.walk(tree) if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef))):
        timed = timed_names(function)
        for node in ast.walk(function):
            asserts = isinstance(node, ast.Assert) or isinstance(node, ast.Call) and name_of(node.func).startswith('assert')
            if asserts and knows_durations(node, timed):
                found.add((node.lineno, 'asserts how long something took'))
    for call in calls(tree):
        if name_of(call.func) in ('assertRaises', 'assertRaisesRegex') and call.args and name_of(call.args[0]) in TIMEOUTS:
            found.add((call.lineno, 'waits for nothing to happen'))
    return sorted(found)


def of_cpp(text):
    found = [(match, 'sleeps') for match in CPP_SLEEP.finditer(text)]
    found += [(match, 'asserts how long something took') for match in CPP_ASSERTION.finditer(text)]
    return [(text.count('\n', 0, match.start()) + 1, what) for match, what in found]


def check_the_check():
    sample = '''
def f(self):
    began = time.monotonic()
    work()
    took = time.monotonic() - began
    self.assertLess(took, 3)
    assert time.perf_counter() < 5
    self.assertLess(other, 3)
    asyncio.sleep(1)
    with self.assertRaises(socket.timeout): pass
    with self.assertRaises(OSError): pass
'''
    assert [line for line, _ in of_python(sample)] == [6, 7, 9, 10], of_python(sample)
    sample = '\nstd::this_thread::sleep_for(1s);\nBOOST_TEST(std::chrono::steady_clock::now() - a < 1s);\nnow = std::chrono::steady_clock::now();'
    assert [line for line, _ in of_cpp(sample)] == [2, 3], of_cpp(sample)


def main():
    check_the_check()
    names = sorted(str(path.relative_to(ROOT)) for end in ('*.py', '*.[ch]pp') for path in (ROOT / 'tests').rglob(end))
    names = [name for name in names if not name.startswith('tests/bench/') and name != 'tests/hygiene/' + Path(__file__).name]
    assert len(names) > 100, 'the checkout has lost its tests'
    found = {name: (of_python if name.endswith('.py') else of_cpp)((ROOT / name).read_text()) for name in names}
    faults = [f'{name}:{line}: {what}: wait for the thing itself (tests/support/waiting.py)'
              for name, places in found.items() for line, what in places if not (name in ALLOWED and what == 'sleeps')]
    faults += [f'{name} need not be allowed to sleep: it does not' for name in ALLOWED
               if 'sleeps' not in (what for _, what in found.get(name, ()))]
    print('\n'.join(faults) or f'{len(names)} files wait for things, not for time')
    return 1 if faults else 0


if __name__ == '__main__':
    sys.exit(main())

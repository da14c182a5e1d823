"""Starts the demo simulator for a test and reads what it writes."""

import os
import queue
import subprocess
import sys
import threading
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), '..'))
from support.ports import free_port  # noqa: E402
from support.waiting import wait_until, wait_until_async  # noqa: E402, F401

PROJECTS = os.path.join(os.path.dirname(os.path.abspath(__file__)), '..', '..', 'examples', 'demo_projects')
ARENA = os.path.join(PROJECTS, 'robots', 'worlds', 'arena.wbt')
PATIENCE = 20  # seconds; long enough for a machine under load and for sanitizers

binary = None


class Simulator:
    """One process. `line()` and `lines_until()` read its stdout, `port` is where it listens."""

    def __init__(self, *options, world=ARENA, faults='', environment=None):
        env = dict(os.environ, WEBOTS_DEMO_ADDRESS='127.0.0.1', WEBOTS_DEMO_FAULTS=faults)
        env.update(environment or {})
        if not any(option.startswith(('--port', '--stream=port', '--stream="port')) for option in options):
            options += (f'--port={free_port()}',)
        self.command = [binary, '--batch', '--mode=pause', *options, *([world] if world else [])]
        self.process = subprocess.Popen(self.command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, env=env)
        self._lines = queue.Queue()
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()
        self._port = None
        self.seen = []

    def _read(self):
        with self.process.stdout:
            for line in self.process.stdout:
                self._lines.put(line)
        self._lines.put(None)

    def line(self):
        """The next line with its newline, as bytes; None at the end of stdout."""
        line = self._lines.get(timeout=PATIENCE)
        self.seen.append(line)
        if line and line.startswith(b'demo simulator: listening on port '):
            self._port = int(line.split()[-1])
        return line

    def lines_until(self, wanted):
        """Reads up to and including the line `wanted`; returns all that came before."""
        before = []
        while True:
            line = self.line()
            if line is None:
                raise AssertionError(f'{wanted!r} did not come; {self.seen!r}; {self.process.stderr.read()!r}')
            if line.rstrip(b'\n') == wanted:
                return before
            before.append(line)

    def has_line_now(self):
        return not self._lines.empty()

    @property
    def port(self):
        while self._port is None:
            if self.line() is None:
                raise AssertionError(f'no port; {self.seen!r}; {self.process.stderr.read()!r}')
        return self._port

    def ready(self):
        self.lines_until(b'.')
        return self

    def wait(self):
        return self.process.wait(timeout=PATIENCE)

    def end(self):
        if self.process.poll() is None:
            self.process.kill()
        self.process.wait()
        self.process.stderr.close()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.end()


def main():
    """Takes the binary from the first argument and runs the caller's tests."""
    global binary
    if len(sys.argv) < 2 or not os.path.exists(sys.argv[1]):
        print('skipped: the first argument must be the webots-demo-simulator binary')
        sys.exit(77)
    # The caller's module is __main__; this one is imported once under its own name.
    binary = os.path.abspath(sys.argv.pop(1))
    unittest.main(module='__main__')

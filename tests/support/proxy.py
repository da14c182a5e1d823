"""A proxy for TCP connections that counts round trips, and may add latency."""

import contextlib
import queue
import socket
import threading
import time


class Proxy:
    """Passes connections to a port of the loopback on from `port`.

    connections: how many were made. turns: how often a client spoke after it had been answered or for the first time; that is what
    costs a round trip, however many packets a question or an answer has. latency: seconds that a round trip takes longer.
    """

    def __init__(self, target, latency=0):
        self._target = target
        self._delay = latency / 2
        self._listener = socket.create_server(("127.0.0.1", 0))
        self._lock = threading.Lock()
        self._open = contextlib.ExitStack()
        self.port = self._listener.getsockname()[1]
        self.connections = 0
        self.turns = 0

    def __enter__(self):
        threading.Thread(target=self._accept, daemon=True).start()
        return self

    def __exit__(self, *_):
        self._listener.close()
        self._open.close()

    def _accept(self):
        while True:
            try:
                near, _ = self._listener.accept()
            except OSError:
                return
            far = socket.create_connection(("127.0.0.1", self._target))
            self.connections += 1
            speaker = [far]  # who spoke last
            for one, other in ((near, far), (far, near)):
                self._open.enter_context(one)
                one.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
                threading.Thread(target=self._pass_on, args=(one, other, speaker, near), daemon=True).start()

    def _pass_on(self, source, target, speaker, client):
        waiting = queue.SimpleQueue()

        def deliver():
            while True:
                due, data = waiting.get()
                time.sleep(max(0, due - time.monotonic()))
                try:
                    if not data:
                        target.shutdown(socket.SHUT_WR)
                        return
                    target.sendall(data)
                except OSError:
                    return

        threading.Thread(target=deliver, daemon=True).start()
        data = True
        while data:
            try:
                data = source.recv(1 << 18)
            except OSError:
                data = b""
            if data:
                with self._lock:
                    self.turns += source is client and speaker[0] is not client
                    speaker[0] = source
            waiting.put((time.monotonic() + self._delay, data))

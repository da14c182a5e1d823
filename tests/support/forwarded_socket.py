"""A port of this machine that leads to a Unix socket, as `ssh -L 8080:/run/.../simulation-2000.sock` makes one on the operator's machine."""

import contextlib
import shutil
import socket
import socketserver
import threading


class _Relay(socketserver.BaseRequestHandler):
    """One connection: HTTP requests that the server answers by closing it."""

    def handle(self):
        with socket.socket(socket.AF_UNIX) as server, contextlib.suppress(OSError):
            server.connect(self.server.path)
            threading.Thread(target=self._pass_on, args=(self.request, server), daemon=True).start()
            self._pass_on(server, self.request)

    @staticmethod
    def _pass_on(source, target):
        with contextlib.suppress(OSError):
            with source.makefile("rb", buffering=0) as reader, target.makefile("wb", buffering=0) as writer:
                shutil.copyfileobj(reader, writer)
            target.shutdown(socket.SHUT_WR)


class _Server(socketserver.ThreadingTCPServer):
    daemon_threads = True
    allow_reuse_address = True


@contextlib.contextmanager
def forwarded(path):
    """Yields the port."""
    with _Server(("127.0.0.1", 0), _Relay) as server:
        server.path = path
        thread = threading.Thread(target=server.serve_forever)
        thread.start()
        try:
            yield server.server_address[1]
        finally:
            server.shutdown()
            thread.join()

"""A server of Python's `http.server`, in a thread of its own while a `with` block lasts."""

import threading


class Served:
    """Subclasses make `server`, an `http.server.HTTPServer`."""

    server = None

    def __enter__(self):
        threading.Thread(target=self.server.serve_forever, daemon=True).start()
        return self

    def __exit__(self, *_):
        self.server.shutdown()
        self.server.server_close()

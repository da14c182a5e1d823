"""A registry of simulation servers as far as one of these sees it, webots.cloud for instance: something that takes their POST."""

import contextlib
import http.server
import threading
import urllib.parse


class Registry:
    """Keeps the form of each request, as lists of values by name; while `answers` is not set, no request is answered."""

    def __init__(self, silent=False, status=200):
        self.forms = []
        self.answers = threading.Event()
        if not silent:
            self.answers.set()
        registry = self

        class Handler(http.server.BaseHTTPRequestHandler):
            def do_POST(self):
                body = self.rfile.read(int(self.headers["Content-Length"])).decode()
                registry.forms.append(urllib.parse.parse_qs(body, keep_blank_values=True, strict_parsing=True))
                registry.answers.wait()
                with contextlib.suppress(ConnectionError):  # nobody waited for so long
                    self.send_response(status)
                    self.end_headers()
                    self.wfile.write(b"welcome\n")

            def log_message(self, *_):
                pass

        self.server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Handler)
        self.server.daemon_threads = True
        self.url = f"http://127.0.0.1:{self.server.server_address[1]}/ajax/server/setup.php"

    def __enter__(self):
        threading.Thread(target=self.server.serve_forever, daemon=True).start()
        return self

    def __exit__(self, *_):
        self.answers.set()
        self.server.shutdown()
        self.server.server_close()

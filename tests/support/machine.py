"""A simulation server as a session server sees it: it answers /load."""

import http.server
import threading


class Machine:
    """Answers `load` with `status`; polls wait while `answers` is not set."""

    def __init__(self, load="10.0", port=0, keep_alive=True, host="127.0.0.1"):
        self.load = load
        self.status = 200
        self.answers = threading.Event()
        self.answers.set()
        self.polls = []
        machine = self

        class Handler(http.server.BaseHTTPRequestHandler):
            protocol_version = "HTTP/1.1" if keep_alive else "HTTP/1.0"

            def do_GET(self):
                machine.polls.append((self.client_address, dict(self.headers)))
                machine.answers.wait()
                body = machine.load.encode()
                try:
                    self.send_response(machine.status)
                    self.send_header("Content-Length", str(len(body)))
                    self.end_headers()
                    self.wfile.write(body)
                except ConnectionError:
                    self.close_connection = True  # nobody waited for so long

            def log_message(self, *_):
                pass

        self.server = http.server.ThreadingHTTPServer((host, port), Handler)
        self.server.daemon_threads = True
        self.address = f"{host}:{self.server.server_address[1]}"
        self.thread = threading.Thread(target=self.server.serve_forever, daemon=True)

    def __enter__(self):
        self.thread.start()
        return self

    def __exit__(self, *_):
        self.answers.set()
        self.server.shutdown()
        self.server.server_close()

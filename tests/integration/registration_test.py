#!/usr/bin/python3
"""What a registry of simulation servers hears from one. Protocol section 11."""

import http.server
import os
import sys
import threading
import unittest
import urllib.parse

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
from support.servers import SimulationServer, main, wait_until  # noqa: E402


class Registry:
    """Answers every registration with 201, and keeps its fields."""

    def __enter__(self):
        self.heard = heard = []

        class Handler(http.server.BaseHTTPRequestHandler):
            def do_POST(self):
                form = self.rfile.read(int(self.headers["Content-Length"])).decode()
                heard.append(dict(urllib.parse.parse_qsl(form, keep_blank_values=True)))
                self.send_response(201)
                self.send_header("Content-Length", "0")
                self.end_headers()

            def log_message(self, *_):
                pass

        self.server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Handler)
        self.url = f"http://127.0.0.1:{self.server.server_port}/setup.php"
        threading.Thread(target=self.server.serve_forever, daemon=True).start()
        return self

    def __exit__(self, *_):
        self.server.shutdown()
        self.server.server_close()


class Registration(unittest.TestCase):
    def test_a_registry_is_told_at_the_start_and_when_sighup_changed_what_it_knows(self):
        public = {"server": "sim.example.org", "ssl": True, "portRewrite": True}
        with Registry() as registry, SimulationServer(notify=registry.url, shareIdleTime=50, **public) as simulation:
            wait_until(lambda: registry.heard, "no registration")
            simulation.reread(title="Lab 7")
            wait_until(lambda: "The configuration was read again" in simulation.log(), "no SIGHUP")
            simulation.reread(shareIdleTime=12.5, allowedRepositories=["https://github.com/a", "https://github.com/b"])
            wait_until(lambda: len(registry.heard) > 1, "no second registration")
            url = f"https://sim.example.org/{simulation.port}"
            self.assertEqual(registry.heard, [
                {"url": url, "shareIdleTime": "50", "allowedRepositories": ""},
                {"url": url, "shareIdleTime": "12.5", "allowedRepositories": "https://github.com/a,https://github.com/b"}])


if __name__ == "__main__":
    main()

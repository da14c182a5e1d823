"""A forward proxy for plain HTTP on the loopback, as `http_proxy` names one."""

import http.client
import http.server
import threading
import urllib.parse


class _Handler(http.server.BaseHTTPRequestHandler):
    protocol_version = "HTTP/1.1"

    def log_message(self, *_):
        pass

    def pass_on(self):
        self.server.asked.append(self.path)
        address = urllib.parse.urlsplit(self.path)
        body = self.rfile.read(int(self.headers.get("Content-Length") or 0))
        self.close_connection = True
        server = http.client.HTTPConnection(address.netloc, timeout=20)
        try:
            server.request(self.command, address._replace(scheme="", netloc="").geturl(), body,
                           {name: value for name, value in self.headers.items() if not name.startswith("Proxy-")})
            answer = server.getresponse()
            content = answer.read()
        except OSError as error:
            return self.send_error(502, str(error))
        finally:
            server.close()
        self.send_response(answer.status)
        for name, value in answer.getheaders():
            if name not in ("Transfer-Encoding", "Content-Length", "Connection"):
                self.send_header(name, value)
        self.send_header("Content-Length", str(len(content)))
        self.send_header("Connection", "close")
        self.end_headers()
        self.wfile.write(content)

    do_GET = do_POST = pass_on


class ForwardProxy:
    """url: what `http_proxy` has to be; asked: the addresses that it was asked for, as they were written."""

    def __enter__(self):
        self._server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), _Handler)
        self._server.asked = self.asked = []
        self.url = f"http://127.0.0.1:{self._server.server_address[1]}"
        threading.Thread(target=self._server.serve_forever, daemon=True).start()
        return self

    def __exit__(self, *_):
        self._server.shutdown()
        self._server.server_close()

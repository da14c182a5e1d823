"""A small Git LFS server on the loopback for tests: the batch API, and a store of objects.

    with LfsServer() as lfs, GitServer(lfs=lfs.port) as server:
        server.add_repository("owner", "robots", {"mesh.stl": lfs.pointer(content)})

The git server passes what is asked below `<repository>.git/info/lfs/` on to it. Objects are handed out, and taken from clients
that push, below `<its own address>/objects/`. What it answers can be changed, to what no good server says.
"""

import hashlib
import http.server
import json
import threading

MEDIA_TYPE = "application/vnd.git-lfs+json"


def digest(content):
    return hashlib.sha256(content).hexdigest()


def pointer_to(oid, size):
    """The pointer that git stores in place of a large file."""
    return f"version https://git-lfs.github.com/spec/v1\noid sha256:{oid}\nsize {size}\n"


class _Handler(http.server.BaseHTTPRequestHandler):
    protocol_version = "HTTP/1.1"
    wbufsize = 65536  # or each line of an answer waits for the client's word that it has got the one before
    disable_nagle_algorithm = True

    def log_message(self, *_):
        pass

    def do_GET(self):
        owner = self.server.owner
        owner.note("GET", self)
        oid = self.path.rpartition("/")[2].partition("?")[0]
        special = owner.answers.get(oid) or owner.answers.get("object")
        if special:
            return special(self)
        content = owner.objects.get(oid)
        self.answer(200, content) if content is not None else self.answer(404, b"")

    def do_POST(self):
        owner = self.server.owner
        body = self.rfile.read(int(self.headers["Content-Length"]))
        owner.note("POST", self)
        if not self.path.endswith("/objects/batch"):
            return self.answer(404, b"{}")
        owner.questions.append(json.loads(body))
        if "batch" in owner.answers:
            return owner.answers["batch"](self)
        self.answer(200, json.dumps(owner.batch(owner.questions[-1])).encode(), {"Content-Type": MEDIA_TYPE})

    def do_PUT(self):
        owner = self.server.owner
        content = self.rfile.read(int(self.headers["Content-Length"]))
        owner.note("PUT", self)
        oid = self.path.rpartition("/")[2]
        if digest(content) != oid:
            return self.answer(422, b"")
        owner.objects[oid] = content
        self.answer(200, b"")

    def answer(self, status, body, headers=None, length=None):
        """length: the length that the server claims, if not the real one."""
        self.send_response(status)
        for name, value in (headers or {}).items():
            self.send_header(name, value)
        self.send_header("Content-Length", str(len(body) if length is None else length))
        self.end_headers()
        self.wfile.write(body)
        if length is not None:
            self.close_connection = True

    def answer_for_ever(self, status=200):
        self.send_response(status)
        self.end_headers()
        self.close_connection = True
        while not self.server.owner.closing.is_set():
            self.wfile.write(b"x" * 65536)

    def say_nothing(self):
        """Waits until the server is closed."""
        self.server.owner.silent.set()
        self.server.owner.closing.wait(60)
        self.close_connection = True


class _Server(http.server.ThreadingHTTPServer):
    daemon_threads = True
    request_queue_size = 64

    def handle_error(self, *_):
        pass  # connections that a client cuts are what is tested


class LfsServer:
    """Its attributes are what it has and how it answers, to be changed by tests at any time, and what it was asked."""

    def __init__(self, host="127.0.0.1"):
        self.objects = {}  # content by digest
        self.answers = {}  # by digest, "object" for all of them, or "batch": a function of the handler, instead of a good answer
        self.headers = {}  # that clients are told to send with their request for an object
        self.actions = {}  # by digest: what is in the place of the actions of an answer
        self.requests = []  # (method, path, headers)
        self.questions = []  # of the batch API
        self.silent = threading.Event()
        self.closing = threading.Event()
        self._lock = threading.Lock()
        self._http = _Server((host, 0), _Handler)
        self._http.owner = self
        self.port = self._http.server_port
        self.url = f"http://{host}:{self.port}"
        threading.Thread(target=self._http.serve_forever, kwargs={"poll_interval": 0.02}, daemon=True).start()

    def close(self):
        self.closing.set()
        self._http.shutdown()
        self._http.server_close()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()

    def pointer(self, content):
        """Stores an object. Returns the pointer for the repository."""
        content = content.encode() if isinstance(content, str) else content
        self.objects[digest(content)] = content
        return pointer_to(digest(content), len(content))

    def reset(self):
        """Answers normally again, and forgets all requests."""
        self.answers.clear()
        self.headers.clear()
        self.actions.clear()
        self.requests.clear()
        self.questions.clear()
        self.silent.clear()

    def note(self, method, handler):
        with self._lock:
            self.requests.append((method, handler.path, dict(handler.headers)))

    def batch(self, question):
        """A valid answer, except for `actions`."""
        return {"transfer": "basic", "objects": [self._answer(question["operation"], each) for each in question["objects"]]}

    def _answer(self, operation, asked):
        oid, answer = asked["oid"], {"oid": asked["oid"], "size": asked["size"]}
        action = {"href": f"{self.url}/objects/{oid}", "header": self.headers, "expires_in": 3600}
        if oid in self.actions:
            answer.update(self.actions[oid])
        elif operation == "upload":
            if oid not in self.objects:
                answer["actions"] = {"upload": action}
        elif oid in self.objects:
            answer.update({"authenticated": True, "actions": {"download": action}})
        else:
            answer["error"] = {"code": 404, "message": "Object does not exist"}
        return answer

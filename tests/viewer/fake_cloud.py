"""A session server, a simulation server and a simulator in one thread, scripted by a test of the viewer page.

Each of the three listens on a port of its own of 127.0.0.1. As behind a proxy that rewrites ports to paths, each
also answers for the others below /1999/, /2000/ and /2001/.
"""

import asyncio
import http
import json
import os
import re
import sys
import threading

import websockets
from websockets.legacy import server as legacy  # the one that answers plain requests in old and new versions alike

import moving_picture

HERE = os.path.dirname(os.path.abspath(__file__))
WEB = os.path.join(HERE, "../../src/web")
QR_LIBRARY = os.path.join(HERE, "../../build/node/src/web/class/node_modules/qr/index.js")  # installed by ./test.sh
TYPES = {".json": "application/json", ".html": "text/html; charset=utf-8", ".css": "text/css", ".js": "text/javascript", ".svg": "image/svg+xml"}
ROLES = {"1999": "session", "2000": "simulation", "2001": "simulator"}
GOODBYE_SECONDS = 5
FRAME_SECONDS = 0.05
HEARTBEAT_SECONDS = 0.5
STEP_MS = 32


class FakeCloud:
    """What a test sets and sees. Everything below may be used from the test's thread."""

    def __init__(self):
        self.answer = None  # Text of /session; None: the address of the fake simulation server.
        self.reason = None  # Code of a refusal that goes with that text.
        self.defaults = None  # What pages take from the configuration; None: 404.
        self.worlds = None  # Of the gallery; None: 404.
        self.held = None  # Files whose path has this in it stay on their way.
        self.relays = False  # The session server answers its own address, and takes /client.
        self.place = None  # [ahead, least, most] of whoever comes to the line of that session server, as it says them; None: a machine is free.
        self.tickets = 0  # Of places in the line that it has given.
        self.launch = None  # Messages of the simulation server after "start"; None: the shortest good start.
        self.world = ["world:worlds/arena.wbt:worlds/arena.wbt"]  # The simulator's messages before it is loaded.
        self.multimedia = "multimedia: mjpeg pause "
        self.picture_headers = "Access-Control-Allow-Origin: *\r\n"  # Webots sends none, our gateways do.
        self.held_back = False  # A proxy in between keeps pictures, as whole answers that never end.
        self.strips_upgrade = False  # A proxy in front of the simulation server passes no WebSockets on.
        self.slow = False  # The network brings a quarter of the pictures; the others wait on the way.
        self.opened_streams = 0
        self.refused_pictures, self.asked_pictures = 0, 0  # So many requests for the pictures are answered 503.
        self.requests = []  # Paths asked of the session server.
        self.started = []  # "start" messages as received.
        self.programs = {}  # Of the project, by path below controllers/: pages with an editor may change them.
        self.saved = {}  # What they have made of them.
        self.lesson = None  # Of the world, as its file has it.
        self.save_error = None  # A sentence, which every save is answered with.
        self.compiles = None  # Folders of the controllers that are compiled; None: there is no compiler.
        self.compiled = {}  # What a page is told when it has one compiled, by folder; without it: nothing, and the test says it.
        self.compiling = []  # What pages have had compiled: [folder, what was saved until then].
        self.controls = []  # Texts from the page to the simulator.
        self.fetching = None  # Messages of the simulation server after a start that only fetches; None: it has the project at once.
        self.class_said = []  # Messages from the pages of a class: [number of the socket, message].
        self.class_answers = {}  # Messages that follow one of a page, by its name: {"join": [{"joined": {...}}]}.
        self.leases = 0  # Sockets open on /client now.
        self.farewells = []  # Close codes of sockets on /client.
        self.keeps = False  # The simulation goes on where it was when a page connects again.
        self.heartbeats = False  # Sent every half a second on /client.
        self.mute = set()  # Roles that say nothing any more, and read nothing, on connections that stay open.
        self._streaming = set()
        self._dead = set()  # Streams that stay open, and on which nothing comes any more.
        self._sockets = {"session": set(), "simulation": set(), "simulator": set(), "class": set(), "line": set()}
        self._class_sockets = []  # By their numbers.
        self._available = "1"
        self._mode, self._time = "pause", 0
        self._frames = moving_picture.frames(40)
        self._loop = asyncio.new_event_loop()
        self._thread = threading.Thread(target=self._loop.run_forever, daemon=True)

    def __enter__(self):
        self._thread.start()
        self._servers = {}
        self.ports = {}
        for role in ROLES.values():
            self.open(role)
        return self

    def __exit__(self, *_):
        for role in list(self._servers):
            self.shut(role)
        self._loop.call_soon_threadsafe(self._loop.stop)
        self._thread.join()
        self._loop.close()

    @property
    def streams(self):
        """The number of pictures being streamed now."""
        return len(self._streaming)

    @property
    def dead_streams(self):
        return len(self._dead & self._streaming)

    @property
    def page(self):
        return f"http://127.0.0.1:{self.ports['session']}/viewer/"

    def address(self, role):
        return f"ws://127.0.0.1:{self.ports[role]}"

    def open(self, role):
        """Listens for `role`: on a free port the first time, afterwards on the same port again."""
        self._servers[role] = self._run(self._listen(role, self.ports.get(role, 0)))
        self.ports[role] = self._servers[role].sockets[0].getsockname()[1]

    def shut(self, role):
        """Stops listening and closes every connection of `role`."""
        self._run(self._end_streams())  # Behind a rewriting proxy they belong to another role's port.
        self._run(self._stop(self._servers.pop(role)))

    def set_available(self, value):
        self._available = value
        self.send("session", value)

    def send(self, role, text):
        """Sends `text` on every open socket of `role`."""
        self._run(self._send(role, text))

    @property
    def line(self):
        """The number of browsers on /client of the session server."""
        return len(self._sockets["line"])

    def move(self, ahead, least="-", most="-"):
        """Everybody in the line has this place from now on."""
        self.place = [ahead, least, most]
        self.send("line", self._waiting())

    def take_turn(self):
        """A machine is free, for everybody in the line."""
        self.place = None
        for text in ["loading: A machine is free.", *self._start("")]:
            self.send("line", text)

    def _waiting(self):
        return "waiting: " + " ".join(str(each) for each in self.place)

    def tell_class(self, message, number=None):
        """Sends `message` to the page of a class on the socket of this number, or to all."""
        self._run(self._tell_class(json.dumps(message), number))

    def close(self, role, code=1000):
        """Closes every open socket of `role` and goes on listening."""
        self._run(self._close(role, code))

    def drop(self, role):
        """Breaks every connection of `role`, without a word, and goes on listening."""
        self._run(self._drop(role))

    def kill_streams(self):
        """Nothing comes any more on those that are open, as after a network was down for long. They stay open."""
        self._dead |= self._streaming

    def _run(self, coroutine):
        return asyncio.run_coroutine_threadsafe(coroutine, self._loop).result(20)

    async def _listen(self, role, port):
        server = self

        class Protocol(legacy.WebSocketServerProtocol):
            async def process_request(self, path, headers):
                self.role, self.rest = split_path(path, role)
                if (self.role, self.rest) == ("session", "/class") and "Upgrade" in headers:
                    self.role = "class"
                if server.relays and (self.role, self.rest) == ("session", "/client"):
                    self.role = "line"
                return await server._serve_file(self, headers)

        return await legacy.serve(self._talk, "127.0.0.1", port, create_protocol=Protocol,
                                      compression=None, ping_interval=None)

    async def _end_streams(self):
        while self._streaming:
            for transport in list(self._streaming):
                transport.abort()
            await asyncio.sleep(FRAME_SECONDS)

    @staticmethod
    async def _stop(server):
        """A page that is kept for the button Back may answer no goodbye any more."""
        server.close()
        closed = asyncio.ensure_future(server.wait_closed())
        await asyncio.wait([closed], timeout=GOODBYE_SECONDS)
        for socket in list(server.websockets):
            socket.transport.abort()
        await closed

    async def _send(self, role, text):
        for socket in list(self._sockets[role]):
            if role not in self.mute:
                await socket.send(text)

    async def _tell_class(self, text, number):
        for socket in list(self._sockets["class"]):
            if number is None or socket is self._class_sockets[number]:
                await socket.send(text)

    async def _close(self, role, code):
        for socket in list(self._sockets[role]):
            await socket.close(code)

    async def _drop(self, role):
        for socket in list(self._sockets[role]):
            socket.transport.abort()

    async def _talk(self, socket, _path):
        self._sockets[socket.role].add(socket)
        try:
            await getattr(self, f"_talk_{socket.role}")(socket)
        except websockets.ConnectionClosed:
            pass
        finally:
            self._sockets[socket.role].discard(socket)

    async def _talk_session(self, socket):
        await socket.send(self._available)
        async for _ in socket:
            pass

    async def _talk_line(self, socket):
        try:
            async for message in socket:
                self.started.append(message)
                for text in self._start_in_line(message):
                    if "line" not in self.mute:
                        await socket.send(text)
        finally:
            self.farewells.append(socket.close_code)

    def _start_in_line(self, message):
        if self.place is None:
            return self._start(message)
        self.tickets += 1
        return [f"waitingTicket: ticket-{self.tickets}", self._waiting()]

    async def _talk_class(self, socket):
        number = len(self._class_sockets)
        self._class_sockets.append(socket)
        async for text in socket:
            message = json.loads(text)
            self.class_said.append([number, message])
            answers = {"check": [{"checked": message.get("check")}], **self.class_answers}  # a class with any code, if nothing else is said
            for answer in answers.get(next(iter(message)), []):
                await socket.send(json.dumps(answer))

    async def _talk_simulation(self, socket):
        self.leases += 1
        beating = asyncio.ensure_future(self._beat(socket))
        try:
            async for message in socket:
                answer = self._about_program(json.loads(message))
                if answer is None:
                    self.started.append(message)
                for line in self._start(message) if answer is None else filter(None, [answer]):
                    if "simulation" not in self.mute:
                        await socket.send(line)
        finally:
            beating.cancel()
            self.leases -= 1
            self.farewells.append(socket.close_code)

    def _start(self, message):
        if '"fetch_only":true' in message:
            return self.fetching if self.fetching is not None else ["fetched:"]
        return self.launch if self.launch is not None else self.good_start()

    def _about_program(self, message):
        """The answer to a message of an editor, "": none yet; None: it is of something else."""
        for key, texts in (("read", self.programs | self.saved), ("original", self.programs)):
            if key in message:
                return "file: " + json.dumps({"path": message[key], "text" if key == "read" else key: texts[message[key]]})
        if "reset controller" in message:
            self.saved.pop(message["reset controller"], None)
            return f"reset controller: {message['reset controller']}"
        if "compile" in message:
            return self._compile(message["compile"])
        if "write" not in message:
            return None
        path, text = message["write"]["path"], message["write"]["text"]
        if self.save_error is not None:
            return "file: " + json.dumps({"path": path, "error": self.save_error, "code": "not-saved", "values": {}})
        self.saved[path] = text
        return "file: " + json.dumps({"path": path, "saved": True})

    def _compile(self, folder):
        self.compiling.append([folder, dict(self.saved)])
        answer = self.compiled.get(folder)
        return "" if answer is None else "compiled: " + json.dumps({"controller": folder, **answer})

    async def _beat(self, socket):
        while True:
            if self.heartbeats and "simulation" not in self.mute:
                await socket.send(".")
            await asyncio.sleep(HEARTBEAT_SECONDS)

    def good_start(self):
        promise = ["heartbeat: 1"] if self.heartbeats else []
        files = [{"path": path, "changed": path in self.saved} for path in self.programs]
        programs = ["files: " + json.dumps(files)] if files else []
        if self.compiles is not None:
            programs.append("compiles: " + json.dumps(self.compiles))
        if self.lesson is not None:
            programs.append("lesson: " + json.dumps(self.lesson))
        return [*promise, "shutdownTimeout: 7200", f"webots:{self.address('simulator')}", *programs]

    async def _talk_simulator(self, socket):
        async for message in socket:
            if "simulator" in self.mute:
                continue
            self.controls.append(message)
            for line in self._answers(message):
                await socket.send(line)

    def _answers(self, message):
        if message.startswith("mjpeg: "):
            if not self.keeps:
                self._mode, self._time = "pause", 0
            state = f"pause: {self._time}" if self._mode == "pause" else self._mode
            return [self.multimedia, state, *self.world, "scene load completed"]
        verb = message.split(":")[0]
        if verb in ("real-time", "fast"):
            self._mode = verb
            return [verb]
        if verb in ("pause", "step"):
            self._mode = "pause"
            self._time += STEP_MS if verb == "step" else 0
            return [f"time: {self._time}", "paused by client"]
        if verb == "reset":
            self._time = 0
            return ["reset finished"]
        return []

    async def _serve_file(self, protocol, headers):
        if protocol.role == "simulator" and protocol.rest == "/mjpeg":
            self.asked_pictures += 1
            if self.asked_pictures <= self.refused_pictures:
                return respond(503, "text/plain", b"later")
            return await self._stream(protocol.transport)
        if protocol.role == "simulation" and self.strips_upgrade:
            return respond(400, "text/html", b'Can "Upgrade" only to "WebSocket".')
        if headers.get("Upgrade", "").lower() == "websocket":
            return None
        if protocol.role != "session":
            return respond(404, "text/plain", b"")
        self.requests.append(protocol.rest)
        while self.held is not None and self.held in protocol.rest and not protocol.transport.is_closing():
            await asyncio.sleep(FRAME_SECONDS)
        return self._session_file(protocol.rest.split("?")[0])

    def _session_file(self, path):
        if path == "/session":
            own = self.address("session" if self.relays else "simulation")
            text = self.answer if self.answer is not None else own
            reason = () if self.reason is None else [("Webots-Reason", self.reason), ("Access-Control-Expose-Headers", "Webots-Reason")]
            return respond(200, "text/html; charset=UTF-8", text.encode(), reason)
        if path == "/class/defaults.json" and self.defaults is not None:
            return respond(200, "application/json", json.dumps(self.defaults).encode())
        if path == "/viewer/worlds/list.json" and (self.worlds is not None or self.defaults is not None):
            return respond(200, "application/json", json.dumps({"worlds": self.worlds or [], "site": self.defaults or {}}).encode())
        file = page_file(path)
        if not os.path.isfile(file):
            return respond(404, "text/plain", b"not found")
        with open(file, "rb") as content:
            return respond(200, TYPES[os.path.splitext(file)[1]], content.read())

    async def _stream(self, transport):
        self._streaming.add(transport)
        self.opened_streams += 1
        waiting, ticks = [], 0
        transport.write(b"HTTP/1.0 200 OK\r\nServer: Webots\r\nConnection: close\r\nCache-Control: no-cache, private\r\n" +
                        self.picture_headers.encode() +
                        b"Content-Type: multipart/x-mixed-replace; boundary=WebotsFrame\r\n\r\n")
        try:
            while not transport.is_closing():
                if "simulator" in self.mute or transport in self._dead:
                    await asyncio.sleep(FRAME_SECONDS)
                    continue
                if self._mode != "pause":
                    self._time += STEP_MS
                    await self._send("simulator", f"time: {self._time}")
                frame = self._frames[self._time // STEP_MS % len(self._frames)]
                waiting += [part(frame)] * (2 if self._mode == "pause" else 1)  # Browsers show a part when the next one starts.
                ticks += 1
                if not self.held_back and (not self.slow or ticks % 4 == 0):
                    transport.write(waiting.pop(0) if self.slow else b"".join(waiting))
                    if not self.slow:
                        waiting.clear()
                await asyncio.sleep(FRAME_SECONDS)
        except websockets.ConnectionClosed:
            pass
        finally:
            self._streaming.discard(transport)
            transport.abort()
        return respond(200, "text/plain", b"")


def page_file(path):
    """The file that the session server has at this path; one that is not there for others."""
    if path == "/class/qr.js":
        return QR_LIBRARY
    if re.fullmatch(r"/class/[^./]*", path):  # A code, or none.
        return os.path.join(WEB, "class/index.html")
    if path in ("/class/base.css", "/class/page.css", "/class/favicon.svg"):
        path = path.replace("class", "viewer")
    name = re.fullmatch(r"/(?:(?:viewer|class)/(?=view/))?(viewer/|class/|view/(?:texts/)?)([a-z0-9_]*\.?[a-z]*)", path)
    return os.path.join(WEB, name[1] + (name[2] or "index.html") if name else "none")


def split_path(path, role):
    """'/2001/mjpeg' is the simulator's '/mjpeg'; a path without a known port belongs to the port's own role."""
    prefix = re.match(r"/(\d+)(/.*)", path)
    return (ROLES[prefix[1]], prefix[2]) if prefix and prefix[1] in ROLES else (role, path)


def part(frame):
    return b"--WebotsFrame\r\nContent-Type: image/png\r\nContent-Length: %d\r\n\r\n%s\r\n" % (len(frame), frame)


def respond(status, content_type, body, more_headers=()):
    headers = [("Content-Type", content_type), ("Access-Control-Allow-Origin", "*"), ("Connection", "close"),
               ("Content-Length", str(len(body))), *more_headers]
    return http.HTTPStatus(status), headers, body


def serve():
    """For tests in other languages: a question a line on standard input, as JSON, and its answer on standard output.

    {"new": true} begins anew with fresh servers; {"get": name}, {"set": name, "to": value} and {"call": name, "with": [...]} use the
    members of FakeCloud. An answer is {"value": ...} or {"error": ...}.
    """
    cloud = FakeCloud().__enter__()
    for line in sys.stdin:
        question = json.loads(line)
        try:
            value = None
            if "new" in question:
                cloud.__exit__()
                cloud = FakeCloud().__enter__()
            elif "get" in question:
                value = getattr(cloud, question["get"])
            elif "set" in question:
                setattr(cloud, question["set"], question["to"])
            else:
                value = getattr(cloud, question["call"])(*question["with"])
            answer = {"value": value}
        except Exception as error:  # the test has to know
            answer = {"error": repr(error)}
        print(json.dumps(answer), flush=True)
    cloud.__exit__()


if __name__ == "__main__":
    serve()

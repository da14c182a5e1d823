#!/usr/bin/python3
"""A class on a real session server, over raw WebSockets (protocol section 13.15)."""

import base64
import contextlib
import json
import os
import socket
import struct
import subprocess
import sys
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(__file__), ".."))
from support.machine import Machine  # noqa: E402
from support.raw_websocket import HANDSHAKE, connect, frame, read_head  # noqa: E402
from support.servers import PATIENCE, SessionServer, main, wait_until  # noqa: E402

PASSWORD = "abcd-efgh-jkmn"
WORLD = "https://example.org/o/r/blob/main/worlds/a.wbt"
SEATS = 5
FRAME = b"\xff\xd8\xff\xc0\x00\x0b\x08\x00\x78\x00\xa0\x01\x01\x11\x00"  # of a JPEG of 160x120 pixels
JPEG = base64.b64encode(FRAME + b"x" * 985).decode()
NONE_FREE = "Error: no simulation server available at the moment."


class Browser:
    """One end of the WebSocket /class."""

    def __init__(self, server, address=None, small_window=False):
        self.socket = socket.socket() if small_window else connect(server)
        if small_window:  # what is not read then waits at the server
            self.socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
            self.socket.settimeout(PATIENCE)
            self.socket.connect(("127.0.0.1", server.port))
        handshake = HANDSHAKE.format(path="/class")
        if address:  # as a proxy on this machine says it
            handshake = handshake.replace("\r\n\r\n", f"\r\nX-Forwarded-For: {address}\r\n\r\n")
        self.socket.sendall(handshake.encode())
        head = read_head(self.socket)
        assert head.startswith(b"HTTP/1.1 101 "), head
        self.close_code = None

    def close(self):
        self.socket.close()

    def send(self, message):
        text = message if isinstance(message, (str, bytes)) else json.dumps(message)
        data = text.encode() if isinstance(text, str) else text
        if len(data) < 126:
            self.socket.sendall(frame(0x81, data))
        else:
            self.socket.sendall(b"\x81" + struct.pack("!BQ", 0xff, len(data)) + b"\0\0\0\0" + data)

    def _take(self, size):
        data = b""
        while len(data) < size:
            part = self.socket.recv(size - len(data))
            if not part:
                raise EOFError
            data += part
        return data

    def receive(self):
        """The next message; None: the server has closed."""
        while True:
            try:
                first, size = self._take(2)
                if size == 126:
                    size, = struct.unpack("!H", self._take(2))
                elif size == 127:
                    size, = struct.unpack("!Q", self._take(8))
                data = self._take(size)
            except (EOFError, ConnectionResetError):
                return None
            if first == 0x88:
                self.close_code = struct.unpack("!H", data[:2])[0] if data else 0
                return None
            if first == 0x81:
                return json.loads(data)

    def ask(self, message):
        self.send(message)
        return self.receive()

    def until(self, key):
        """The value of the next message with this key; others before it are left out."""
        while True:
            message = self.receive()
            assert message is not None, f"closed with {self.close_code} before {key}"
            if key in message:
                return message[key]


def opening(password=PASSWORD, seats=SEATS):
    return {"teach": {"password": password, "world": WORLD, "mode": "mjpeg", "seats": seats}}


class OneServer(unittest.TestCase):
    config = {}

    def setUp(self):
        self.stack = contextlib.ExitStack()
        self.addCleanup(self.stack.close)
        report = {"load": 10.0, "sessions": 0, "starting": 0, "capacity": SEATS, "memory": 10.0, "arrivals": 0, "failed": 0, "departures": 0,
                  "version": "1"}
        self.machine = self.stack.enter_context(Machine(json.dumps(report)))
        self.server = self.stack.enter_context(SessionServer([self.machine.address], **{"teacherPassword": PASSWORD, **self.config}))
        wait_until(lambda: self.server.get("/") == "1", "the machine has not reported")

    def browser(self, address=None):
        return self.stack.enter_context(contextlib.closing(Browser(self.server, address)))

    def open_class(self, seats=SEATS):
        teacher = self.browser()
        answer = teacher.ask(opening(seats=seats))
        self.assertIn("class", answer)
        return teacher, answer["class"]

    def join(self, code, name):
        student = self.browser()
        answer = student.ask({"join": {"code": code, "name": name}})
        self.assertIn("joined", answer)
        self.assertIsNone(student.until("pictures"))
        return student, answer["joined"]

    def figure(self, name):
        return next(line.split()[-1] for line in self.server.get("/metrics").splitlines() if line.startswith(name + " "))


class Lesson(OneServer):
    def test_a_lesson_from_its_beginning_to_its_end(self):
        teacher, opened = self.open_class()
        self.assertEqual(opened["reserved"], SEATS)
        self.assertEqual(opened["machines"], ["ws://" + self.machine.address])
        self.assertEqual(opened["students"], [])
        self.assertEqual(self.server.get("/session"), NONE_FREE, "the seats are held")

        ada, joined = self.join(opened["code"].lower(), "<b>Ada</b>")
        self.assertEqual((joined["name"], joined["world"], joined["mode"]), ("<b>Ada</b>", WORLD, "mjpeg"))
        self.assertEqual(teacher.until("student"), {"id": 1, "name": "<b>Ada</b>", "state": "joined", "time": 0})
        self.assertEqual(self.server.get(f"/session?url=x&class={joined['seat']}"), "ws://" + self.machine.address)
        self.assertEqual(self.server.get("/session?class=guessed"), NONE_FREE)
        self.assertEqual(self.server.get(f"/session?class={joined['token']}"), NONE_FREE)
        self.assertEqual(self.figure("webots_class_seats_held"), str(SEATS - 1))

        here, elsewhere = "ws://127.0.0.1:2001", "ws://127.0.0.1:1999/session?url=" + WORLD
        ada.send({"state": {"state": "running", "time": 64.5, "simulator": here}})
        self.assertEqual(teacher.until("student"), {"id": 1, "name": "<b>Ada</b>", "state": "running", "time": 64, "simulator": here})
        ada.send({"state": {"state": "running", "time": 96, "simulator": elsewhere}})
        self.assertNotIn("simulator", teacher.until("student"))

        ada.send({"picture": JPEG})  # nobody watches: it is dropped
        teacher.send({"watch": True})
        wanted = ada.until("pictures")
        self.assertLessEqual(wanted["bytes"], 4000)
        ada.send({"picture": JPEG})
        self.assertEqual(teacher.until("picture"), {"id": 1, "jpeg": JPEG})
        self.assertEqual(self.figure('webots_class_pictures_total{result="relayed"}'), "1")
        ada.send({"picture": "<script>"})
        ada.send({"picture": base64.b64encode(FRAME.replace(b"\x00\x78", b"\x3e\x80") + b"x" * 900).decode()})
        ada.send({"picture": base64.b64encode(FRAME + b"x" * 5000).decode()})
        teacher.send({"watch": False})
        self.assertIsNone(ada.until("pictures"))
        self.assertEqual(self.figure('webots_class_pictures_total{result="relayed"}'), "1")

        teacher.send({"tell": {"students": [1], "do": "pause"}})
        self.assertEqual(ada.until("do"), "pause")
        teacher.send({"tell": {"students": None, "do": "message", "text": "Look here."}})
        self.assertEqual(ada.receive(), {"do": "message", "text": "Look here."})

        bob, _ = self.join(opened["code"], "Bob")
        teacher.send({"tell": {"students": [2], "do": "remove"}})
        self.assertEqual(bob.until("closed"), "removed")
        self.assertIsNone(bob.receive())
        self.assertEqual(bob.close_code, 1000)
        self.assertEqual(teacher.until("gone"), 2)
        teacher.send({"code": "new"})
        code = teacher.until("code")
        self.assertEqual(self.browser().ask({"join": {"code": opened["code"], "name": "Bob"}})["error"], "code")
        self.join(code, "Cyd")

        teacher.send({"close": True})
        for each in (teacher, ada):
            self.assertEqual(each.until("closed"), "teacher")
            self.assertIsNone(each.receive())
            self.assertEqual(each.close_code, 1000)
        self.assertEqual(self.browser().ask({"join": {"token": joined["token"]}})["error"], "code")
        self.assertEqual(self.figure("webots_classes"), "0")
        self.assertEqual(self.figure("webots_class_students"), "0")

        log = self.server.log()
        for secret in ("Ada", "Bob", "Look here", PASSWORD, opened["code"], opened["key"], joined["token"], joined["seat"], WORLD):
            self.assertNotIn(secret, log)

    def test_a_lesson_flows(self):
        teacher, opened = self.open_class()
        guest = self.browser()
        self.assertEqual(guest.ask({"check": opened["code"].lower()}), {"checked": opened["code"]})
        self.assertEqual(guest.ask({"check": "222222"})["error"], "code")
        ada, joined = self.join(opened["code"], "Ada")
        self.assertEqual(teacher.until("student")["state"], "joined")
        self.assertEqual(ada.ask({"sign": "hand"}), {"sign": "hand"})
        self.assertEqual(teacher.until("student")["sign"], "hand")
        ada.send({"state": {"state": "waiting", "why": "busy", "ahead": 2}})
        waiting = teacher.until("student")
        self.assertEqual((waiting["sign"], waiting["why"], waiting["ahead"]), ("hand", "busy", 2))
        program = {"file": "drive/drive.py", "changed": True, "line": 12}
        ada.send({"state": {"state": "running", "program": program}})
        self.assertEqual(teacher.until("student")["program"], program)
        teacher.send({"tell": {"students": None, "do": "start"}})
        self.assertEqual(ada.until("do"), "start")

        other = WORLD.replace(".wbt", "_2.wbt")
        changed = {"world": other, "mode": "w3d"}
        teacher.send({"world": changed})
        self.assertEqual(teacher.until("world"), changed)
        self.assertNotIn("sign", teacher.until("student"))
        self.assertEqual(ada.until("sign"), "none")
        self.assertEqual(ada.until("world"), changed)
        bob, late = self.join(opened["code"], "Bob")
        self.assertEqual((late["world"], late["mode"]), (other, "w3d"))
        self.assertEqual(bob.ask({"world": changed})["error"], "message")
        self.assertEqual(self.browser().ask({"teach": {"key": opened["key"]}})["class"]["world"], other)

    def test_teachers_and_students_return(self):
        teacher, opened = self.open_class()
        ada, joined = self.join(opened["code"], "Ada")
        ada.close()
        self.assertEqual(teacher.until("student")["state"], "joined")
        self.assertEqual(teacher.until("student")["state"], "away")
        teacher.close()
        teacher = self.browser()
        again = teacher.ask({"teach": {"key": opened["key"]}})["class"]
        self.assertEqual((again["code"], [each["state"] for each in again["students"]]), (opened["code"], ["away"]))
        back = self.browser()
        self.assertEqual(back.ask({"join": {"token": joined["token"]}})["joined"], joined)
        self.assertEqual(teacher.until("student")["state"], "joined")
        other = self.browser()  # a second window
        self.assertEqual(other.ask({"join": {"token": joined["token"]}})["joined"], joined)
        self.assertIsNone(back.until("pictures"))
        self.assertIsNone(back.receive())
        self.assertEqual(back.close_code, 4001)
        other.send({"leave": True})
        self.assertEqual(teacher.until("gone"), 1)

    def test_another_password_after_sighup(self):
        teacher, opened = self.open_class()
        self.server.reread(teacherPassword="another one")
        wait_until(lambda: "was read again" in self.server.log(), self.server.log)
        self.assertEqual(self.browser().ask(opening())["error"], "password")
        self.assertIn("class", self.browser().ask(opening("another one")))
        self.assertIn("class", self.browser().ask({"teach": {"key": opened["key"]}}), "those that are open go on")
        teacher.send({"seats": 3})
        self.assertEqual(teacher.until("reserved"), 3)

    def test_a_teacher_whose_network_is_slow_gets_fewer_pictures_and_every_word(self):
        _, opened = self.open_class(seats=20)
        slow = self.stack.enter_context(contextlib.closing(Browser(self.server, small_window=True)))
        self.assertIn("class", slow.ask({"teach": {"key": opened["key"]}}))
        students = [self.join(opened["code"], f"Student {n}")[0] for n in range(20)]
        slow.send({"watch": True})
        large = base64.b64encode(FRAME + b"x" * 2700).decode()
        for student in students:
            self.assertIsNotNone(student.until("pictures"))
            student.send({"picture": large})
            student.send({"picture": large})

        def counts():
            return [int(self.figure(f'webots_class_pictures_total{{result="{result}"}}')) for result in ("relayed", "dropped")]

        wait_until(lambda: sum(counts()) == 40, counts)
        relayed, dropped = counts()
        self.assertGreater(relayed, 0)
        self.assertGreater(dropped, 0)
        students[-1].send({"state": {"state": "running"}})
        seen = 0
        while "running" not in json.dumps(message := slow.receive()):
            seen += "picture" in message
        self.assertEqual(seen, relayed)

    def test_when_the_server_stops_everybody_is_told(self):
        teacher, opened = self.open_class()
        ada, _ = self.join(opened["code"], "Ada")
        self.assertEqual(self.server.stop(), 0)
        for each in (teacher, ada):
            self.assertEqual(each.until("closed"), "server")
            self.assertIsNone(each.receive())
            self.assertEqual(each.close_code, 1001)


class Strangers(OneServer):
    def test_pages_of_other_sites_do_not_come_in(self):
        with connect(self.server) as page:
            page.sendall(HANDSHAKE.format(path="/class").replace("\r\n\r\n", "\r\nOrigin: https://evil.example\r\n\r\n").encode())
            self.assertTrue(read_head(page).startswith(b"HTTP/1.1 403 "))

    def test_what_makes_no_sense_is_refused_and_harms_nobody(self):
        teacher, opened = self.open_class()
        stranger = self.browser()
        for text in ("", "{", "[1]", "null", '{"close":true}', '{"seats":5}', '{"picture":"x"}', '{"what":1}', "[" * 5000,
                     '{"join":{"code":"222222"}}', json.dumps({"picture": "x" * 20_000})):
            self.assertEqual(stranger.ask(text)["error"], "message", text[:40])
        self.assertEqual(stranger.ask({"join": {"code": opened["code"], "name": "\u202eadA"}})["error"], "name")
        self.assertEqual(stranger.ask(opening(seats=101))["error"], "seats")
        self.assertEqual(stranger.ask({"teach": {"key": "0" * 32}})["error"], "code")
        self.assertEqual(teacher.ask(opening())["error"], "message")
        stranger.send("x" * 70_000)
        self.assertIsNone(stranger.receive())
        self.assertEqual(stranger.close_code, 1009)
        flood = self.browser()
        with contextlib.suppress(ConnectionResetError, BrokenPipeError):
            flood.socket.sendall(frame(0x81, b"{}") * 5000)
        while flood.receive():
            pass
        self.assertEqual(flood.close_code, 1008)
        self.assertEqual(self.server.get("/livez"), "alive")

    def refusals(self, make, address):
        """How often a guess is looked at before it is not any more."""
        browser = None
        for number in range(2000):
            if number % 50 == 0:
                browser = self.browser(address)
            if browser.ask(make())["error"] == "tries":
                return number
        return None

    def test_who_guesses_is_slowed_down_and_others_are_not(self):
        _, opened = self.open_class()
        passwords = self.refusals(lambda: opening("wrong"), "203.0.113.9")
        codes = self.refusals(lambda: {"join": {"code": "222222", "name": "Eve"}}, "203.0.113.9")
        self.assertIsNotNone(passwords)
        self.assertGreaterEqual(passwords, 10)
        self.assertIsNotNone(codes)
        self.assertGreaterEqual(codes, 500)
        self.assertIn("class", self.browser("203.0.113.10").ask(opening()))
        self.assertIn("joined", self.browser("203.0.113.10").ask({"join": {"code": opened["code"], "name": "Ada"}}))
        # Many addresses gain one guess each, and shut nobody out.
        rounds = [[self.browser(f"198.51.100.{n}").ask(opening("wrong"))["error"] for n in range(1, 100)] for _ in range(2)]
        self.assertEqual(set(rounds[0]), {"password"})
        self.assertIn("tries", rounds[1])
        self.assertIn("class", self.browser("203.0.113.11").ask(opening()))
        self.assertIn("203.0.113.9", self.server.log())
        self.assertNotIn("222222", self.server.log())

    def test_there_are_not_too_many_of_anything(self):
        teacher, opened = self.open_class(seats=1)
        for name in ("Ada", "Bob"):
            self.join(opened["code"], name)
        for _ in range(20):
            self.assertEqual(self.browser().ask({"join": {"code": opened["code"], "name": "Cyd"}})["error"], "full")
        for _ in range(7):
            self.assertIn("class", self.browser().ask({"teach": {"key": opened["key"]}}))
        self.assertEqual(self.browser().ask({"teach": {"key": opened["key"]}})["error"], "limit")
        for _ in range(19):
            self.open_class(seats=1)
        self.assertEqual(self.browser().ask(opening())["error"], "limit")
        silent = [self.browser("203.0.113.9") for _ in range(301)]
        self.assertEqual(silent[0].until("error"), "limit")
        self.assertIsNone(silent[0].receive())
        self.assertEqual(silent[0].close_code, 1013)
        self.assertEqual(silent[-1].ask({"join": {"code": "x", "name": "Ada"}})["error"], "code")
        self.assertEqual(self.figure("webots_classes"), "20")
        teacher.send({"close": True})
        self.assertEqual(teacher.until("closed"), "teacher")


class WithoutPassword(OneServer):
    config = {"teacherPassword": ""}

    def test_nobody_opens_a_class(self):
        self.assertEqual(self.browser().ask(opening(""))["error"], "off")
        self.assertEqual(self.browser().ask({"join": {"code": "222222", "name": "Ada"}})["error"], "code")


class PasswordFile(unittest.TestCase):
    def test_the_password_may_be_in_a_file_that_nobody_else_may_read(self):
        with contextlib.ExitStack() as stack:
            server = SessionServer([])
            stack.callback(server.close)
            server.config["teacherPasswordFile"] = file = os.path.join(server.folder, "password")

            def check(**keys):
                path = server.configure(**keys)
                done = subprocess.run([server.program(), "--check-config", path], capture_output=True, text=True, timeout=PATIENCE)
                return done.returncode, done.stdout + done.stderr

            status, said = check()
            self.assertEqual(status, 0)
            self.assertIn("nobody can open a class", said)
            with open(file, "w") as password:
                password.write(PASSWORD + "\n")
            os.chmod(file, 0o644)
            status, said = check()
            self.assertNotEqual(status, 0)
            self.assertIn("chmod 600", said)
            self.assertNotIn(PASSWORD, said)
            os.chmod(file, 0o600)
            self.assertEqual(check()[0], 0)
            status, said = check(teacherPassword="p")
            self.assertNotEqual(status, 0)
            self.assertIn("teacherPassword", said)
            server.start()
            teacher = stack.enter_context(contextlib.closing(Browser(server)))
            self.assertEqual(teacher.ask(opening("wrong"))["error"], "password")
            self.assertIn("class", teacher.ask(opening()))
            with open(file, "w") as password:
                password.write("short\n")
            server.reread()
            wait_until(lambda: "at least 8 characters" in server.log(), server.log)
            other = stack.enter_context(contextlib.closing(Browser(server)))
            self.assertIn("class", other.ask(opening()), "the old one stays")


if __name__ == "__main__":
    main()

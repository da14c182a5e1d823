#!/usr/bin/python3
"""The git source against hostile repositories and servers: nothing is written outside of the project, nothing is executed,
nothing grows without bound, and every failure is a sentence."""

import hashlib
import http.server
import os
import socket
import struct
import sys
import threading
import zlib

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
from support.git_case import GitCase, main  # noqa: E402
from support.git_probe import HEADER, WORLD, tree  # noqa: E402
from support.git_server import GitServer  # noqa: E402
from support.hostile_peer import HostileGitServer, pack_of_deltas, pack_of_folders, pack_of_waiting_deltas, varint  # noqa: E402

WORLDS = "worlds/a.wbt"
FORBIDDEN = "The project has a file with a forbidden name: "


class HostileRepositoryTest(GitCase):
    @classmethod
    def setUpClass(cls):
        cls.server = GitServer()
        cls.addClassCleanup(cls.server.close)
        cls.server.start()
        cls.number = 0

    def setUp(self):
        self.fetch_from(self.server.url)

    def repository(self, files=None):
        HostileRepositoryTest.number += 1
        name = f"r{self.number}"
        return name, self.server.add_repository("evil", name, files)

    def fetch(self, name, *options):
        before = set(tree(self.probe.folder))
        answer = self.probe.fetch(f"evil/{name}/blob/main/{WORLDS}", *options)
        added = {path for path in set(tree(self.probe.folder)) - before if not path.startswith(("cache", "run"))}
        self.assertEqual(added, set(), "something was written outside of the project")
        return answer

    def raw(self, entries):
        """A repository whose tree is exactly these entries, besides a world."""
        name, path = self.repository()
        world = self.server.write_object(path, "blob", WORLD.encode())
        worlds = ("40000", "worlds", [("100644", "a.wbt", world)])
        self.server.commit_tree(path, sorted([worlds, *entries(path)], key=lambda entry: entry[1]))
        return name

    def blob(self, path, content=b"evil"):
        return self.server.write_object(path, "blob", content)

    def test_what_has_a_name_that_leads_elsewhere_is_left_out_and_told(self):
        for name in ("..", ".", ".git", ".GIT", ".git.", ".git ", "git~1", ".g\u200cit", "..\\evil", "../evil", "/tmp/evil", "x" * 300):
            for entries, path in ((lambda path: [("100644", name, self.blob(path))], name),
                                  (lambda path: [("40000", name, [("100644", "config", self.blob(path))])], name),
                                  (lambda path: [("40000", "sub", [("120000", name, self.blob(path))])], f"sub/{name}")):
                with self.subTest(name=name):
                    repository = self.raw(entries)
                    for answer in (self.fetch(repository), self.fetch(repository)):  # the second is from the cache
                        self.assertEqual(set(tree(answer["root"])) - {"sub"}, {"worlds", WORLDS}, answer)
                        self.assertEqual([told[:10] for told in answer["forbidden"]], [path.replace("\u200c", r"\xe2\x80\x8c")[:10]])

    def test_what_lies_above_the_project_is_told_too(self):
        name = self.raw(lambda path: [("40000", "p", [("40000", "worlds", [("100644", "a.wbt", self.blob(path, WORLD.encode()))])]), ("100644", ".GIT", self.blob(path))])
        self.assertEqual(self.probe.fetch(f"evil/{name}/blob/main/p/{WORLDS}")["forbidden"], [".GIT"])

    def test_a_project_that_is_refused_is_fetched_once(self):
        name = self.raw(lambda path: [("40000", "p", [("40000", "worlds", [("100644", "x", self.blob(path)), ("120000", "x", self.blob(path))])])])
        before = len(self.requests())
        self.assertTrue(self.probe.fetch(f"evil/{name}/blob/main/p/{WORLDS}").get("error", "").startswith(FORBIDDEN))
        self.assertEqual(len(self.requests(before)), 2, "refs, commits and folders")

    def test_a_link_and_a_folder_of_the_same_name_refuse_the_project(self):
        name = self.raw(lambda path: [("120000", "sub", self.blob(path, b"..")),
                                      ("40000", "sub", [("100644", "evil", self.blob(path))])])
        self.assertTrue(self.fetch(name)["error"].startswith(FORBIDDEN))

    def test_links_out_of_the_project_are_left_out(self):
        targets = ("/etc/passwd", "..", "../../x", "a/../../x", "/", "worlds/../..")
        files = {f"link{i}": ("120000", target) for i, target in enumerate(targets)}
        files.update({"deep/deeper/up": ("120000", "../../worlds/a.wbt"), "deep/out": ("120000", "../../out"),
                      "long": ("120000", "x" * 5000), WORLDS: WORLD, "empty": ("120000", "")})
        name, _ = self.repository(files)
        found = tree(self.fetch(name)["root"])
        links = {path: content for path, content in found.items() if isinstance(content, str)}
        self.assertEqual(links, {"deep/deeper/up": "-> ../../worlds/a.wbt"})

    def test_links_that_leave_the_folder_of_the_project_stay_in_the_repository(self):
        """Links are checked out as git does, with the files that they point to; see git_cone_test."""
        name, _ = self.repository({"p/worlds/a.wbt": WORLD, "p/up": ("120000", "../secret"), "p/out": ("120000", "../../secret"),
                                   "p/worlds/out": ("120000", "../../../r/x"), "secret": "x"})
        answer = self.probe.fetch(f"evil/{name}/blob/main/p/{WORLDS}")
        self.assertEqual(set(tree(answer["root"])), {"worlds", WORLDS, "up"})
        self.assertEqual(set(os.listdir(os.path.dirname(answer["root"]))), {"p", "secret"})

    def test_a_world_that_is_a_link_out_of_the_project_does_not_exist(self):
        name, _ = self.repository({WORLDS: ("120000", "/etc/passwd"), "worlds/b.wbt": WORLD})
        self.assertEqual(self.fetch(name)["error"], "a.wbt does not exist.")

    def test_a_folder_of_worlds_that_is_a_link_out_has_no_world(self):
        name, _ = self.repository({"worlds": ("120000", "/etc"), "x": "x"})
        self.assertEqual(self.fetch(name)["error"], "a.wbt does not exist.")

    def test_submodules_are_left_out(self):
        name, _ = self.repository({WORLDS: WORLD, "module": ("160000", "1" * 40),
                                   ".gitmodules": '[submodule "module"]\n\tpath = module\n\turl = ext::sh -c "touch /tmp/evil"\n'})
        self.assertEqual(set(tree(self.fetch(name)["root"])), {"worlds", WORLDS, ".gitmodules"})

    def test_attributes_filters_and_pointers_that_are_none_are_only_text(self):
        pointer = "version https://git-lfs.github.com/spec/v1\noid sha256:00\nsize 12345\n"
        name, _ = self.repository({WORLDS: WORLD, ".gitattributes": "* filter=lfs text eol=crlf ident export-ignore\n",
                                   "big.bin": pointer, "hooks/post-checkout": ("100755", "#!/bin/sh\ntouch evil\n")})
        found = tree(self.fetch(name)["root"])
        self.assertEqual(found["big.bin"], pointer.encode())
        self.assertEqual(found[WORLDS], WORLD.encode())
        self.assertNotIn("evil", found)

    def test_names_that_are_options_or_shell_text_are_only_names(self):
        names = ["-rf", "--upload-pack=touch evil", "$(touch evil)", "`touch evil`", "a;touch evil", "a b", "'\"", "%2e%2e",
                 "*", "~root", "|id", "CON", "a:b"]
        name, _ = self.repository({WORLDS: WORLD, **{f"sub/{each}": "x" for each in names if '"' not in each}})
        found = tree(self.fetch(name)["root"])
        self.assertEqual({path[4:] for path in found if path.startswith("sub/")}, {each for each in names if '"' not in each})

    def test_names_that_differ_in_case_or_composition_are_different_files(self):
        name, _ = self.repository({WORLDS: WORLD, "A": "1", "a": "2", "caf\u00e9": "3", "cafe\u0301": "4"})
        found = tree(self.fetch(name)["root"])
        self.assertEqual([found[each] for each in ("A", "a", "caf\u00e9", "cafe\u0301")], [b"1", b"2", b"3", b"4"])

    def test_folders_that_hold_each_other_many_times_end_at_the_limit(self):
        name, path = self.repository()
        level = self.server.write_object(path, "tree", b"")
        for _ in range(40):
            content = b"".join(b"40000 %c\0" % letter + bytes.fromhex(level) for letter in b"abcdefghij")
            level = self.server.write_object(path, "tree", content)
        world = ("40000", "worlds", [("100644", "a.wbt", self.blob(path, WORLD.encode()))])
        self.server.commit_tree(path, [("40000", "bomb", level), world])
        self.assertIn("more than 50000 files", self.fetch(name)["error"])

    def test_one_object_that_is_many_files_is_counted_each_time(self):
        name, _ = self.repository({WORLDS: WORLD, **{f"copy{i}": b"\0" * 1_000_000 for i in range(50)}})
        self.assertIn("larger than", self.fetch(name, "--bytes", "20000000")["error"])

    def test_a_full_disk_is_said_and_the_next_start_works(self):
        disk = self.small_disk()
        self.probe.cache = os.path.join(disk, "cache")
        name, path = self.repository({WORLDS: WORLD, "big": os.urandom(4_000_000)})
        answer = self.probe.fetch(f"evil/{name}/blob/main/{WORLDS}")
        self.assertIn("No space left on device", answer["error"])
        self.assertEqual(self.left_in_cache(), [])
        self.server.commit(path, {WORLDS: WORLD})
        answer = self.probe.fetch(f"evil/{name}/blob/main/{WORLDS}")
        self.assertEqual(answer.get("header"), HEADER, answer)


def frame(payload):
    payload = payload if isinstance(payload, bytes) else payload.encode()
    return b"%04x" % (len(payload) + 4) + payload


def pack(objects, count=None):
    """objects: (type, size that it claims, bytes that are compressed, bytes in between)."""
    body = b"PACK" + struct.pack(">II", 2, len(objects) if count is None else count)
    for kind, size, content, extra in objects:
        byte = (kind << 4) | (size & 15)
        size >>= 4
        while size:
            body += bytes([byte | 0x80])
            byte = size & 0x7F
            size >>= 7
        body += bytes([byte]) + extra + zlib.compress(content, 9)
    return body + hashlib.sha1(body).digest()


def packed(pack_bytes):
    """The answer to a fetch."""
    chunks = [pack_bytes[i:i + 60_000] for i in range(0, len(pack_bytes), 60_000)]
    return frame("packfile\n") + b"".join(frame(b"\1" + chunk) for chunk in chunks) + b"0000"


COMMIT = "a" * 40
REFS = frame(f"{COMMIT} refs/heads/main\n") + b"0000"


class Servant(http.server.BaseHTTPRequestHandler):
    protocol_version = "HTTP/1.1"

    def log_message(self, *_):
        pass

    def do_GET(self):
        self.server.asked.append((self.path, self.headers["Host"]))
        self.answer(self.server.script.get("capabilities", frame("version 2\n") + frame("fetch=shallow filter\n") + b"0000"))

    def do_POST(self):
        body = self.rfile.read(int(self.headers["Content-Length"]))
        self.server.asked.append((self.path, self.headers["Host"]))
        self.server.wanted.append(body)
        self.answer(self.server.script["refs" if b"command=ls-refs" in body else "fetch"])

    def answer(self, what):
        status, headers, body = what if isinstance(what, tuple) else (200, {}, what)
        self.send_response(status)
        for name, value in headers.items():
            self.send_header(name, value)
        if "Content-Length" not in headers:
            self.send_header("Content-Length", str(len(body)))
        self.end_headers()
        self.wfile.write(body)
        while self.server.endless:
            self.wfile.write(b"x" * 65536)
            self.server.written += 65536


class HostileServerTest(GitCase):
    def setUp(self):
        self.http = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Servant)
        self.http.handle_error = lambda *_: None  # connections that we cut are what is tested
        self.http.daemon_threads = True
        self.http.script = {"refs": REFS}
        self.http.asked, self.http.wanted = [], []
        self.http.endless, self.http.written = False, 0
        thread = threading.Thread(target=self.http.serve_forever, daemon=True)
        thread.start()
        self.addCleanup(self.http.server_close)
        self.addCleanup(self.http.shutdown)
        self.fetch_from(f"http://127.0.0.1:{self.http.server_port}")

    def error(self, *options, **script):
        self.http.script = {"refs": REFS, **script}
        answer = self.probe.fetch("evil/r/blob/main/worlds/a.wbt", *options)
        self.assertIn("error", answer)
        # A browser shows the message, so it must name what it is about.
        self.assertRegex(answer["error"], rf"^({self.probe.forge}(:| can't be reached:) |Repository evil/r |The (project|repository) ).*[^.]\.$")
        return answer["error"]

    def test_answers_that_are_no_refs_are_refused(self):
        for refs in (b"", b"<html>", b"zzzz", b"0003", frame("x"), frame("no refs"), REFS[:-4], REFS[:20], b"\0" * 100,
                     frame(f"{'g' * 40} refs/heads/main\n") + b"0000"):
            self.assertIn("git server", self.error(refs=refs), refs)

    def test_what_the_server_says_is_shown_without_control_characters(self):
        message = self.error(refs=frame("ERR \x1b[2J<script>\n") + b"0000")
        self.assertIn("the git server says: ", message)
        self.assertNotIn("\x1b", message)
        message = self.error(fetch=frame("packfile\n") + frame(b"\3out of memory\n") + b"0000")
        self.assertIn("out of memory", message)

    def test_zero_bytes_at_the_end_of_what_the_server_says_are_not_shown(self):
        for answers in ({"refs": frame(b"ERR go away.\n\0") + b"0000"}, {"refs": frame(b"ERR go away\0") + b"0000"},
                        {"fetch": frame(b"packfile\n") + frame(b"\3go away\0\n") + b"0000"}):
            self.assertRegex(self.error(**answers), r": the git server says: go away\.$")

    def test_endless_refs_are_refused(self):
        line = frame(f"{COMMIT} refs/heads/main" + "x" * 60_000 + "\n")
        self.assertIn("larger than 8 MB", self.error(refs=line * 200 + b"0000"))
        many = b"".join(frame(f"{COMMIT} refs/heads/main{i}\n") for i in range(30_000))
        self.assertIn("too many branches", self.error(refs=many + b"0000"))

    def test_answers_that_are_no_pack_are_refused(self):
        good = pack([(3, 4, b"blob", b"")])
        for fetch in (b"", b"0000", b"garbage", packed(b""), packed(b"PACK"), packed(good[:-1]), packed(good[:-20]),
                      packed(good + b"x"), packed(good[:-20] + b"\0" * 20), packed(b"JUNK" + good[4:]), packed(good)[:-4],
                      packed(pack([(3, 4, b"blob", b"")], count=2)), packed(pack([(3, 5, b"blob", b"")])),
                      packed(pack([(3, 3, b"blob", b"")])), packed(pack([(0, 4, b"blob", b"")])),
                      packed(pack([(5, 4, b"blob", b"")])), packed(pack([])), frame("packfile\n") + frame(b"\7x") + b"0000",
                      frame("packfile\n") + frame(b"") + b"0000"):
            self.assertIn("the git server", self.error(fetch=fetch), fetch[:60])

    def test_deltas_without_a_base_are_refused(self):
        delta = varint(4) + varint(4) + b"\x90\x04"
        for extra, kind in ((b"\1" * 20, 7), (b"\x05", 6), (b"\x00", 6), (b"\xff\xff\xff\x7f", 6)):
            message = self.error(fetch=packed(pack([(3, 4, b"blob", b""), (kind, len(delta), delta, extra)])))
            self.assertIn("a delta without base", message)

    def test_deltas_based_on_each_other_are_refused(self):
        delta = varint(4) + varint(4) + b"\x90\x04"
        one, other = b"\1" * 20, b"\2" * 20
        message = self.error(fetch=packed(pack([(7, len(delta), delta, one), (7, len(delta), delta, other)])))
        self.assertIn("a delta without base", message)

    def test_a_small_pack_that_becomes_large_is_refused(self):
        base = b"\0" * 65536
        copies = 40_000
        bomb = varint(len(base)) + varint(copies * 65536) + b"\x80" * copies  # each byte copies 64 KiB: 2.6 GB
        fetch = packed(pack([(3, len(base), base, b""), (7, len(bomb), bomb, hashlib.sha1(b"blob 65536\0" + base).digest())]))
        self.assertLess(len(fetch), 1_000)
        self.assertIn("too large", self.error(fetch=fetch))
        zeros = packed(pack([(3, 100_000_000, b"\0" * 100_000_000, b"")]))
        self.assertIn("larger than 50 MB", self.error("--bytes", str(50 << 20), fetch=zeros))
        lies = packed(pack([(3, 10, b"\0" * 100_000_000, b"")]))
        self.assertIn("larger than it says", self.error(fetch=lies))
        absurd = packed(pack([(3, 1 << 52, b"x", b"")]))
        self.assertIn("larger than", self.error(fetch=absurd))

    def test_a_pack_of_endless_objects_is_refused(self):
        self.assertIn("too many files", self.error(fetch=packed(pack([(3, 0, b"", b"")], count=0xFFFFFFFF))))

    def test_a_pack_without_what_was_asked_for_is_refused(self):
        self.assertIn("left out the commit", self.error(fetch=packed(pack([(3, 4, b"blob", b"")]))))

    def test_no_other_host_is_contacted(self):
        with socket.create_server(("127.0.0.1", 0)) as elsewhere:
            elsewhere.setblocking(False)  # whoever has connected is in its queue
            port = elsewhere.getsockname()[1]
            for target in (f"http://127.0.0.1:{port}/evil/r.git/git-upload-pack",
                           f"http://127.0.0.1:{self.http.server_port}@127.0.0.1:{port}/x",
                           f"http://localhost:{self.http.server_port}/x", "file:///etc/passwd", "gopher://127.0.0.1/x",
                           f"//127.0.0.1:{port}/x"):
                message = self.error(refs=(307, {"Location": target}, b""))
                self.assertIn("redirects to another host", message, target)
            with self.assertRaises(BlockingIOError):
                elsewhere.accept()

    def test_redirects_in_circles_end(self):
        address = f"http://127.0.0.1:{self.http.server_port}/evil/r.git/git-upload-pack"
        self.assertIn("circles", self.error(refs=(301, {"Location": address}, b"")))
        self.assertLess(len(self.http.asked), 8)

    def test_a_server_in_trouble_is_unreachable(self):
        for status in (500, 502, 503, 429):
            self.assertIn(f"status {status}", self.error(refs=(status, {}, b"")))
        self.assertIn("status 418", self.error(refs=(418, {}, b"")))

    def test_the_text_of_an_error_is_not_listened_to_for_ever(self):
        self.http.endless = True
        for status, words in ((404, "does not exist or is private"), (500, "answers with status 500"), (307, "status 307")):
            self.http.written = 0
            headers = {"Content-Length": str(1 << 40), "Location": "http://elsewhere.test/"}
            self.assertIn(words, self.error("--timeout", "60000", refs=(status, headers, b"")))
            self.assertLess(self.http.written, 50_000_000, "what fits into buffers on the way")

    def test_headers_and_trailers_without_end_are_refused(self):
        hostile = HostileGitServer({})
        self.addCleanup(hostile.close)
        self.fetch_from(hostile.url)
        for attack in ("headers", "interim", "trailers"):
            for name in (attack, f"pack-{attack}"):
                with self.subTest(name):
                    answer = self.probe.fetch(f"evil/{name}/blob/main/{WORLDS}")
                    self.assertEqual(answer["error"], f"{hostile.url}: the answer of the git server has more than 256 kB or 4000 lines of headers.")

    def test_pieces_with_more_around_them_than_in_them_are_refused(self):
        hostile = HostileGitServer({})
        self.addCleanup(hostile.close)
        self.fetch_from(hostile.url)
        for name in ("extension", "pack-extension"):
            with self.subTest(name):
                answer = self.probe.fetch(f"evil/{name}/blob/main/{WORLDS}")
                self.assertEqual(answer["error"], f"{hostile.url}: the answer of the git server is hardly anything but what separates its pieces.")

    def test_what_a_pack_becomes_is_paid_for_before_it_is_there(self):
        memory = ("--memory", str(200 << 20))
        for make in (pack_of_deltas, pack_of_folders, pack_of_waiting_deltas):
            with self.subTest(make.__name__):
                self.assertEqual(self.error(*memory, fetch=make()),
                                 "The project needs more memory than this server has for all that it fetches (200 MB). "
                                 "Its operator can raise \"fetchMemory\".")
                self.assertEqual(self.left_in_cache(), [])

    def test_each_file_takes_a_block_of_the_disk(self):
        message = self.error("--disk", str(20 << 20), fetch=packed(pack([(3, 4, struct.pack(">I", i), b"") for i in range(6000)])))
        self.assertEqual(message, "The project needs more room than this server has for all that it fetches (20 MB). "
                                  "Its operator can raise \"fetchDisk\".")
        self.assertEqual(self.left_in_cache(), [])

    def test_fetches_that_do_not_fit_together_wait_for_each_other(self):
        fetch = pack_of_folders(100 << 20)
        self.http.script = {"refs": REFS, "fetch": fetch}
        worlds = [f"evil/r{i}/blob/main/{WORLDS}" for i in range(6)]
        for answer in self.probe.fetch_all(worlds, "--together", "--memory", str(256 << 20)):
            self.assertIn("left out the commit", answer["error"])

    def cut(self, body):
        """The message after a connection that breaks in the middle."""
        return 200, {"Content-Length": "100000", "Connection": "close"}, body

    def test_a_cut_is_no_reason_to_ask_for_more(self):
        for body in (packed(pack([(3, 4, b"blob", b"")]))[:40], b""):
            with self.subTest(body):
                self.http.script = {"refs": REFS, "fetch": self.cut(body)}
                self.http.asked.clear()
                self.http.wanted.clear()
                for answer in self.probe.fetch_all(["evil/r/blob/main/p/worlds/a.wbt"] * 2):
                    self.assertIn("the connection was cut", answer.get("error", ""))
                self.assertEqual(len(self.http.asked), 4, "refs and pack, twice")
                fetches = [wanted for wanted in self.http.wanted if b"command=fetch" in wanted]
                self.assertEqual([b"filter blob:none" in wanted for wanted in fetches], [True, True])

    def test_words_that_are_not_about_filters_are_no_reason_to_ask_for_more(self):
        self.assertIn("out of order", self.error(fetch=frame("ERR out of order.\n")))
        self.assertEqual(sum(b"command=fetch" in wanted for wanted in self.http.wanted), 1)

    def test_an_answer_that_ends_early_is_an_error(self):
        self.assertIn("can't be reached",
                      self.error("--timeout", "1000", refs=(200, {"Content-Length": "100000"}, b"0")))


if __name__ == "__main__":
    main()

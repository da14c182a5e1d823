#!/usr/bin/python3
"""Large files (Git LFS): their content arrives in place of the pointers, from good servers and from hostile ones.

Where git-lfs is installed, the result is compared with its checkout of the same repository, which is what the Python servers delivered."""

import glob
import json
import os
import shutil
import socket
import subprocess
import sys
import threading
import unittest
import unittest.mock

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
from support.forward_proxy import ForwardProxy  # noqa: E402
from support.git_case import GitCase, main  # noqa: E402
from support.git_probe import HEADER, WORLD, Probe, tree  # noqa: E402
from support.git_server import GitServer  # noqa: E402
from support.lfs_server import LfsServer, digest, pointer_to  # noqa: E402
from support.projects import demo_project  # noqa: E402
from support.servers import SimulationServer  # noqa: E402

WORLDS = "worlds/a.wbt"
MESH = os.urandom(100_000)
TEXTURE = os.urandom(30_000)
FAILED = "The large files (Git LFS) of owner/{} can't be fetched: "


class LfsCase(GitCase):
    number = 0  # of repositories

    @classmethod
    def setUpClass(cls):
        cls.lfs = LfsServer()
        cls.addClassCleanup(cls.lfs.close)
        cls.server = GitServer(lfs=cls.lfs.port)
        cls.addClassCleanup(cls.server.close)
        cls.server.start()

    def setUp(self):
        self.lfs.reset()
        self.fetch_from(self.server.url)

    def repository(self, files):
        LfsCase.number += 1
        name = f"r{LfsCase.number}"
        return name, self.server.add_repository("owner", name, {WORLDS: WORLD, **files})

    def fetch(self, name, *options, folder=""):
        return self.probe.fetch(f"owner/{name}/blob/main/{folder}{WORLDS}", *options)

    def asked(self):
        """The requests to the LFS server."""
        return [(method, path.partition("/info/")[2] or "object") for method, path, _ in self.lfs.requests]


class LfsTest(LfsCase):
    def test_content_arrives_in_the_place_of_pointers(self):
        mesh, texture = self.lfs.pointer(MESH), self.lfs.pointer(TEXTURE)
        name, _ = self.repository({"meshes/a.stl": mesh, "meshes/b.stl": mesh, "bin/tool": ("100755", mesh), "t.png": texture,
                                   "old.stl": mesh.replace("git-lfs.github.com", "hawser.github.com"), "small.txt": "x" * 200,
                                   "windows.stl": mesh.replace("\n", "\r\n"), "empty.stl": pointer_to(digest(b""), 0)})
        for again in (False, True):
            answer = self.fetch(name)
            self.assertEqual(answer.get("header"), HEADER, answer)
            found = tree(answer["root"])
            for path in ("meshes/a.stl", "meshes/b.stl", "bin/tool", "old.stl", "windows.stl"):
                self.assertEqual(found[path], MESH, path)
            self.assertEqual((found["t.png"], found["small.txt"], found["empty.stl"]), (TEXTURE, b"x" * 200, b""))
            self.assertTrue(os.access(os.path.join(answer["root"], "bin/tool"), os.X_OK))
            self.assertFalse(os.stat(os.path.join(answer["root"], "meshes/a.stl")).st_mode & 0o111)
            self.assertEqual(sorted(self.asked()), [("GET", "object")] * 2 + [("POST", "lfs/objects/batch")], f"again: {again}")
            self.assertEqual(answer["large_bytes_total"], 0 if again else len(MESH) + len(TEXTURE))
            self.assertEqual(answer["large_bytes"], answer["large_bytes_total"])
        method, path, headers = self.lfs.requests[0]
        self.assertEqual(path, f"/owner/{name}.git/info/lfs/objects/batch")
        self.assertEqual((headers["Accept"], headers["Content-Type"]), ("application/vnd.git-lfs+json",) * 2)
        self.assertEqual((self.lfs.questions[0]["operation"], self.lfs.questions[0]["transfers"]), ("download", ["basic"]))

    def test_only_the_wanted_folder_is_asked_for(self):
        name, _ = self.repository({f"p/{WORLDS}": WORLD, "p/a.stl": self.lfs.pointer(MESH), "q/b.stl": self.lfs.pointer(TEXTURE)})
        answer = self.fetch(name, folder="p/")
        self.assertEqual(tree(answer["root"])["a.stl"], MESH)
        self.assertEqual([each["oid"] for each in self.lfs.questions[0]["objects"]], [digest(MESH)])

    def test_of_the_folders_above_the_small_ones_come_too(self):
        mesh = self.lfs.pointer(MESH)
        for content, kept in ((100, True), (9 << 20, False)):
            self.lfs.reset()
            above = self.lfs.pointer(os.urandom(content))
            name, _ = self.repository({"p/" + WORLDS: WORLD, "p/a.stl": mesh, "above.stl": above})
            answer = self.fetch(name, folder="p/")
            self.assertEqual(answer.get("header"), HEADER, answer)
            self.assertEqual(tree(answer["root"])["a.stl"], MESH)
            found = os.path.join(os.path.dirname(answer["root"]), "above.stl")
            self.assertEqual(os.path.getsize(found) if os.path.exists(found) else None, content if kept else None)
            self.assertEqual(self.asked().count(("GET", "object")), 2 if kept else 1)

    def test_a_project_without_pointers_asks_nobody(self):
        almost = self.lfs.pointer(MESH)
        name, _ = self.repository({"a": "version https://git-lfs.github.com/spec/v1\n", "b": almost + "more 1\n" + "x" * 100,
                                   "c": almost.replace("sha256:", "sha1:"), "link": ("120000", "a"), "d": almost + "\n" * 2000})
        found = tree(self.fetch(name)["root"])
        self.assertEqual(found["c"], almost.replace("sha256:", "sha1:").encode())
        self.assertEqual(self.asked(), [])

    def test_after_a_push_only_what_is_new_is_fetched(self):
        first = {"a.stl": self.lfs.pointer(MESH), WORLDS: WORLD}
        name, path = self.repository(first)
        self.fetch(name)
        self.lfs.reset()
        self.server.commit(path, {**first, "b.stl": self.lfs.pointer(TEXTURE), "copy.stl": first["a.stl"]})
        found = tree(self.fetch(name)["root"])
        self.assertEqual((found["a.stl"], found["b.stl"], found["copy.stl"]), (MESH, TEXTURE, MESH))
        self.assertEqual([each["oid"] for each in self.lfs.questions[0]["objects"]], [digest(TEXTURE)])
        self.lfs.reset()
        self.server.commit(path, {**first, "moved/a.stl": first["a.stl"]})
        self.assertEqual(tree(self.fetch(name)["root"])["moved/a.stl"], MESH)
        self.assertEqual(self.asked(), [])

    def test_a_hundred_are_asked_for_at_once(self):
        contents = {f"{i}.bin": str(i).encode() * 100 for i in range(105)}
        name, _ = self.repository({path: self.lfs.pointer(content) for path, content in contents.items()})
        found = tree(self.fetch(name)["root"])
        self.assertEqual({path: found[path] for path in contents}, contents)
        self.assertEqual([len(question["objects"]) for question in self.lfs.questions], [100, 5])

    def test_starts_at_once_fetch_once(self):
        name, _ = self.repository({"a.stl": self.lfs.pointer(MESH)})
        answers = self.probe.fetch_all([f"owner/{name}/blob/main/{WORLDS}"] * 8, "--together")
        for answer in answers:
            self.assertEqual(tree(answer["root"])["a.stl"], MESH)
            self.assertEqual((answer["large_bytes"], answer["large_bytes_total"]), (len(MESH), len(MESH)))
        self.assertEqual(len(self.asked()), 2)

    def test_what_was_changed_in_the_cache_is_fetched_again(self):
        name, _ = self.repository({"a.stl": self.lfs.pointer(MESH)})
        self.fetch(name)
        for damage in (lambda entry: self.overwrite(f"{entry}/files/a.stl", b"evil"),
                       lambda entry: os.truncate(f"{entry}/files/a.stl", 3),
                       lambda entry: self.overwrite(f"{entry}/index", b"webots_cloud folder 2")):
            (entry,) = self.snapshots()
            damage(entry)
            self.lfs.reset()
            self.assertEqual(tree(self.fetch(name)["root"])["a.stl"], MESH)
            self.assertEqual(len(self.asked()), 2)

    @staticmethod
    def overwrite(path, content):
        with open(path, "r+b") as file:
            file.write(content)

    def test_the_cache_counts_what_large_files_take(self):
        name, _ = self.repository({"a.stl": self.lfs.pointer(MESH)})
        self.fetch(name, "--cache-bytes", "50000", "--discard")
        self.assertEqual(self.snapshots(), [])

    def test_limits_are_kept_before_anything_is_asked(self):
        name, _ = self.repository({"a.stl": self.lfs.pointer(MESH), "huge.bin": pointer_to("a" * 64, (1 << 63) - 1)})
        self.assertEqual(self.fetch(name)["error"], "The project is larger than 2048 MB.")
        name, _ = self.repository({"a.stl": self.lfs.pointer(MESH), "b.stl": self.lfs.pointer(MESH)})
        self.assertEqual(self.fetch(name, "--bytes", "150000")["error"], "The project is larger than 0 MB.")
        self.assertIn('Its operator can raise "fetchDisk".', self.fetch(name, "--disk", "200000")["error"])
        self.assertEqual(self.asked(), [])
        self.assertEqual(self.left_in_cache(), [])

    def test_a_full_disk_is_said(self):
        self.probe.cache = os.path.join(self.small_disk(), "cache")
        name, _ = self.repository({"a.stl": self.lfs.pointer(os.urandom(4_000_000))})
        self.assertIn("No space left on device", self.fetch(name)["error"])
        self.assertEqual(self.left_in_cache(), [])

    def answers_with_silence(self, what, act):
        """Lets the LFS server leave one kind of request unanswered while `act` runs, with growing time limits until that request arrives."""
        for milliseconds in (400, 1_500, 8_000):
            self.lfs.reset()
            self.lfs.answers[what] = lambda handler: handler.say_nothing()
            outcome = act(str(milliseconds))
            self.assertEqual(self.left_in_cache(), [])
            if self.lfs.silent.is_set():
                return outcome
        return self.fail("the LFS server was not asked")

    def test_a_server_that_says_nothing_is_given_up_in_time(self):
        name, _ = self.repository({"a.stl": self.lfs.pointer(MESH)})
        for what in ("batch", "object"):
            message = self.answers_with_silence(what, lambda time: self.fetch(name, "--timeout", time)["error"])
            self.assertEqual(message, FAILED.format(name) + "the LFS server took too long. Try again later.")

    def test_who_leaves_is_not_waited_for(self):
        name, _ = self.repository({"a.stl": self.lfs.pointer(MESH)})
        answer = self.answers_with_silence("object", lambda time: self.fetch(name, "--cancel-after", time))
        self.assertEqual(answer["code"], "Operation canceled")

    def test_headers_are_sent_and_stay_with_the_host_that_they_are_for(self):
        with LfsServer() as elsewhere:
            elsewhere.pointer(MESH)
            self.lfs.headers = {"Authorization": "Basic c2VjcmV0", "X-Amz-Object": "yes", "Host": "other", "Metadata-Flavor": "Google"}
            self.lfs.answers["object"] = lambda handler: handler.answer(
                302, b"", {"Location": f"{elsewhere.url}/objects/{digest(MESH)}?signature=1"})
            name, _ = self.repository({"a.stl": self.lfs.pointer(MESH)})
            self.assertEqual(tree(self.fetch(name)["root"])["a.stl"], MESH)
            _, _, headers = self.lfs.requests[-1]
            self.assertEqual((headers["Authorization"], headers["X-Amz-Object"]), ("Basic c2VjcmV0", "yes"))
            self.assertEqual(headers["Host"], f"127.0.0.1:{self.lfs.port}")
            self.assertNotIn("Metadata-Flavor", headers)
            (_, path, headers), = elsewhere.requests
            self.assertTrue(path.endswith("?signature=1"))
            self.assertNotIn("Authorization", headers)
            self.assertNotIn("X-Amz-Object", headers)

    def test_passwords_are_for_the_host_of_the_forge_alone(self):
        oid = digest(MESH)
        name, _ = self.repository({"a.stl": self.lfs.pointer(MESH)})
        header = {"Authorization": "Basic c2VjcmV0", "X-Amz-Object": "yes"}
        self.lfs.actions[oid] = {"actions": {"download": {"href": f"http://localhost:{self.lfs.port}/objects/{oid}", "header": header}}}
        self.assertEqual(tree(self.fetch(name)["root"])["a.stl"], MESH)
        _, _, headers = self.lfs.requests[-1]
        self.assertNotIn("Authorization", headers)
        self.assertEqual(headers["X-Amz-Object"], "yes")

    def test_without_a_server_for_them_it_is_said(self):
        with GitServer() as server:
            server.add_repository("owner", "plain", {WORLDS: WORLD, "a.stl": pointer_to("a" * 64, 5)})
            self.fetch_from(server.url)
            self.assertEqual(self.fetch("plain")["error"], FAILED.format("plain") + f"{server.url} has no LFS server for it. Commit "
                             "them as ordinary files, or keep the repository where there is one; what .lfsconfig names is not asked.")

    def test_an_old_git_server_may_have_them_too(self):
        with GitServer(version2=False, lfs=self.lfs.port) as server:
            server.add_repository("owner", "old", {WORLDS: WORLD, "a.stl": self.lfs.pointer(MESH)})
            self.fetch_from(server.url)
            self.assertEqual(tree(self.fetch("old")["root"])["a.stl"], MESH)

    def test_a_pointer_with_extensions_is_refused(self):
        line = "ext-0-evil sha256:" + "b" * 64 + "\n"
        name, _ = self.repository({"a.stl": self.lfs.pointer(MESH).replace("oid", line + "oid")})
        self.assertIn('"a.stl" has to pass through a program', self.fetch(name)["error"])
        self.assertEqual(self.asked(), [])


class HostileLfsTest(LfsCase):
    """A hostile or broken LFS server: the failure is always a sentence, and nothing is kept."""

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.pointer = cls.lfs.pointer(MESH)
        cls.server.add_repository("owner", "evil", {WORLDS: WORLD, "a.stl": cls.pointer})

    def error(self, *options):
        answer = self.fetch("evil", *options)
        self.assertIn("error", answer)
        self.assertRegex(answer["error"], r"^(The large files \(Git LFS\) of owner/evil can't be fetched: |The project ).*[^.]\.$")
        self.assertEqual(self.left_in_cache(), [])
        self.assertNotIn("\x1b", answer["error"])
        return answer["error"].removeprefix(FAILED.format("evil"))

    def error_of_batch(self, answer):
        text = answer if isinstance(answer, bytes) else json.dumps(answer).encode()
        self.lfs.answers["batch"] = lambda handler: handler.answer(200, text)
        return self.error()

    def error_of_address(self, address, header=None):
        action = {"download": {"href": address, "header": header or {}}}
        return self.error_of_batch({"objects": [{"oid": digest(MESH), "size": len(MESH), "actions": action}]})

    def test_content_that_is_not_what_the_pointer_says_is_refused(self):
        wrong = 'the LFS server sends something else for "a.stl". Its author can send it there (git lfs push --all origin).'
        for content in (os.urandom(len(MESH)), MESH[:-1], MESH + b"x", b"", MESH[:-1] + b"x", self.pointer.encode()):
            self.lfs.answers["object"] = lambda handler: handler.answer(200, content)
            self.assertEqual(self.error(), wrong)
        self.lfs.answers["object"] = lambda handler: handler.answer_for_ever()
        self.assertEqual(self.error(), wrong)
        self.lfs.answers["object"] = lambda handler: handler.answer(200, MESH[:500], length=len(MESH))
        self.assertIn("the connection was cut", self.error())

    def test_answers_that_are_none_are_refused(self):
        good = {"oid": digest(MESH), "size": len(MESH)}
        for answer, words in ((b"", "sends no JSON"), (b"<html>", "sends no JSON"), (b'{"objects":[{"oid":', "sends no JSON"),
                              (b"[" * 100_000, "sends no JSON"), ({}, "sends no objects"), ([], "sends no JSON"),
                              ({"objects": [good] * 10_000}, "sends more objects than it was asked for"),
                              ({"objects": [{"oid": "b" * 64, "size": 1}]}, "sends an object that it was not asked for"),
                              ({"transfer": "tus", "objects": []}, "wants a transfer that was not asked for"),
                              (b" " * (2 << 20), "larger than 1 MB")):
            self.assertIn(words, self.error_of_batch(answer), words)
        self.lfs.answers["batch"] = lambda handler: handler.answer_for_ever()
        self.assertIn("larger than 1 MB", self.error())
        for answer in ({"objects": []}, {"objects": [good]}, {"objects": [{**good, "actions": {"upload": {"href": "x"}}}]}):
            self.assertIn('the LFS server does not have "a.stl"', self.error_of_batch(answer))

    def test_what_the_server_says_of_an_object_is_shown(self):
        for code, words in ((404, "does not have"), (410, "does not have"), (403, "quota"), (429, "Try again later"),
                            (509, "quota is used up"), (422, "out of order"), ("x", "does not have")):
            message = self.error_of_batch({"objects": [{"oid": digest(MESH), "size": len(MESH),
                                                        "error": {"code": code, "message": "Sorry\x1b[2J."}}]})
            self.assertIn("(it says: Sorry\\x1b[2J)", message)
            self.assertIn(words, message)

    def test_each_status_has_words(self):
        for status, words in ((401, "must be public"), (403, "quota not used up"), (404, "has no LFS server"), (501, "has no LFS server"),
                              (429, "try again later"), (500, "Try again later"), (509, "quota is used up"), (418, "status 418")):
            self.lfs.answers = {"batch": lambda handler: handler.answer(status, b'{"message":"no"}')}
            self.assertIn(words, self.error(), status)
        for status, words in ((401, "must be public"), (404, 'does not have "a.stl"'), (500, "Try again later"), (206, "status 206")):
            self.lfs.answers = {"object": lambda handler: handler.answer(status, b"")}
            self.assertIn(words, self.error(), status)

    def test_no_address_of_this_machine_or_its_networks_is_contacted(self):
        """The forge is at 127.0.0.1: its LFS server may redirect to public addresses, but to no other private one."""
        with socket.create_server(("127.0.0.2", 0)) as elsewhere:
            port = elsewhere.getsockname()[1]
            for host in (f"127.0.0.2:{port}", f"2130706434:{port}", f"[::ffff:127.0.0.2]:{port}", "[::1]:1", "169.254.169.254",
                         "10.0.0.1", "0.0.0.0:1"):
                with self.subTest(host):
                    self.assertRegex(self.error_of_address(f"http://{host}/x"), "^the LFS server leads to .*Only hosts of the Internet")
                    self.lfs.answers = {"object": lambda handler: handler.answer(302, b"", {"Location": f"http://{host}/x"})}
                    self.assertIn("the LFS server leads to ", self.error())
            elsewhere.setblocking(False)  # whoever has connected is in its queue
            with self.assertRaises(BlockingIOError):
                elsewhere.accept()

    def test_nor_through_a_proxy_which_is_at_a_private_address_itself(self):
        """What a proxy is asked for is decided by what the name means, not by the proxy's address."""
        with ForwardProxy() as proxy, unittest.mock.patch.dict(os.environ, {"http_proxy": proxy.url, "no_proxy": ""}), \
                LfsServer("127.0.0.2") as elsewhere:
            for url in (elsewhere.url, "http://name-of-nothing.invalid.example"):
                self.assertRegex(self.error_of_address(f"{url}/objects/{digest(MESH)}"), "^the LFS server leads to (127.0.0.2|name-of-nothing.invalid.example, a name)")
            self.assertEqual(elsewhere.requests, [])
            self.assertTrue(proxy.asked)
            self.assertFalse([each for each in proxy.asked if "127.0.0.2" in each or "name-of-nothing" in each], proxy.asked)
            self.lfs.reset()
            name, _ = self.repository({"a.stl": self.lfs.pointer(MESH)})
            self.assertEqual(tree(self.fetch(name)["root"])["a.stl"], MESH)

    def test_nor_over_a_connection_that_is_open_already(self):
        """The same for a fetch from a forge at that address."""
        with LfsServer("127.0.0.2") as elsewhere:
            action = {"download": {"href": f"{elsewhere.url}/objects/{digest(MESH)}"}}
            self.lfs.actions[digest(MESH)] = {"actions": action}
            other, message = self.probe.fetch_all([f"{elsewhere.url}/o/r/blob/main/{WORLDS}", f"owner/evil/blob/main/{WORLDS}"],
                                                  "--forge", elsewhere.url)
            self.assertIn("does not exist or is private", other["error"])
            self.assertIn("the LFS server leads to 127.0.0.2", message["error"])
            self.assertEqual([path for _, path, _ in elsewhere.requests if path.startswith("/objects/")], [])

    def test_addresses_that_are_not_of_http_are_refused(self):
        for address in ("file:///etc/passwd", "gopher://127.0.0.1/x", "/etc/passwd", "//127.0.0.1/x", "http://u:p@127.0.0.1/x", "x"):
            self.assertRegex(self.error_of_address(address), "sends an address that is (none|not HTTPS)", address)
        self.lfs.answers = {"object": lambda handler: handler.answer(302, b"", {"Location": "file:///etc/passwd"})}
        self.assertIn("sends an address that is not HTTPS", self.error())

    def test_redirects_in_circles_end(self):
        self.lfs.answers = {"object": lambda handler: handler.answer(302, b"", {"Location": handler.path})}
        self.assertIn("circles", self.error())
        self.lfs.answers = {"batch": lambda handler: handler.answer(307, b"", {"Location": "http://127.0.0.1:1/x"})}
        self.assertIn("redirects to another host", self.error())

    def test_headers_that_are_none_are_refused(self):
        for header, words in (({"X-Ms-A": "x\r\nHost: evil"}, "header that is none"), ({"A b": "x"}, "header that is none"),
                              ({"X-Ms-A": 1}, "header that is none"), ({f"X-Ms-A{i}": "x" for i in range(100)}, "too many headers"),
                              ({"X-Ms-A": "x" * 100_000}, "too many headers")):
            self.assertIn(words, self.error_of_address(f"{self.lfs.url}/objects/{digest(MESH)}", header))
        self.assertEqual([method for method, _, _ in self.lfs.requests if method == "GET"], [])

    def test_one_that_fails_ends_all(self):
        contents = [os.urandom(5_000) for _ in range(40)]
        name, _ = self.repository({f"{i}.bin": self.lfs.pointer(content) for i, content in enumerate(contents)})
        self.lfs.answers[digest(contents[0])] = lambda handler: handler.answer(500, b"")
        for content in contents[1:4]:
            self.lfs.answers[digest(content)] = lambda handler: handler.say_nothing()
        self.assertIn("status 500", self.fetch(name)["error"])
        self.assertEqual(self.left_in_cache(), [])

    def test_it_works_once_the_server_behaves(self):
        self.lfs.answers["object"] = lambda handler: handler.answer(500, b"")
        self.error()
        self.lfs.reset()
        self.assertEqual(tree(self.fetch("evil")["root"])["a.stl"], MESH)


class GitLfsClientTest(LfsCase):
    """Files that were stored by git-lfs arrive as git-lfs itself checks them out."""

    def run_git(self, *arguments, folder=None):
        environment = dict(os.environ, HOME=self.home, GIT_CONFIG_NOSYSTEM="1", GIT_TERMINAL_PROMPT="0", GIT_LFS_SKIP_SMUDGE="0")
        finished = subprocess.run(["git", *arguments], cwd=folder, env=environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
        self.assertEqual(finished.returncode, 0, finished.stdout.decode(errors="replace"))
        return finished.stdout.decode().strip()

    def test_it_delivers_the_same_files(self):
        if not shutil.which("git-lfs"):
            self.skipTest("git-lfs is missing (package git-lfs)")
        self.home = os.path.join(self.probe.folder, "home")
        work, clone = os.path.join(self.home, "work"), os.path.join(self.home, "clone")
        os.mkdir(self.home)
        self.run_git("config", "--global", "user.email", "test@localhost")
        self.run_git("config", "--global", "user.name", "Test")
        self.run_git("config", "--global", "--add", "safe.directory", "*")
        self.run_git("lfs", "install", "--skip-repo")
        path = self.server.add_repository("owner", "twin")
        self.run_git("init", "-q", "-b", "main", work)
        files = {WORLDS: WORLD.encode(), "meshes/a.stl": MESH, "meshes/same.stl": MESH, "t.png": TEXTURE, "empty.stl": b"", "b.txt": b"x"}
        for name, content in files.items():
            os.makedirs(os.path.dirname(os.path.join(work, name)) or work, exist_ok=True)
            with open(os.path.join(work, name), "wb") as file:
                file.write(content)
        self.run_git("lfs", "install", "--local", folder=work)
        self.run_git("lfs", "track", "*.stl", "*.png", folder=work)
        self.run_git("add", ".", folder=work)
        self.run_git("commit", "-q", "-m", "x", folder=work)
        self.run_git("config", "lfs.url", f"{self.server.url}/owner/twin.git/info/lfs", folder=work)
        self.run_git("push", "-q", path, "main", folder=work)
        self.assertTrue(self.run_git("-C", path, "show", "main:meshes/a.stl").startswith("version https://git-lfs"))
        self.run_git("clone", "-q", f"{self.server.url}/owner/twin.git", clone)
        theirs = {name: content for name, content in tree(clone).items() if not name.startswith(".git/") and name != ".git"}
        self.lfs.reset()
        ours = tree(self.fetch("twin")["root"])
        self.assertEqual(ours, theirs)
        self.assertEqual({name: ours[name] for name in files}, files)
        self.assertEqual(sorted(self.asked()), [("GET", "object")] * 2 + [("POST", "lfs/objects/batch")])


class BrowserTest(unittest.IsolatedAsyncioTestCase):
    """The messages to a browser that starts a project with large files."""

    def setUp(self):
        try:
            import websockets  # noqa: F401
        except ImportError as error:
            self.skipTest(f"{error} (package python3-websockets)")

    async def test_progress_then_the_simulation_or_the_reason(self):
        from support.browser_client import Browser
        with LfsServer() as lfs, GitServer(lfs=lfs.port) as git:
            git.add_repository("owner", "lab", {**demo_project(), "meshes/a.stl": lfs.pointer(MESH)})
            url = f"{git.url}/owner/lab/blob/main/worlds/arena.wbt"
            with SimulationServer(forges=[git.url], allowedRepositories=[git.url]) as simulation:
                shown = threading.Event()

                def answer_in_halves(handler):
                    handler.send_response(200)
                    handler.send_header("Content-Length", str(len(MESH)))
                    handler.end_headers()
                    handler.wfile.write(MESH[:len(MESH) // 2])
                    handler.wfile.flush()
                    shown.wait(30)
                    handler.wfile.write(MESH[len(MESH) // 2:])

                lfs.answers["object"] = lambda handler: handler.answer(404, b"")
                async with Browser(simulation) as browser:
                    await browser.start(url=url)
                    self.assertEqual(await browser.hear("loading: Error:"), "loading: Error: " + FAILED.format("lab") + "the LFS server "
                                     'does not have "meshes/a.stl". Its author can send it there (git lfs push --all origin); what '
                                     ".lfsconfig names is not asked.")
                lfs.answers["object"] = answer_in_halves
                async with Browser(simulation) as browser:
                    await browser.start(url=url)
                    await browser.hear("loading: Receiving large files 50% (0.0 MB)")
                    shown.set()
                    await browser.hear("webots:")
                    [path] = glob.glob(os.path.join(simulation.instances_folder(), "**", "meshes/a.stl"), recursive=True)
                    with open(path, "rb") as file:
                        self.assertEqual(file.read(), MESH)


if __name__ == "__main__":
    main()

#!/usr/bin/python3
"""The git source against servers that do not speak version 2 of git's protocol: libgit2 fetches from them, and everything
else works as with other servers."""

import http.server
import os
import subprocess
import sys
import threading

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
from support.git_case import GitCase, about_commit, main  # noqa: E402
from support.git_probe import HEADER, WORLD, tree  # noqa: E402

FILES = {
    "README.md": "# top\n",
    "worlds/top.wbt": WORLD,
    "projects/arm/worlds/arm.wbt": WORLD,
    "projects/arm/controllers/arm/arm.py": ("100755", "print('arm')\n"),
    "projects/arm/protos/Arm.proto": "PROTO Arm [] {}\n",
    "projects/arm/protos/link.proto": ("120000", "Arm.proto"),
    "projects/leg/big.bin": os.urandom(300_000),
    "empty/nothing.txt": "",
}
TOP = "owner/robots/blob/main/worlds/top.wbt"
ARM = "owner/robots/blob/main/projects/arm/worlds/arm.wbt"


class OldServerCase(GitCase):
    """A server that only speaks version 0."""

    def setUp(self):
        self.serve(version2=False)

    def asked(self):
        return [(method, address) for method, address, *_ in self.server.requests()]


class OldServerTest(OldServerCase):
    partial = False

    def setUp(self):
        super().setUp()
        self.path = self.server.add_repository(
            "owner", "robots", {"worlds/first.wbt": WORLD, "history.bin": os.urandom(1_000_000)}, partial=self.partial,
            branches={"feature/arm": {"worlds/slash.wbt": WORLD}}, tags={"v1.0": {"worlds/old.wbt": WORLD}})
        self.server.commit(self.path, FILES)

    def test_the_server_of_this_test_really_is_old(self):
        answer = subprocess.run(["git", "-c", "protocol.version=2", "ls-remote", f"{self.server.url}/owner/robots.git"],
                                stdout=subprocess.DEVNULL, stderr=subprocess.PIPE,
                                env=dict(os.environ, GIT_TRACE_PACKET="1", LC_ALL="C"))
        self.assertEqual(answer.returncode, 0)
        self.assertNotIn(b"version 2", answer.stderr)

    def test_a_whole_repository_arrives_without_its_history(self):
        answer = self.probe.fetch(TOP)
        self.assertEqual(answer.get("header"), HEADER, answer)
        found = tree(answer["root"])
        self.assertEqual(found["projects/leg/big.bin"], FILES["projects/leg/big.bin"])
        self.assertEqual(found["empty/nothing.txt"], b"")
        self.assertNotIn("history.bin", found)
        self.assertGreater(answer["bytes"], 300_000)
        self.assertLess(answer["bytes"], 900_000, "the history was fetched too")
        self.assertEqual(self.left_in_cache(), [])

    def test_a_folder_arrives_alone_with_its_modes_and_links(self):
        answer = self.probe.fetch(ARM)
        self.assertEqual(answer.get("header"), HEADER, answer)
        found = tree(answer["root"])
        self.assertEqual(set(found), {"worlds", "worlds/arm.wbt", "controllers", "controllers/arm",
                                      "controllers/arm/arm.py", "protos", "protos/Arm.proto", "protos/link.proto"})
        self.assertEqual(found["protos/link.proto"], "-> Arm.proto")
        self.assertTrue(os.access(os.path.join(answer["root"], "controllers/arm/arm.py"), os.X_OK))

    def test_branches_with_slashes_and_tags_are_understood(self):
        subprocess.run(["git", "-C", self.path, "-c", "user.name=t", "-c", "user.email=t@localhost", "tag", "-a", "-m", "x",
                        "annotated", "main"], check=True)
        for world in ("feature/arm/worlds/slash.wbt", "v1.0/worlds/old.wbt", "annotated/worlds/top.wbt"):
            self.assertEqual(self.probe.fetch(f"owner/robots/blob/{world}").get("header"), HEADER, world)

    def test_commits_that_a_branch_or_tag_points_to_are_found(self):
        for ref, world in (("main", "top.wbt"), ("feature/arm", "slash.wbt"), ("v1.0", "old.wbt")):
            commit = self.commit_of(ref)
            answer = self.probe.fetch(f"owner/robots/blob/{commit}/worlds/{world}")
            self.assertEqual(answer.get("revision"), commit, answer)
            self.assertEqual(answer["header"], HEADER)

    def test_other_commits_are_refused_as_nobody_knows_whose_they_are(self):
        self.server._git("-C", self.path, "update-ref", "refs/pull/1/head", "main")
        self.server.commit(self.path, dict(FILES, evil="x"), "refs/pull/1/head")
        for ref in ("main^", "refs/pull/1/head"):
            commit = self.commit_of(ref)
            self.assertEqual(self.probe.fetch(f"owner/robots/blob/{commit}/worlds/top.wbt").get("error"), about_commit("commit_not_newest", commit))
        self.assertEqual(os.listdir(os.path.join(self.probe.cache, "repositories")), [])

    def commit_of(self, ref):
        return self.server._git("-C", self.path, "rev-parse", ref + "^{commit}").decode().strip()

    def test_the_second_start_receives_nothing(self):
        first, second, folder = self.probe.fetch_all([TOP, TOP, ARM])
        self.assertEqual(second.get("revision"), first["revision"], second)
        self.assertEqual(second["bytes"], 0)
        self.assertEqual(folder.get("header"), HEADER, folder)
        packs = [address for method, address in self.asked() if method == "POST" and address.endswith("git-upload-pack")]
        self.assertEqual(len(packs), 3, "one question in version 2, and one pack per folder")

    def test_a_server_is_asked_once_what_it_speaks(self):
        self.probe.fetch_all([TOP] * 4)
        questions = [address for method, address in self.asked() if method == "GET"]
        self.assertEqual(len(questions), 5, "the question, and then libgit2's per start")

    def test_starts_at_once_fetch_once(self):
        answers = self.probe.fetch_all([ARM] * 8, "--together")
        self.assertEqual({answer.get("header") for answer in answers}, {HEADER})
        self.assertLessEqual(len(self.asked()), 4)

    def test_a_push_is_noticed(self):
        first = self.probe.fetch(TOP)
        self.server.commit(self.path, dict(FILES, **{"README.md": "# new\n"}))
        second = self.probe.fetch(TOP)
        self.assertNotEqual(second.get("revision"), first["revision"], second)
        self.assertEqual(tree(second["root"])["README.md"], b"# new\n")

    def test_without_the_server_it_starts_from_the_cache(self):
        first = self.probe.fetch(TOP)
        self.server.stop()
        self.assertEqual(self.probe.fetch(TOP).get("revision"), first["revision"])
        self.assertIn("from the cache", self.probe.log)

    def test_progress_is_reported(self):
        answer = self.probe.fetch(TOP)
        self.assertGreater(answer["objects_total"], len(FILES))
        self.assertEqual(answer["objects"], answer["objects_total"])

    def test_every_failure_has_words(self):
        commit = "0123456789" * 4
        for world, words in (
                ("owner/nothing/blob/main/worlds/a.wbt", "Repository owner/nothing does not exist or is private."),
                ("owner/robots/blob/nothing/worlds/a.wbt", 'Repository owner/robots has no branch or tag "nothing".'),
                (f"owner/robots/blob/{commit}/worlds/a.wbt", about_commit("commit_not_newest", "012345678901")),
                ("owner/robots/blob/main/nothing/worlds/a.wbt", 'Repository owner/robots has no folder "nothing".'),
                ("owner/robots/blob/main/empty/worlds/a.wbt", 'Repository owner/robots has no folder "empty/worlds".'),
                ("owner/robots/blob/main/worlds/a.wbt", "a.wbt does not exist.")):
            for answer in self.probe.fetch_all([world, world]):
                self.assertEqual(answer.get("error"), words)
            self.assertEqual(self.left_in_cache(), [])

    def test_an_empty_repository_has_no_branch(self):
        self.server.add_repository("owner", "void")
        self.assertEqual(self.probe.fetch("owner/void/blob/main/worlds/a.wbt").get("error"),
                         'Repository owner/void has no branch or tag "main".')

    def test_limits_of_bytes_and_files_are_kept(self):
        self.assertEqual(self.probe.fetch(TOP, "--files", "5").get("error"), "The project has more than 5 files.")
        answer = self.probe.fetch(TOP, "--bytes", "100000")
        self.assertIn("larger than", answer.get("error", ""))
        self.assertEqual(self.left_in_cache(), [])

    def test_many_small_bytes_that_become_many_are_refused(self):
        self.server.add_repository("owner", "zeros", {"worlds/a.wbt": WORLD, "zeros": b"\0" * 20_000_000})
        answer = self.probe.fetch("owner/zeros/blob/main/worlds/a.wbt", "--bytes", "5000000")
        self.assertIn("larger than", answer.get("error", ""))
        self.assertLess(answer["bytes"], 1_000_000)
        self.assertEqual(self.left_in_cache(), [])

    def test_hostile_names_and_links_out_are_left_out(self):
        path = self.server.add_repository("owner", "evil")
        blob = self.server.write_object(path, "blob", WORLD.encode())
        out = self.server.write_object(path, "blob", b"../../etc/passwd")
        worlds = ("40000", "worlds", [("100644", "a.wbt", blob)])
        world = "owner/evil/blob/main/worlds/a.wbt"
        for name in ("..", ".git", ".GIT", "git~1", "../evil"):
            self.server.commit_tree(path, sorted([worlds, ("100644", name, blob)], key=lambda entry: entry[1]))
            answer = self.probe.fetch(world)
            self.assertEqual(answer.get("forbidden"), [name], answer)
            self.assertEqual(set(tree(answer["root"])), {"worlds", "worlds/a.wbt"})
        self.server.commit_tree(path, [("120000", "link", out), ("160000", "module", "1" * 40), worlds])
        answer = self.probe.fetch(world)
        self.assertEqual(set(tree(answer["root"])), {"worlds", "worlds/a.wbt"})

    def test_a_full_disk_is_said(self):
        disk = self.small_disk()
        self.probe.cache = os.path.join(disk, "cache")
        self.server.add_repository("owner", "large", {"worlds/a.wbt": WORLD, "big": os.urandom(4_000_000)})
        answer = self.probe.fetch("owner/large/blob/main/worlds/a.wbt")
        self.assertIn("No space left on device", answer.get("error", ""))
        self.assertEqual(self.left_in_cache(), [])


class OldServerThatHandsOutAnyCommitTest(OldServerTest):
    """The same with a server that sends objects by their hashes."""

    partial = True


class SlowOldServerTest(OldServerCase):
    SIZE = 2_000_000

    def setUp(self):
        self.serve(version2=False, bytes_per_second=100_000).add_repository(
            "owner", "robots", {"worlds/top.wbt": WORLD, "big.bin": os.urandom(self.SIZE)})

    def test_a_cancelled_fetch_waits_for_no_transfer_and_leaves_nothing(self):
        answer = self.probe.fetch(TOP, "--cancel-at", "50000")
        self.assertEqual(answer.get("code"), "Operation canceled")
        self.assertLess(self.sent_in_transfer(answer["bytes"]), self.SIZE)
        self.assertEqual(self.left_in_cache(), [])

    def test_a_server_that_is_too_slow_is_given_up(self):
        answer = self.probe.fetch(TOP, "--timeout", "1500")
        self.assertIn("can't be reached", answer.get("error", ""))
        self.assertEqual(self.left_in_cache(), [])


def frame(payload):
    return b"%04x" % (len(payload) + 4) + payload


COMMIT = b"a" * 40
OLD_OFFER = (frame(b"# service=git-upload-pack\n") + b"0000" +
             frame(COMMIT + b" refs/heads/main\0side-band-64k ofs-delta shallow\n") + b"0000")


class Servant(http.server.BaseHTTPRequestHandler):
    protocol_version = "HTTP/1.1"

    def log_message(self, *_):
        pass

    def do_GET(self):
        self.server.gets += 1
        self.answer(self.server.offer)

    def do_POST(self):
        body = self.rfile.read(int(self.headers["Content-Length"]))
        if b"command=" in body:
            self.answer(b"")
            return
        self.server.wanted.append(body)
        if self.server.pack is None:  # silence
            self.send_response(200)
            self.send_header("Content-Length", "100000")
            self.end_headers()
            self.wfile.flush()
            self.server.over.wait(60)
            return
        self.answer(self.server.pack)

    def answer(self, body):
        self.send_response(200)
        self.send_header("Content-Length", str(len(body)))
        self.end_headers()
        self.wfile.write(body)


class StrangeOldServerTest(GitCase):
    def setUp(self):
        self.http = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Servant)
        self.http.handle_error = lambda *_: None  # connections that we cut are what is tested
        self.http.daemon_threads = True
        self.http.offer, self.http.pack, self.http.wanted, self.http.gets = OLD_OFFER, b"", [], 0
        self.http.over = threading.Event()
        threading.Thread(target=self.http.serve_forever, daemon=True).start()
        self.addCleanup(self.http.server_close)
        self.addCleanup(self.http.shutdown)
        self.addCleanup(self.http.over.set)
        self.fetch_from(f"http://127.0.0.1:{self.http.server_port}")

    def error(self, *options, **script):
        for name, value in script.items():
            setattr(self.http, name, value)
        answer = self.probe.fetch("evil/r/blob/main/worlds/a.wbt", *options)
        self.assertIn("error", answer)
        self.assertRegex(answer["error"], rf"^({self.probe.forge}(:| can't be reached:) |Repository evil/r |The (project|repository) ).*[^.]\.$")
        self.assertEqual(self.left_in_cache(), [])
        return answer["error"]

    def test_a_silent_server_is_given_up(self):
        self.assertIn("can't be reached", self.error("--timeout", "1500", pack=None))
        self.assertIn("can't be reached", self.error("--low-speed", "1000", "1000", pack=None))
        self.assertEqual(len(self.http.wanted), 2)

    def test_one_commit_is_asked_for_without_its_history(self):
        self.error()
        (wanted,) = self.http.wanted
        self.assertTrue(wanted.startswith(b"00") and b"want " + COMMIT in wanted, wanted)
        self.assertIn(frame(b"deepen 1\n") + b"0000", wanted)
        self.assertTrue(wanted.endswith(b"done\n"))

    def test_a_server_that_knows_no_depth_is_not_asked_for_it(self):
        self.error(offer=OLD_OFFER.replace(frame(COMMIT + b" refs/heads/main\0side-band-64k ofs-delta shallow\n"),
                                           frame(COMMIT + b" refs/heads/main\0side-band-64k ofs-delta\n")))
        (wanted,) = self.http.wanted
        self.assertNotIn(b"deepen", wanted)

    def test_answers_that_are_no_pack_are_refused(self):
        shallow = frame(b"shallow " + COMMIT + b"\n")
        nak = frame(b"NAK\n")
        for pack in (b"", b"0000", b"zzzz", shallow, shallow + b"0000", shallow + b"0000" + nak, nak, nak + b"0000",
                     nak + frame(b"\1PACK"), nak + frame(b"\1JUNKJUNKJUNKJUNK") + b"0000", nak + frame(b"\7x") + b"0000",
                     nak + frame(b"\1" + b"PACK\0\0\0\2\xff\xff\xff\xff") + b"0000", b"0003", shallow * 50_000):
            with self.subTest(pack[:60]):
                self.assertNotEqual(self.error(pack=pack), "")

    def test_what_the_server_says_is_shown_without_control_characters(self):
        message = self.error(pack=frame(b"ERR \x1b[2Jout of order\n"))
        self.assertIn("out of order", message)
        self.assertNotIn("\x1b", message)

    def test_answers_that_are_no_refs_are_refused(self):
        head = frame(b"# service=git-upload-pack\n") + b"0000"
        for offer in (head, head + b"0000", head + frame(b"x" * 40 + b" refs/heads/main\0\n") + b"0000", head + b"zzzz",
                      head + frame(COMMIT + b" refs/heads/main\0shallow\n"), head + frame(b"\0" * 100) + b"0000"):
            with self.subTest(offer[30:90]):
                self.assertNotEqual(self.error(offer=offer), "")

    def test_endless_refs_are_refused(self):
        line = frame(COMMIT + b" refs/heads/" + b"x" * 60_000 + b"\n")
        self.assertNotEqual(self.error(offer=OLD_OFFER[:-4] + line * 200 + b"0000"), "")


if __name__ == "__main__":
    main()

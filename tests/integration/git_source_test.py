#!/usr/bin/python3
"""The git source against real git servers: what arrives, from where, with how many requests, and the messages of failures.

Protocol sections 4.1.2 (steps 5 to 8) and 13 (refs), quirk Q6."""

import http.server
import os
import shutil
import signal
import socket
import subprocess
import sys
import threading

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
from support.git_case import GitCase, about_commit, main  # noqa: E402
from support.git_probe import HEADER, WORLD, Probe, tree  # noqa: E402
from support.git_server import GitServer  # noqa: E402
from support.proxy import Proxy  # noqa: E402
from support.waiting import wait_until  # noqa: E402

FILES = {
    "README.md": "# top\n",
    "worlds/top.wbt": WORLD,
    "projects/arm/worlds/arm.wbt": WORLD,
    "projects/arm/controllers/arm/arm.py": ("100755", "print('arm')\n"),
    "projects/arm/protos/Arm.proto": "PROTO Arm [] {}\n",
    "projects/arm/protos/Same.proto": "PROTO Arm [] {}\n",
    "projects/arm/protos/link.proto": ("120000", "Arm.proto"),
    "projects/leg/worlds/leg.wbt": WORLD,
    "projects/leg/big.bin": os.urandom(300_000),
    "empty/nothing.txt": "",
}
ARM = {path[len("projects/arm/"):]: value for path, value in FILES.items() if path.startswith("projects/arm/")}


class GitSourceTest(GitCase):
    """One server for all cases; each has a cache of its own."""

    partial = True
    NO_SUCH_COMMIT = about_commit("commit_on_no_branch", "012345678901")

    @classmethod
    def setUpClass(cls):
        cls.server = GitServer()
        cls.addClassCleanup(cls.server.close)
        cls.server.start()
        cls.path = cls.server.add_repository(
            "owner", "robots", FILES, partial=cls.partial,
            branches={"feature/arm": {"worlds/slash.wbt": WORLD}},
            tags={"v1.0": {"worlds/old.wbt": WORLD}})

    def setUp(self):
        self.fetch_from(self.server.url)

    def check_arm(self, answer):
        self.assertNotIn("error", answer)
        self.assertEqual(answer["header"], HEADER)
        found = tree(answer["root"])
        self.assertEqual(found["protos/link.proto"], "-> Arm.proto")
        for path, value in ARM.items():
            if path != "protos/link.proto":
                content = value[1] if isinstance(value, tuple) else value
                self.assertEqual(found[path], content.encode(), path)
        self.assertEqual(set(found), set(ARM) | {"worlds", "controllers", "controllers/arm", "protos"})
        self.assertTrue(os.access(os.path.join(answer["root"], "controllers/arm/arm.py"), os.X_OK))
        self.assertFalse(os.stat(os.path.join(answer["root"], "worlds/arm.wbt")).st_mode & 0o111)

    def test_a_folder_arrives_whole_and_alone(self):
        answer = self.probe.fetch("owner/robots/blob/main/projects/arm/worlds/arm.wbt")
        self.check_arm(answer)
        self.assertTrue(answer["root"].endswith("/robots/projects/arm"))
        if self.partial:
            self.assertLess(answer["bytes"], 100_000, "the neighbours were fetched too")

    def test_progress_never_falls_back(self):
        for world in ("projects/arm/worlds/arm.wbt", "worlds/top.wbt"):
            answer = self.probe.fetch(f"owner/robots/blob/main/{world}")
            self.assertEqual(answer["fell_back"], 0, world)
            self.assertEqual(answer["objects"], answer["objects_total"])
            self.assertGreater(answer["objects_total"], 0)

    def test_a_whole_repository_arrives(self):
        answer = self.probe.fetch("owner/robots/tree/main/worlds/top.wbt")
        found = tree(answer["root"])
        self.assertEqual(found["projects/leg/big.bin"], FILES["projects/leg/big.bin"])
        self.assertEqual(found["empty/nothing.txt"], b"")
        self.assertNotIn(".git", found)

    def test_branches_with_slashes_tags_and_commits_are_understood(self):
        for world in ("feature/arm/worlds/slash.wbt", "v1.0/worlds/old.wbt"):
            self.assertEqual(self.probe.fetch(f"owner/robots/blob/{world}").get("header"), HEADER, world)
        commit = self.probe.fetch("owner/robots/blob/main/worlds/top.wbt")["revision"]
        self.assertRegex(commit, "^[0-9a-f]{40}$")
        other = Probe(self.server.url)
        self.addCleanup(other.close)
        answer = other.fetch(f"owner/robots/blob/{commit}/projects/arm/worlds/arm.wbt")
        self.check_arm(answer)
        self.assertEqual(answer["revision"], commit)

    def test_links_of_all_forges_lead_to_the_same_project(self):
        """docs/access.md, "Links to worlds". That host is no forge's of the internet, so each link says which kind it is."""
        self.server.add_repository("group/of/groups", "robots", {"p/worlds/a.wbt": WORLD}, partial=self.partial, tags={"v1": {"p/worlds/a.wbt": WORLD + "#"}})
        of_branch = self.probe.fetch("group/of/groups/robots/-/blob/main/p/worlds/a.wbt")
        self.assertEqual(of_branch.get("header"), HEADER, of_branch)
        commit = of_branch["revision"]
        of_tag = self.probe.fetch("group/of/groups/robots/-/raw/v1/p/worlds/a.wbt?inline=false")["revision"]
        self.assertNotEqual(of_tag, commit)
        self.server.add_repository("-owner", "-robots", {"p/worlds/a.wbt": WORLD}, partial=self.partial, tags={"main": {"p/worlds/a.wbt": WORLD + "#"}})
        other = self.probe.fetch("-owner/-robots/blob/main/p/worlds/a.wbt")["revision"]
        tagged = self.probe.fetch("-owner/-robots/src/tag/main/p/worlds/a.wbt")["revision"]
        self.assertNotEqual(tagged, other)
        for link, revision in (
                ("group/of/groups/robots/-/tree/main/p/worlds/a.wbt?ref_type=heads", commit),
                (f"group/of/groups/robots/-/blob/{commit}/p/worlds/a.wbt#L1", commit),
                ("-owner/-robots/raw/refs/heads/main/p/worlds/a.wbt", other),
                ("-owner/-robots/src/branch/main/p/worlds/a.wbt", other),
                ("-owner/-robots/raw/branch/main/p/worlds/a.wbt", other),
                (f"-owner/-robots/src/commit/{other}/p/worlds/a.wbt", other),
                ("-owner/-robots/src/main/p/worlds/a.wbt", other),
                (f"-owner/-robots/src/{other}/p/worlds/a.wbt?at=main", other)):
            self.assertEqual(self.probe.fetch(link).get("revision"), revision, link)

    def test_the_second_start_asks_once_and_receives_nothing(self):
        world = "owner/robots/blob/main/projects/arm/worlds/arm.wbt"
        self.probe.fetch(world)
        before = len(self.server.requests())
        answer = self.probe.fetch(world)
        self.check_arm(answer)
        self.assertEqual(answer["bytes"], 0)
        self.assertEqual(len(self.requests(before)), 1)

    def test_a_simulation_that_writes_does_not_change_what_the_next_one_gets(self):
        world = "owner/robots/blob/main/projects/arm/worlds/arm.wbt"
        for _ in range(3):
            answer = self.probe.fetch(world)
            self.check_arm(answer)
            with open(os.path.join(answer["root"], "worlds/arm.wbt"), "r+") as file:
                file.write("broken")
            os.remove(os.path.join(answer["root"], "protos/Arm.proto"))

    def test_every_failure_has_words(self):
        commit = "0123456789" * 4
        for world, words in (
                ("owner/nothing/blob/main/worlds/a.wbt", "Repository owner/nothing does not exist or is private."),
                ("owner/robots/blob/nothing/worlds/a.wbt", 'Repository owner/robots has no branch or tag "nothing".'),
                (f"owner/robots/blob/{commit}/worlds/a.wbt", self.NO_SUCH_COMMIT),
                ("owner/robots/blob/main/nothing/worlds/a.wbt", 'Repository owner/robots has no folder "nothing".'),
                ("owner/robots/blob/main/empty/worlds/a.wbt", 'Repository owner/robots has no folder "empty/worlds".'),
                ("owner/robots/blob/main/worlds/a.wbt", "a.wbt does not exist."),
                ("http://elsewhere.test/o/r/blob/main/worlds/a.wbt", None)):
            answer = self.probe.fetch(world)
            self.assertIn("error", answer, world)
            if words:
                self.assertEqual(answer["error"], words)

    def test_what_is_no_commit_is_said(self):
        blob = self.server._git("-C", self.path, "rev-parse", "main:README.md").decode().strip()
        for name, target in (("file", blob), ("folder", "main^{tree}")):
            self.server._git("-C", self.path, "tag", name, target)
            self.assertEqual(self.probe.fetch(f"owner/robots/blob/{name}/worlds/top.wbt").get("error"),
                             f'Repository owner/robots has no commit at "{name}", but something else.')

    def test_repositories_with_names_of_another_kind_are_refused(self):
        path = os.path.join(self.server.repositories, "owner", "sha256.git")
        self.server._git("init", "-q", "--bare", "--object-format=sha256", path)
        self.assertEqual(self.probe.fetch("owner/sha256/blob/main/worlds/a.wbt").get("error"),
                         "Repository owner/sha256 has SHA-256 object names, which are not supported.")

    def test_a_missing_repository_is_asked_for_once_a_minute(self):
        before = len(self.server.requests())
        answers = self.probe.fetch_all(["owner/nothing/blob/main/worlds/a.wbt"] * 5)
        self.assertEqual({answer["error"] for answer in answers}, {"Repository owner/nothing does not exist or is private."})
        self.assertLessEqual(len(self.requests(before)), 2)

    def test_starts_of_the_same_project_at_once_fetch_once(self):
        before = len(self.server.requests())
        answers = self.probe.fetch_all(["owner/robots/blob/main/projects/arm/worlds/arm.wbt"] * 16, "--together")
        for answer in answers:
            self.check_arm(answer)
        self.assertEqual(len({answer["root"] for answer in answers}), 16)
        self.assertLessEqual(len(self.requests(before)), 3 if self.partial else 5)

    def test_limits_of_bytes_and_files_are_kept(self):
        world = "owner/robots/blob/main/worlds/top.wbt"
        self.assertEqual(self.probe.fetch(world, "--files", "5")["error"], "The project has more than 5 files.")
        answer = self.probe.fetch(world, "--bytes", "100000")
        self.assertIn("error", answer)
        self.assertNotIn("root", self.probe.fetch(world, "--bytes", "100000"))
        self.assertEqual(self.left_in_cache(), [])

    def test_a_damaged_entry_of_the_cache_is_fetched_again(self):
        world = "owner/robots/blob/main/projects/arm/worlds/arm.wbt"
        damages = {
            "a file is shorter": lambda entry: os.truncate(f"{entry}/files/projects/arm/worlds/arm.wbt", 3),
            "a file is missing": lambda entry: os.remove(f"{entry}/files/projects/arm/protos/Arm.proto"),
            "a file is a folder": lambda entry: (os.remove(f"{entry}/files/projects/arm/protos/Arm.proto"),
                                                 os.mkdir(f"{entry}/files/projects/arm/protos/Arm.proto")),
            "the index is empty": lambda entry: os.truncate(f"{entry}/index", 0),
            "the index is cut": lambda entry: os.truncate(f"{entry}/index", 100),
            "the index is missing": lambda entry: os.remove(f"{entry}/index"),
            "all files are missing": lambda entry: shutil.rmtree(f"{entry}/files")}
        self.check_arm(self.probe.fetch(world))
        for name, damage in damages.items():
            with self.subTest(name):
                (entry,) = self.snapshots()
                damage(entry)
                self.check_arm(self.probe.fetch(world))

    def test_the_cache_is_kept_below_its_size(self):
        self.probe.fetch("owner/robots/blob/main/worlds/top.wbt", "--cache-bytes", "400000")
        self.assertEqual(len(self.snapshots()), 1)
        self.probe.fetch("owner/robots/blob/main/projects/leg/worlds/leg.wbt", "--cache-bytes", "400000", "--discard")
        self.assertEqual(len(self.snapshots()), 1)
        before = len(self.server.requests())
        self.probe.fetch("owner/robots/blob/main/projects/leg/worlds/leg.wbt", "--cache-bytes", "400000")
        self.assertEqual(len(self.requests(before)), 1, "the newest one was removed")


class GitSourceWithoutFiltersTest(GitSourceTest):
    """The same with a server that does not support filters."""

    partial = False
    NO_SUCH_COMMIT = about_commit("commit_not_newest", "012345678901")


class FilterTest(GitCase):
    def test_a_server_that_promises_a_filter_and_refuses_it_is_asked_without_from_then_on(self):
        path = self.serve().add_repository("owner", "robots", FILES)
        self.server._git("-C", path, "config", "uploadpackfilter.blob:none.allow", "false")
        for answer in self.probe.fetch_all(["owner/robots/blob/main/projects/arm/worlds/arm.wbt",
                                            "owner/robots/blob/main/projects/leg/worlds/leg.wbt"]):
            self.assertEqual(answer.get("header"), HEADER, answer)
        self.assertEqual([method for method, *_ in self.requests()].count("GET"), 1)
        self.assertEqual(len(self.requests()), 6, "refs, refused, capabilities, pack; refs, pack")


class CommitTest(GitCase):
    """Commits by their hashes: the server sends any object it has, the source accepts only those that a branch or tag leads to."""

    FILES = {"worlds/a.wbt": WORLD, "p/worlds/b.wbt": WORLD}

    def setUp(self):
        self.serve()
        self.path = self.server.add_repository("owner", "robots")
        self.first = self.server.commit(self.path, self.FILES)
        self.second = self.server.commit(self.path, dict(self.FILES, x="1"))
        self.newest = self.server.commit(self.path, dict(self.FILES, x="2"))

    def fetch(self, commit, world="worlds/a.wbt", *options):
        return self.probe.fetch(f"owner/robots/blob/{commit}/{world}", *options)

    def check(self, commit, *path):
        answer = self.fetch(commit, *path)
        self.assertEqual(answer.get("revision"), commit, answer)
        self.assertEqual(answer["header"], HEADER)

    def check_refused(self, commit, words, world="worlds/a.wbt", *options):
        answer = self.fetch(commit, world, *options)
        self.assertEqual(answer.get("error"), words)
        self.assertEqual(self.left_in_cache(), [])
        self.assertEqual(os.listdir(os.path.join(self.probe.cache, "repositories")), [])

    def strangers(self):
        """Two commits that the server has: one of a pull request, and one that nothing leads to any more."""
        self.server._git("-C", self.path, "update-ref", "refs/pull/1/head", self.newest)
        offered = self.server.commit(self.path, dict(self.FILES, evil="1"), "refs/pull/1/head")
        self.server._git("-C", self.path, "update-ref", "refs/heads/gone", self.first)
        gone = self.server.commit(self.path, dict(self.FILES, evil="2"), "refs/heads/gone")
        self.server._git("-C", self.path, "update-ref", "-d", "refs/heads/gone")
        return offered, gone

    def test_what_a_branch_or_tag_points_to_takes_two_requests(self):
        self.check(self.newest)
        self.assertEqual(len(self.requests()), 2)
        for options in (("tag", "light"), ("-c", "user.name=t", "-c", "user.email=t@localhost", "tag", "-a", "-m", "x", "annotated")):
            tagged = self.server.commit(self.path, dict(self.FILES, x=options[-1]), "refs/heads/side")
            self.server._git("-C", self.path, *options, tagged)
            self.server._git("-C", self.path, "update-ref", "-d", "refs/heads/side")
            before = len(self.requests())
            self.check(tagged)
            self.assertLessEqual(len(self.requests(before)), 3)

    def test_what_a_branch_or_tag_leads_to_takes_one_request_more(self):
        self.check(self.first)
        self.assertEqual(len(self.requests()), 3)
        self.check(self.second, "p/worlds/b.wbt")

    def test_a_folder_of_it_takes_no_more(self):
        self.check(self.first, "p/worlds/b.wbt")
        self.assertEqual(len(self.requests()), 3)

    def test_where_files_and_history_are_not_handed_out_together_they_are_asked_for_one_after_the_other(self):
        file = self.server._git("-C", self.path, "rev-parse", f"{self.first}:p/worlds/b.wbt").decode().strip()
        self.server.refuse_to_pack(f"*--filter=tree:0*{file}*")
        self.check(self.first, "p/worlds/b.wbt")
        self.assertEqual(len(self.requests()), 5, "refs, folders, refused, history, file")

    def test_commits_of_strangers_are_refused_though_the_server_would_hand_them_out(self):
        for commit in self.strangers():
            clone = os.path.join(self.probe.folder, commit)
            for command in (["init", "-q", "--bare", clone], ["-C", clone, "fetch", "-q", f"{self.server.url}/owner/robots.git", commit]):
                self.server._git("-c", "protocol.version=2", *command)
            for world in ("worlds/a.wbt", "p/worlds/b.wbt"):
                self.check_refused(commit, about_commit("commit_on_no_branch", commit), world)

    def test_a_commit_of_a_stranger_that_was_taken_in_is_the_repositorys_own(self):
        offered, _ = self.strangers()
        self.server._git("-C", self.path, "update-ref", "refs/heads/main", offered)
        self.server.commit(self.path, self.FILES)
        self.check(offered)

    def test_a_commit_that_is_here_is_asked_about_no_more(self):
        self.check(self.first)
        before = len(self.requests())
        self.check(self.first)
        self.assertEqual(self.requests(before), [])
        self.check(self.first, "p/worlds/b.wbt")
        self.assertLessEqual(len(self.requests(before)), 2, "its other folder was fetched, and nothing else asked")
        self.server.stop()
        self.check(self.first)

    def test_a_history_that_is_too_large_is_not_looked_through(self):
        self.server.commit(self.path, self.FILES, message="x" * 20_000)
        self.check_refused(self.first, about_commit("history_too_large", self.first), "worlds/a.wbt", "--bytes", "10000")

    def test_a_server_without_filters_is_asked_for_tips_only(self):
        self.server.set_partial(self.path, False)
        self.check_refused(self.first, about_commit("commit_not_newest", self.first))
        self.check(self.newest)


class CacheTest(GitCase):
    """Which cache entries are kept and which are removed: each repository has a file of 300 kB, and the cache has room for two."""

    ROOM = ("--cache-bytes", "700000")

    def setUp(self):
        self.serve()
        for name in "abc":
            self.server.add_repository("owner", name, {"worlds/a.wbt": WORLD, "big": os.urandom(300_000)})

    def world(self, name):
        return f"owner/{name}/blob/main/worlds/a.wbt"

    def is_kept(self, name):
        before = len(self.server.requests())
        self.assertEqual(self.probe.fetch(self.world(name), *self.ROOM).get("header"), HEADER)
        return len(self.requests(before)) == 1

    def repositories(self):
        return os.listdir(os.path.join(self.probe.cache, "repositories"))

    def test_what_was_not_used_for_longest_goes_first(self):
        for name in "abac":
            self.probe.fetch(self.world(name), *self.ROOM)
        self.assertTrue(self.is_kept("a"), "it was used after b")
        self.assertTrue(self.is_kept("c"))
        self.assertFalse(self.is_kept("b"))

    def test_what_is_in_use_stays_however_full_the_cache_is(self):
        worlds = [self.world(name) for name in "abc"]
        self.probe.fetch_all(worlds, *self.ROOM, "--discard")
        self.assertEqual(len(self.snapshots()), 2)
        for way in ((), ("--fastest",)):  # copies may be wanted again (`reset`), mounts need the files
            answers = self.probe.fetch_all(worlds, *self.ROOM, *way)
            for answer in answers:
                if self.probe.way() == "overlay mounts":
                    self.addCleanup(subprocess.run, ["umount", answer["root"]], stderr=subprocess.DEVNULL)
                self.assertEqual(len(tree(answer["root"])["big"]), 300_000)
            self.assertEqual(len(self.snapshots()), 3)

    def test_files_of_no_size_take_room_too(self):
        self.server.add_repository("owner", "small", {"worlds/a.wbt": WORLD, **{f"file{i}": str(i) for i in range(200)}})
        self.probe.fetch(self.world("small"), *self.ROOM, "--discard")
        self.probe.fetch(self.world("a"), *self.ROOM, "--discard")
        self.assertEqual(len(self.snapshots()), 1, "200 files are 800 kB of a disk")

    def test_nothing_stays_of_a_repository_whose_last_folder_goes(self):
        self.probe.fetch_all([self.world(name) for name in "abc"], *self.ROOM, "--discard")
        self.assertEqual(len(self.repositories()), 2)
        left_over = os.path.join(self.probe.cache, "repositories", "0" * 40, "refs")
        os.makedirs(left_over)
        self.assertTrue(self.is_kept("c"))
        self.assertFalse(os.path.exists(os.path.dirname(left_over)))
        self.assertEqual(len(self.repositories()), 2)

    def test_on_a_full_disk_what_is_not_in_use_makes_room(self):
        self.probe.cache = os.path.join(self.small_disk("2m"), "cache")
        for name in ("one", "two"):
            self.server.add_repository("owner", name, {"worlds/a.wbt": WORLD, "big": os.urandom(1_200_000)})
        for name in ("one", "two", "one"):
            self.assertEqual(self.probe.fetch(self.world(name)).get("header"), HEADER, name)
        first, second = self.probe.fetch_all([self.world("one"), self.world("two")])
        self.assertEqual(first.get("header"), HEADER)
        self.assertEqual(second.get("error"), "This server can't store the project: No space left on device.")
        self.assertEqual(len(self.snapshots()), 1, "it is in use")


    def test_copies_get_the_room_of_what_is_not_in_use(self):
        disk = self.small_disk("2m")
        self.probe.may_mount = False
        self.probe.cache, self.probe.place = os.path.join(disk, "cache"), disk
        for name in "abca":
            self.assertEqual(self.probe.fetch(self.world(name), "--discard").get("header"), HEADER, name)
        with open(os.path.join(disk, "others"), "wb") as file:
            file.write(bytes(900_000))
        self.assertEqual(self.probe.fetch(self.world("a"), "--fastest").get("header"), HEADER)
        self.assertEqual(len(self.snapshots()), 1, "it is in use")

    def test_what_was_too_much_while_it_was_in_use_goes_after_that(self):
        self.probe.fetch_all([self.world(name) for name in "abc"], *self.ROOM, "--together", "--discard")
        self.assertEqual(len(self.snapshots()), 2)


class UnderMaintenance(http.server.BaseHTTPRequestHandler):
    """A website that answers every request with the same page."""

    def do_POST(self):
        self.send_response(200)
        self.end_headers()
        self.wfile.write(b"<html>Back soon</html>")

    do_GET = do_POST

    def log_message(self, *_):
        pass


class GitSourceUpdatesTest(GitCase):
    def setUp(self):
        self.serve()
        self.files = {"worlds/a.wbt": WORLD, "big.bin": os.urandom(500_000), "tool.sh": ("100755", "exit\n")}
        self.path = self.server.add_repository("owner", "robots", self.files)
        self.world = "owner/robots/blob/main/worlds/a.wbt"

    def slow_down(self, bytes_per_second):
        """The same repository on a slow server."""
        self.server.close()
        self.serve(bytes_per_second=bytes_per_second).add_repository("owner", "robots", self.files)

    def test_after_a_push_only_what_changed_is_fetched(self):
        first = self.probe.fetch(self.world)
        self.server.commit(self.path, dict(self.files, **{"worlds/a.wbt": WORLD + "# new\n", "tool.sh": "exit\n"}))
        answer = self.probe.fetch(self.world)
        self.assertNotEqual(answer["revision"], first["revision"])
        found = tree(answer["root"])
        self.assertEqual(found["worlds/a.wbt"], (WORLD + "# new\n").encode())
        self.assertEqual(found["big.bin"], self.files["big.bin"])
        self.assertFalse(os.access(os.path.join(answer["root"], "tool.sh"), os.X_OK), "it is no program any more")
        self.assertLess(answer["bytes"], 5_000)

    def test_what_a_push_has_removed_is_not_handed_out_again(self):
        """While the ref is being resolved, a start already checks out the commit that it referred to last time."""
        for self.probe.may_mount in (True, False):
            self.server.commit(self.path, dict(self.files, **{"old.txt": "old"}))
            self.assertIn("old.txt", tree(self.probe.fetch(self.world)["root"]))
            self.server.commit(self.path, self.files)
            self.assertEqual(set(tree(self.probe.fetch(self.world)["root"])), set(self.files) | {"worlds"})

    def test_slow_downloads_hold_up_no_start_from_the_cache(self):
        self.slow_down(20_000)
        self.server.add_repository("owner", "small", {"worlds/a.wbt": WORLD})
        small = "owner/small/blob/main/worlds/a.wbt"
        self.probe.fetch(small)
        worlds = [f"slow{number}/robots/blob/main/worlds/a.wbt" for number in range(12)]  # more than download at once
        for world in worlds:
            self.server.add_repository(world.split("/")[0], "robots", self.files)
        *slow, warm = self.probe.fetch_all([*worlds, small], "--together", "--timeout", "5000")
        self.assertIn("root", warm)
        self.assertEqual(self.probe.order[0], len(slow))

    def test_a_forge_that_never_answers_holds_up_no_start_from_another(self):
        self.probe.fetch(self.world)
        with socket.create_server(("127.0.0.1", 0), backlog=64) as listener:
            silent = f"http://127.0.0.1:{listener.getsockname()[1]}"
            worlds = [f"{silent}/owner/robots{number}/blob/main/worlds/a.wbt" for number in range(12)]  # more than ask at once
            *lost, warm = self.probe.fetch_all([*worlds, self.world], "--forge", silent, "--together", "--timeout", "3000")
        self.assertIn("root", warm)
        self.assertEqual(self.probe.order[0], len(lost))

    def test_a_branch_that_the_server_said_is_gone_does_not_start_without_the_server(self):
        self.server.commit(self.path, self.files, "refs/heads/side")
        side = "owner/robots/blob/side/worlds/a.wbt"
        self.assertIn("root", self.probe.fetch(side))
        self.server._git("-C", self.path, "update-ref", "-d", "refs/heads/side")
        self.assertIn("no branch or tag", self.probe.fetch(side)["error"])
        self.server.stop()
        self.assertIn("can't be reached", self.probe.fetch(side)["error"])

    def test_a_forge_that_answers_with_a_page_is_no_reason_not_to_start(self):
        self.probe.fetch(self.world)
        self.server.stop()
        with http.server.ThreadingHTTPServer(("127.0.0.1", self.server.port), UnderMaintenance) as website:
            threading.Thread(target=website.serve_forever, daemon=True).start()
            answer = self.probe.fetch(self.world)
            website.shutdown()
        self.assertIn("root", answer)
        self.assertIn("from the cache", self.probe.log)

    # Here a slow server may take an hour.
    def test_a_forge_that_says_nothing_is_not_waited_for_when_the_cache_knows_the_address(self):
        first = self.probe.fetch(self.world)
        self.server.stop()
        with socket.create_server(("127.0.0.1", self.server.port)):
            answer = self.probe.fetch(self.world, "--patience", "300", "--low-speed", "1", "3600000")
        self.assertEqual(answer.get("revision"), first["revision"])
        self.assertIn("can't be reached", self.probe.log)
        self.assertIn("from the cache", self.probe.log)

    def test_without_the_server_it_starts_from_the_cache_and_says_so(self):
        first = self.probe.fetch(self.world)
        self.server.stop()
        answer = self.probe.fetch(self.world)
        self.assertEqual(answer.get("revision"), first["revision"])
        self.assertIn("can't be reached", self.probe.log)
        self.assertIn("from the cache", self.probe.log)
        self.assertIn("can't be reached", self.probe.fetch("owner/other/blob/main/worlds/a.wbt")["error"])

    def test_a_kill_in_the_middle_of_a_fetch_leaves_nothing_behind(self):
        self.slow_down(100_000)
        command = self.probe.command([self.world])
        process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        incoming = os.path.join(self.probe.cache, "incoming")
        wait_until(lambda: os.path.isdir(incoming) and os.listdir(incoming), "it fetches nothing")
        process.send_signal(signal.SIGKILL)
        process.wait()
        self.assertTrue(os.listdir(incoming), "it was killed too late to prove anything")
        answer = self.probe.fetch(self.world)
        self.assertEqual(tree(answer["root"])["big.bin"], self.files["big.bin"])
        self.assertEqual(os.listdir(incoming), [])

    def test_a_cancelled_fetch_waits_for_no_transfer_and_leaves_nothing(self):
        self.slow_down(100_000)
        answer = self.probe.fetch(self.world, "--cancel-at", "50000")
        self.assertEqual(answer["code"], "Operation canceled")
        self.assertLess(self.sent_in_transfer(answer["bytes"]), len(self.files["big.bin"]))
        self.assertEqual(self.left_in_cache(), [])

    def test_a_server_that_is_too_slow_is_given_up(self):
        self.slow_down(20_000)
        for options in (("--timeout", "1500"), ("--low-speed", "200000", "1000")):
            answer = self.probe.fetch(self.world, *options)
            self.assertIn("can't be reached", answer["error"])

    def test_servers_that_only_serve_files_are_refused(self):
        self.server.stop()
        self.serve(smart=False).add_repository("owner", "robots", self.files)
        self.assertIn("smart protocol", self.probe.fetch(self.world)["error"])


class RoundTripsTest(GitCase):
    """How many round trips a start makes to a distant server, counted by a proxy."""

    def setUp(self):
        self.path = self.serve().add_repository("owner", "robots", FILES)
        proxy = self.enterContext(Proxy(self.server.port))
        self.fetch_from(f"http://127.0.0.1:{proxy.port}")
        self.proxy = proxy

    def turns(self, *worlds):
        """Round trips of consecutive starts in one process, and how many connections these opened."""
        turns, connections = self.proxy.turns, self.proxy.connections
        for answer in self.probe.fetch_all(worlds):
            self.assertEqual(answer.get("header"), HEADER, answer)
        return self.proxy.turns - turns, self.proxy.connections - connections

    def test_a_cold_start_of_a_repository_takes_two_and_a_warm_one_takes_one(self):
        world = "owner/robots/blob/main/worlds/top.wbt"
        self.assertEqual(self.turns(world), (2, 1))
        self.assertEqual(self.turns(world), (1, 1))
        self.assertEqual(self.turns(world, world, world), (3, 1), "the connection is kept")

    def test_a_cold_start_of_a_folder_takes_three_and_a_warm_one_takes_one(self):
        world = "owner/robots/blob/main/projects/arm/worlds/arm.wbt"
        self.assertEqual(self.turns(world), (3, 1))
        self.assertEqual(self.turns(world), (1, 1))

    def test_a_start_after_a_push_takes_three(self):
        world = "owner/robots/blob/main/worlds/top.wbt"
        self.turns(world)
        self.server.commit(self.path, dict(FILES, **{"README.md": "# new\n"}))
        self.assertEqual(self.turns(world), (3, 1))

    def test_a_commit_that_a_branch_leads_to_takes_three(self):
        older = self.server._git("-C", self.path, "rev-parse", "main").decode().strip()
        self.server.commit(self.path, dict(FILES, **{"README.md": "# new\n"}))
        self.assertEqual(self.turns(f"owner/robots/blob/{older}/projects/arm/worlds/arm.wbt"), (3, 1))

    def test_a_commit_that_is_known_takes_none(self):
        commit = self.probe.fetch("owner/robots/blob/main/worlds/top.wbt")["revision"]
        self.assertEqual(self.turns(f"owner/robots/blob/{commit}/worlds/top.wbt"), (0, 0))


class HandOutTest(GitCase):
    """The ways of copying that this machine supports."""

    WORLD = "owner/robots/blob/main/projects/arm/worlds/arm.wbt"

    def setUp(self):
        self.serve().add_repository("owner", "robots", FILES)

    def test_an_overlay_takes_writes_and_is_gone_after_discarding(self):
        probe = self.probe
        probe.fetch(self.WORLD, "--fastest", "--discard")
        if probe.way() != "overlay mounts":
            self.skipTest("this machine allows no overlay mounts")
        self.assertEqual(os.listdir(probe.into), [], "the source's trial was left")
        answer = probe.fetch(self.WORLD, "--fastest")
        mounted = answer["root"].removesuffix("/projects/arm")
        self.addCleanup(subprocess.run, ["umount", mounted], stderr=subprocess.DEVNULL)
        with open(os.path.join(answer["root"], "worlds/arm.wbt"), "w") as file:
            file.write("broken")
        os.rename(os.path.join(answer["root"], "worlds"), os.path.join(answer["root"], "others"))
        again = probe.fetch(self.WORLD)
        self.assertEqual(tree(again["root"])["worlds/arm.wbt"], WORLD.encode())
        probe.fetch(self.WORLD, "--fastest", "--discard")
        with open("/proc/self/mountinfo") as mounts:
            ours = [line for line in mounts if probe.folder in line]
        self.assertEqual(len(ours), 1, "only the one that was not discarded is left")

    def test_unrelated_folders_are_stored_far_from_each_other_where_the_file_system_can(self):
        own = os.path.join(self.probe.folder, "own")
        os.mkdir(own)
        if subprocess.run(["chattr", "+T", own], stderr=subprocess.DEVNULL).returncode != 0:
            self.skipTest("this file system has no such choice (ext4 has)")
        self.probe.fetch(self.WORLD, "--fastest", "--discard")
        for folder in (os.path.join(self.probe.cache, "incoming"), self.probe.into):
            attributes = subprocess.run(["lsattr", "-d", folder], stdout=subprocess.PIPE, check=True).stdout.split()[0]
            self.assertIn(b"T", attributes, folder)

    def test_reflinks_take_writes_where_the_file_system_has_them(self):
        disk = self.xfs_disk()
        self.probe.may_mount = False
        self.probe.cache = os.path.join(disk, "cache")
        self.probe.place = disk
        for _ in range(2):
            answer = self.probe.fetch(self.WORLD, "--fastest")
            self.assertEqual(self.probe.way(), "reflinks")
            self.assertEqual(tree(answer["root"])["worlds/arm.wbt"], WORLD.encode())
            with open(os.path.join(answer["root"], "worlds/arm.wbt"), "r+") as file:
                file.write("broken")

    def test_a_full_disk_of_the_instances_is_said_and_does_not_harm_the_cache(self):
        world = "owner/robots/blob/main/worlds/top.wbt"  # with a file of 300 kB
        elsewhere = self.probe.place
        self.probe.may_mount = False
        self.probe.place = self.small_disk("200k")
        answer = self.probe.fetch(world, "--fastest", "--discard")
        self.assertEqual(answer.get("error"), "This server can't store the project: No space left on device.")
        self.assertEqual(os.listdir(self.probe.into), [])
        self.assertEqual(self.probe.fetch(self.WORLD, "--fastest").get("header"), HEADER, "there was room for this one")
        self.probe.place = elsewhere
        before = len(self.requests())
        answer = self.probe.fetch(world, "--fastest")
        self.assertEqual(tree(answer["root"])["projects/leg/big.bin"], FILES["projects/leg/big.bin"])
        self.assertEqual(len(self.requests(before)), 1, "it was fetched again")

    def test_who_may_not_mount_gets_the_same_files(self):
        self.probe.may_mount = False
        answer = self.probe.fetch(self.WORLD, "--fastest")
        self.assertIn(self.probe.way(), ("copying", "reflinks"))
        self.assertEqual(tree(answer["root"])["worlds/arm.wbt"], WORLD.encode())


if __name__ == "__main__":
    main()

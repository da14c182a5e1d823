#!/usr/bin/python3
"""A folder of a repository beside git's own checkout of it: `git sparse-checkout set --cone`, as the Python server did.

Protocol section 4.1.2, step 6. A cone has the folder and, of the folders that it lies in, their own files."""

import os
import shutil
import subprocess
import sys

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
from support.git_case import GitCase, main  # noqa: E402
from support.git_probe import HEADER, WORLD, tree  # noqa: E402

MODULE = ("160000", "1" * 40)
REPOSITORIES = {
    "the project is the repository": ("", {
        "worlds/a.wbt": WORLD, "README.md": "# top\n", "tool": ("100755", "exit\n"), "protos/link": ("120000", "../README.md"),
        "module": MODULE}),
    "one folder": ("arm", {
        "arm/worlds/a.wbt": WORLD, "README.md": "# top\n", "requirements.txt": "numpy\n", "setup": ("100755", "exit\n"),
        "latest": ("120000", "arm/worlds"), ".gitattributes": "*.wbt export-ignore\n", "leg/worlds/b.wbt": WORLD}),
    "three folders": ("projects/robots/arm", {
        "projects/robots/arm/worlds/a.wbt": WORLD, "projects/robots/arm/deep/deeper/x": "x", "projects/robots/arm/tool": ("100755", ""),
        "projects/robots/Arm.proto": "PROTO Arm [] {}\n", "projects/robots/tool": ("100755", "exit\n"), "projects/notes": "n",
        "README.md": "# top\n", "projects/robots/leg/worlds/b.wbt": WORLD, "projects/other/x": "x", "other/x": "x"}),
    "nothing beside it": ("a/b", {"a/b/worlds/a.wbt": WORLD, "a/c/x": "x", "d/x": "x"}),
    "links": ("projects/arm", {
        "projects/arm/worlds/a.wbt": WORLD, "shared.proto": "PROTO S [] {}\n", "projects/same": "n", "other/x": "x",
        "projects/arm/protos/S.proto": ("120000", "../../../shared.proto"), "projects/arm/n": ("120000", "../same"),
        "projects/arm/not_there": ("120000", "../../other/x"), "projects/arm/root": ("120000", "../.."),
        "projects/arm/own": ("120000", "worlds/a.wbt"), "projects/into": ("120000", "arm/worlds/a.wbt"),
        "projects/up": ("120000", ".."), "top": ("120000", "projects"), "nowhere": ("120000", "nothing")}),
    "submodules": ("projects/arm", {
        "projects/arm/worlds/a.wbt": WORLD, "projects/arm/module": MODULE, "module": MODULE, "projects/module": MODULE,
        ".gitmodules": '[submodule "module"]\n\tpath = module\n\turl = ../module\n'}),
    "names": ("projects/-rf", {
        "projects/-rf/worlds/a.wbt": WORLD, "$(touch evil)": "x", "projects/a b": "y", "projects/'": "z", "CON": "c"}),
    "odd names": ("projects/arm", {
        "projects/arm/worlds/a.wbt": WORLD, "projects/arm/Icon\r": "", "projects/arm/textures/h\udcf6he.png": "p", "projects/arm/a\nb/c\td": "n",
        "projects/arm/\x1b[2J": ("100755", "e"), "projects/arm/'&#[]%!\"": "q", "projects/arm/\u202egnp": ("120000", "Icon\r"), "Icon\r": "i", "h\udcf6he": "h",
        "projects/arm/to": ("120000", "textures/h\udcf6he.png")}),
}
ARM = "projects/arm/"
LARGE = bytes(9_000_000)  # more than the files of the folders above may have together; what counts is how large it is unpacked
LACKS = "lacks the files of the folders above it, which are too large or too many (more than 8 MB or 1000)."


def with_modes(root):
    """Like `tree`, with the permission to execute files."""
    return {path: (content, os.access(os.path.join(root, path), os.X_OK)) if isinstance(content, bytes) else content
            for path, content in tree(root).items() if path != ".git" and not path.startswith(".git/")}


class ConeTest(GitCase):
    version2 = True

    def setUp(self):
        self.serve(version2=self.version2)

    def cone(self, name, folder):
        """What git checks out."""
        clone = os.path.join(self.probe.folder, "clone")
        shutil.rmtree(clone, ignore_errors=True)
        run = self.server._git
        run("clone", "-q", "--depth=1", "--filter=blob:none", "--no-checkout", f"{self.server.url}/owner/{name}.git", clone)
        if folder:
            run("-C", clone, "sparse-checkout", "set", "--cone", folder)
        run("-C", clone, "checkout", "-q", "main")
        return with_modes(clone)

    def test_a_project_has_what_git_checks_out(self):
        worlds, expected = {}, {}
        for number, (what, (folder, files)) in enumerate(REPOSITORIES.items()):
            name = f"r{number}"
            self.server.add_repository("owner", name, files)
            worlds[what] = f"owner/{name}/blob/main/{folder + '/' if folder else ''}worlds/a.wbt"
            cone = self.cone(name, folder)
            # Git makes an empty folder of each submodule in the cone.
            expected[what] = {path: content for path, content in cone.items() if files.get(path) != MODULE}
        for self.probe.may_mount in (True, False):
            for _ in range(2):  # the second are from the cache
                for what, answer in zip(worlds, self.probe.fetch_all(list(worlds.values()), "--fastest")):
                    with self.subTest(what, way=self.probe.way()):
                        self.assertEqual(answer.get("header"), HEADER, answer)
                        folder = REPOSITORIES[what][0]
                        root = answer["root"].removesuffix("/" + folder) if folder else answer["root"]
                        self.assertRegex(root, "/r[0-9]$")
                        if self.probe.way() == "overlay mounts":
                            self.addCleanup(subprocess.run, ["umount", root], stderr=subprocess.DEVNULL)
                        self.assertEqual(with_modes(root), expected[what])


class OldServerConeTest(ConeTest):
    """The same with a server that sends whole commits only."""

    version2 = False

    def cone(self, name, folder):
        clone = os.path.join(self.probe.folder, "clone")
        shutil.rmtree(clone, ignore_errors=True)
        self.server._git("clone", "-q", "--no-checkout", os.path.join(self.server.repositories, "owner", name + ".git"), clone)
        if folder:
            self.server._git("-C", clone, "sparse-checkout", "set", "--cone", folder)
        self.server._git("-C", clone, "checkout", "-q", "main")
        return with_modes(clone)


class ParentFilesTest(GitCase):
    FILES = {ARM + "worlds/a.wbt": WORLD, ARM + "mesh": "m", "requirements.txt": "numpy\n", "projects/Shared.proto": "PROTO S [] {}\n"}
    OWN = {"projects", "projects/arm", ARM + "worlds", ARM + "worlds/a.wbt", ARM + "mesh"}

    def setUp(self):
        self.serve()

    def repository(self, more=None):
        self.path = self.server.add_repository("owner", "robots", dict(self.FILES, **(more or {})))

    def fetch(self, *options, ref="main"):
        answer = self.probe.fetch(f"owner/robots/blob/{ref}/{ARM}worlds/a.wbt", *options)
        self.assertEqual(answer.get("header"), HEADER, answer)
        self.assertTrue(answer["fell_back"] == 0 or ref != "main", "there was less progress than before")
        self.root = answer["root"].removesuffix("/projects/arm")
        if self.probe.way() == "overlay mounts":
            self.addCleanup(subprocess.run, ["umount", self.root], stderr=subprocess.DEVNULL)
        return answer

    def check_kept(self, more=()):
        self.assertEqual(set(tree(self.root)), self.OWN | {"requirements.txt", "projects/Shared.proto"} | set(more))
        self.assertNotIn(LACKS, self.probe.log)

    def check_left_out(self, more=()):
        self.assertEqual(set(tree(self.root)), self.OWN | set(more))
        self.assertIn(f"The project in projects/arm of owner/robots {LACKS}", self.probe.log)

    def test_small_ones_come_in_the_same_three_requests(self):
        self.repository()
        self.fetch()
        self.check_kept()
        self.assertEqual(len(self.requests()), 3)

    def test_small_ones_come_with_a_commit_by_its_hash(self):
        self.repository()
        older = self.server._git("-C", self.path, "rev-parse", "main").decode().strip()
        self.server.commit(self.path, {"x": "x"})
        self.fetch(ref=older)
        self.check_kept()
        self.assertEqual(len(self.requests()), 3)

    def test_a_large_one_keeps_nobody_waiting(self):
        """Requested with the others and cut off, then once more alone: a file of the project might have been the large one."""
        noise = os.urandom(len(LARGE))
        self.repository({"video.mp4": noise})
        answer = self.fetch()
        self.check_left_out()
        self.assertEqual(len(self.requests()), 5)
        self.assertLess(answer["bytes"], len(noise) / 2)
        before = len(self.requests())
        self.fetch()
        self.assertEqual(set(tree(self.root)), self.OWN)
        self.assertEqual(len(self.requests(before)), 1)
        self.assertNotIn(LACKS, self.probe.log)

    def test_many_that_are_large_together_keep_nobody_waiting(self):
        self.repository({f"picture{number}": bytes([number]) * (len(LARGE) // 3) for number in range(4)})
        self.fetch()
        self.check_left_out()
        self.assertEqual(len(self.requests()), 4)

    def test_too_many_are_not_asked_for(self):
        self.repository({f"note{number}": str(number) for number in range(1000)})
        self.fetch()
        self.check_left_out()
        self.assertEqual(len(self.requests()), 3)

    def test_a_large_one_of_an_old_server_is_left_out_too(self):
        self.server.close()
        self.serve(version2=False)
        self.repository({"video.mp4": LARGE})
        self.fetch()
        self.check_left_out()

    def test_a_large_one_beside_a_commit_by_its_hash_is_left_out_too(self):
        self.repository({"video.mp4": LARGE})
        older = self.server._git("-C", self.path, "rev-parse", "main").decode().strip()
        self.server.commit(self.path, {"x": "x"})
        self.fetch(ref=older)
        self.check_left_out()
        self.assertEqual(len(self.requests()), 6, "refs, folders, history with files, history, the project's files, the others")

    def test_a_large_file_of_the_project_takes_nothing_from_it(self):
        for backwards in (False, True):
            with self.subTest(backwards=backwards):
                if backwards:
                    self.server.close()
                    self.serve().pack_backwards()
                self.repository({ARM + "scan": LARGE})
                before = len(self.requests())
                self.fetch()
                self.check_kept([ARM + "scan"])
                self.assertEqual(len(self.requests(before)), 5 if backwards else 3)

    def test_one_that_the_project_has_too_is_the_projects(self):
        self.repository({"scan": LARGE, ARM + "scan": LARGE})
        self.fetch()
        self.assertEqual(tree(self.root)[ARM + "scan"], LARGE)
        self.check_left_out([ARM + "scan"])

    def test_limits_count_the_project_first(self):
        self.repository()
        self.fetch("--files", "3")
        self.check_left_out()

    def test_one_that_a_push_changed_is_new_and_alone_is_fetched(self):
        self.repository({ARM + "scan": os.urandom(300_000)})
        self.fetch()
        self.server.commit(self.path, dict(self.FILES, **{"requirements.txt": "scipy\n"}))
        answer = self.fetch()
        self.assertEqual(tree(self.root)["requirements.txt"], b"scipy\n")
        self.check_kept()
        self.assertLess(answer["bytes"], 5_000)

    def test_a_simulation_that_writes_to_them_changes_nothing_for_the_next_one(self):
        self.repository()
        for self.probe.may_mount in (True, False, True):
            self.fetch("--fastest")
            found = tree(self.root)
            self.assertEqual(found["requirements.txt"], b"numpy\n")
            self.check_kept()
            with open(os.path.join(self.root, "requirements.txt"), "r+") as file:
                file.write("broken")
            os.remove(os.path.join(self.root, "projects/Shared.proto"))

    def test_one_that_is_changed_or_missing_in_the_cache_is_fetched_again(self):
        self.repository()
        self.fetch()

        def write(entry):
            with open(f"{entry}/files/requirements.txt", "r+") as file:
                file.write("evil")

        def forget(entry):
            os.remove(f"{entry}/files/requirements.txt")
            with open(f"{entry}/index", "r+") as index:
                lines = index.readlines()
                index.seek(0)
                index.truncate()
                index.writelines(line for line in lines if not line.endswith(" requirements.txt\n"))

        for damage in (write, forget):
            with self.subTest(damage.__name__):
                (entry,) = self.snapshots()
                damage(entry)
                self.fetch()
                self.assertEqual(tree(self.root)["requirements.txt"], b"numpy\n")
                self.assertIn("was changed after it had been fetched", self.probe.log)


class HostileParentsTest(GitCase):
    """Files above a project can't make its start fail, and their links can't leave the repository."""

    def setUp(self):
        self.path = self.serve().add_repository("evil", "r")

    def blob(self, content):
        return self.server.write_object(self.path, "blob", content)

    def fetch(self, beside, project=()):
        """The tree that is checked out for the folder p/arm of a repository with these entries beside it, and in it."""
        worlds = ("40000", "worlds", [("100644", "a.wbt", self.blob(WORLD.encode()))])
        arm = ("40000", "arm", [*project, worlds])
        self.server.commit_tree(self.path, [*beside, ("40000", "p", [*beside, arm])])
        before = set(tree(self.probe.folder))
        answer = self.probe.fetch("evil/r/blob/main/p/arm/worlds/a.wbt")
        added = {path for path in set(tree(self.probe.folder)) - before if not path.startswith(("cache", "run"))}
        self.assertEqual(added, set(), "something was written outside of the project")
        self.assertEqual(answer.get("header"), HEADER, answer)
        self.assertFalse(os.path.exists(os.path.join(self.probe.into, "evil")))
        return tree(answer["root"].removesuffix("/p/arm"))

    OWN = {"p", "p/arm", "p/arm/worlds", "p/arm/worlds/a.wbt"}

    def test_names_that_lead_elsewhere_are_left_out(self):
        evil = self.blob(b"evil")
        for mode in ("100644", "120000"):
            beside = [(mode, name, evil) for name in
                      ("..", ".", ".git", ".GIT", "git~1", "../evil", "/tmp/evil", "..\\evil", ".g\u200cit", "x" * 256)]
            self.assertEqual(set(self.fetch([*beside, ("100644", "good", evil)])), self.OWN | {"good", "p/good"})

    def test_links_in_the_place_of_a_folder_or_a_file_are_not_followed(self):
        out, evil = self.blob(b"../.."), self.blob(b"evil")
        beside = [("120000", "p", out), ("120000", "arm", out), ("120000", "x", out), ("100644", "x", evil)]
        found = self.fetch(beside)
        # The path to the project must be a folder; of two entries with one name the first counts. These links lead out of the repository.
        self.assertEqual({path: content for path, content in found.items() if path not in self.OWN}, {})
        self.assertIsNone(found["p"])
        self.assertIsNone(found["p/arm"])

    def test_links_stay_in_the_repository(self):
        targets = {"a": "..", "b": "../..", "c": "p/../..", "d": "/etc/passwd", "e": "p/arm", "f": "./.."}
        links = [("120000", name, self.blob(target.encode())) for name, target in targets.items()]
        inner = {"g": "../../..", "h": "../..", "i": "worlds/../../../..", "j": "../../../r/x"}
        project = [("120000", name, self.blob(target.encode())) for name, target in inner.items()]
        found = {path: content for path, content in self.fetch(links, project).items() if isinstance(content, str)}
        self.assertEqual(found, {"e": "-> p/arm", "p/a": "-> ..", "p/e": "-> p/arm", "p/f": "-> ./..", "p/arm/h": "-> ../.."})

    def test_folders_that_are_called_like_gits_own_are_refused(self):
        worlds = ("40000", "worlds", [("100644", "a.wbt", self.blob(WORLD.encode()))])
        self.server.commit_tree(self.path, [("40000", "git~1", [worlds])])
        self.assertEqual(self.probe.fetch("evil/r/blob/main/git~1/worlds/a.wbt").get("error"),
                         'Wrong Webots simulation URL: "git~1" is no name of a branch, folder or file')


if __name__ == "__main__":
    main()

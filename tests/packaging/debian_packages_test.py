#!/usr/bin/python3
"""The Debian packages: what is in them, what they ask for, and that their programs run from where they put them. That they install,
are upgraded and go away again is tested by tests/systemd_boot.sh.

Usage: debian_packages_test.py BUILD_FOLDER [unittest arguments]
"""

import glob
import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
import unittest

BUILD = ""
SOURCE = os.path.abspath(os.path.join(os.path.dirname(__file__), "../.."))
SERVERS = {"webots-cloud-session-server": "session", "webots-cloud-simulation-server": "simulation"}
SHARED = "libwebots-cloud1"
DOC = "webots-cloud-doc"
PACKAGES = {*SERVERS, "webots-cloud-demo", DOC, "libwebots-cloud-dev", SHARED}
EXAMPLES = "usr/share/doc/libwebots-cloud-dev/examples"


def run(*command, **more):
    done = subprocess.run(command, stdin=subprocess.DEVNULL, text=True, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, **more)
    if done.returncode != 0:
        raise AssertionError(f"{' '.join(command)}: exit status {done.returncode}\n{done.stdout}")
    return done.stdout


def files_below(folder):
    return {os.path.relpath(os.path.join(parent, name), folder) for parent, _, names in os.walk(folder) for name in names}


class DebianPackages(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory(prefix="webots_cloud_debian_")
        cls.addClassCleanup(folder.cleanup)
        cls.folder = folder.name
        run("cpack", "--config", os.path.join(BUILD, "CPackConfig.cmake"), "-B", cls.folder, cwd=cls.folder)
        cls.files = {os.path.basename(path).partition("_")[0]: path for path in glob.glob(os.path.join(cls.folder, "*.deb"))}
        cls.contents = {}
        for name, path in cls.files.items():
            tree = os.path.join(cls.folder, name)
            run("dpkg-deb", "--raw-extract", path, tree)
            cls.contents[name] = {each for each in files_below(tree) if not each.startswith("DEBIAN/")}
        cls.root = os.path.join(cls.folder, "root")  # all of them, as on a machine
        for path in cls.files.values():
            run("dpkg-deb", "--extract", path, cls.root)

    def path(self, package, name):
        return os.path.join(self.folder, package, name)

    def read(self, package, name):
        with open(self.path(package, name)) as file:
            return file.read()

    def field(self, package, name):
        return run("dpkg-deb", "--field", self.files[package], name).strip()

    def names_in(self, package, field):
        return set(re.findall(r"(?:^|[,|]) *([a-z0-9.+-]+)", self.field(package, field)))

    def test_there_are_six_of_one_version(self):
        self.assertEqual(set(self.files), PACKAGES)
        version = run(os.path.join(self.root, "usr/bin/webots-session-server"), "--version").split()[1]
        self.assertEqual({self.field(package, "Version") for package in PACKAGES}, {f"{version}-1"})

    def test_who_made_them_answers_for_them(self):
        with open(os.path.join(BUILD, "CMakeCache.txt")) as file:
            named = re.search(r"^WEBOTS_CLOUD_MAINTAINER:STRING=(.+ <.+@.+>)$", file.read(), re.MULTILINE)[1]
        self.assertEqual({self.field(package, "Maintainer") for package in PACKAGES}, {named})
        self.assertIn(f" -- {named}  ", run("zcat", self.path(SHARED, f"usr/share/doc/{SHARED}/changelog.Debian.gz")))

    def test_each_says_where_people_read_on(self):
        with open(os.path.join(BUILD, "CMakeCache.txt")) as file:
            named = re.search(r"^WEBOTS_CLOUD_HOMEPAGE:STRING=(https://.+)$", file.read(), re.MULTILINE)[1]
        self.assertEqual({self.field(package, "Homepage") for package in PACKAGES}, {named})

    def test_the_documentation_is_whole_and_its_pages_find_each_other(self):
        top = f"usr/share/doc/{DOC}"
        pages = {os.path.relpath(name, top) for name in self.contents[DOC]}
        for folder in (".", "docs", "docs/decisions"):
            found = glob.glob(os.path.join(SOURCE, folder, "*.md"))
            self.assertLessEqual({os.path.relpath(path, SOURCE) for path in found} - {"CHANGELOG.md"}, pages)  # that is changelog.gz
        self.assertEqual([name for name in pages if name.startswith("docs/site/")], [])
        for page in (name for name in pages if name.endswith(".md")):
            for target in re.findall(r"\]\((?!\w+:)([^)#\s]+)", self.read(DOC, f"{top}/{page}")):
                name = os.path.normpath(os.path.join(os.path.dirname(page), target))
                if name.startswith("docs/") and not name.startswith("docs/site/") and not os.path.isdir(os.path.join(SOURCE, name)):
                    self.assertIn(name, pages, f"{page} leads to it")
        self.assertEqual(self.field(DOC, "Architecture"), "all")
        for package in SERVERS:
            self.assertIn(DOC, self.names_in(package, "Recommends"))

    def test_configurations_have_manual_pages(self):
        for package, kind in SERVERS.items():
            self.assertIn(f"usr/share/man/man5/webots-{kind}-server.json.5.gz", self.contents[package])

    def test_the_examples_are_built_with_the_package(self):
        sources = {os.path.basename(path) for path in glob.glob(os.path.join(SOURCE, "examples", "*.cpp"))}
        packaged = {os.path.basename(name) for name in self.contents["libwebots-cloud-dev"] if name.startswith(f"{EXAMPLES}/")}
        self.assertEqual(packaged, {*sources, "CMakeLists.txt"})
        self.assertEqual(len(sources), 8)
        built = os.path.join(self.folder, "built examples")
        said = run("cmake", "-S", os.path.join(self.root, EXAMPLES), "-B", built, f"-DCMAKE_PREFIX_PATH={self.root}/usr")
        for example in sources:  # the others need as long each
            self.assertIn(example.removesuffix(".cpp"), run("cmake", "--build", built, "--target", "help"), said)
        run("cmake", "--build", built, "--target", "01_schedule")
        self.assertIn("browser 5: sim2.example.org:2000", run(os.path.join(built, "01_schedule")))

    def test_the_shared_library_needs_no_maintainer_scripts(self):
        self.assertEqual(sorted(os.listdir(self.path(SHARED, "DEBIAN"))), ["control", "md5sums", "shlibs", "triggers"])
        self.assertEqual(self.read(SHARED, "DEBIAN/triggers"), "activate-noawait ldconfig\n")

    def test_hardening_is_that_of_dpkg_buildflags(self):
        asked = {**os.environ, "DEB_BUILD_MAINT_OPTIONS": "hardening=+bindnow"}
        flags = {name: run("dpkg-buildflags", "--get", name, env=asked).split() for name in ("CPPFLAGS", "CXXFLAGS", "LDFLAGS")}
        compiled = [flag for flag in flags["CPPFLAGS"] + flags["CXXFLAGS"] if re.match(r"-fstack|-fcf|-Wformat|-Werror=format|-D_FORTIFY", flag)]
        linked = {flag.removeprefix("-Wl,") for flag in flags["LDFLAGS"]}
        self.assertGreaterEqual(len(compiled), 4, flags)  # Debian 13 has one more
        with open(os.path.join(SOURCE, "cmake", "hardening.cmake")) as file:
            ours = file.read()
        self.assertLessEqual(set(compiled), set(" ".join(re.findall(r"add_compile_options\((.*)\)", ours)).split()))
        self.assertEqual(linked, set(re.search(r"add_link_options\((.*)\)", ours)[1].replace("LINKER:", "").split()))

    def test_a_hardened_build_gives_hardened_programs(self):
        with open(os.path.join(BUILD, "CMakeCache.txt")) as file:
            if "\nWEBOTS_CLOUD_HARDENING:BOOL=ON\n" not in file.read():
                self.skipTest("this build has no WEBOTS_CLOUD_HARDENING, which ./server.sh package turns on")
        for kind in SERVERS.values():
            program = os.path.join(self.root, "usr/bin", f"webots-{kind}-server")
            self.assertRegex(run("readelf", "--file-header", program), r"Type: +DYN")
            self.assertIn("GNU_RELRO", run("readelf", "--wide", "--segments", program))
            self.assertRegex(run("readelf", "--wide", "--dynamic", program), r"\(FLAGS\) +.*BIND_NOW")
            symbols = run("readelf", "--wide", "--dyn-syms", program)
            self.assertRegex(symbols, r"__stack_chk_fail")
            self.assertRegex(symbols, r"__\w+_chk@")

    def test_all_that_is_installed_from_source_is_in_one_package(self):
        prefix = os.path.join(self.folder, "prefix")
        run("cmake", "--install", BUILD, "--prefix", prefix)
        elsewhere = ("share/webots_cloud/config/systemd/", "share/webots_cloud/config/website_host/", "share/doc/")
        wanted = {f"usr/{name}" for name in files_below(prefix) if not name.startswith(elsewhere)}
        wanted = {f"{name}.gz" if name.startswith("usr/share/man/") else name for name in wanted}
        packaged = sorted(name for contents in self.contents.values() for name in contents)
        self.assertEqual(wanted - set(packaged), set())
        self.assertEqual(sorted(set(packaged)), packaged, "no file is in two packages")

    def test_nothing_but_the_packages_comes_with_what_only_they_have(self):
        prefix = os.path.join(self.folder, "prefix of the source")
        run("cmake", "--install", BUILD, "--prefix", prefix)
        self.assertEqual([name for name in files_below(prefix) if "sysusers.d" in name or "lib/systemd" in name or "copyright" in name], [])

    def test_configurations_are_the_operators(self):
        for package, kind in SERVERS.items():
            self.assertEqual(self.read(package, "DEBIAN/conffiles"), f"/etc/webots-cloud/{kind}.json\n")
            self.assertEqual({name for name in self.contents[package] if name.startswith("etc/")}, {f"etc/webots-cloud/{kind}.json"})

    def test_a_new_site_is_for_this_machine_alone_and_announces_itself_to_nobody(self):
        configured = {kind: json.loads(self.read(package, f"etc/webots-cloud/{kind}.json")) for package, kind in SERVERS.items()}
        for config in configured.values():
            self.assertEqual(config["listenAddress"], "127.0.0.1")
        self.assertEqual(configured["simulation"]["notify"], [])
        self.assertEqual(configured["session"]["simulationServers"], [f"localhost:{configured['simulation']['port']}"])

    def test_each_server_asks_for_the_libraries_that_it_loads_and_no_others(self):
        session, simulation = (self.names_in(package, "Depends") for package in SERVERS)
        self.assertLessEqual({"libc6", "libssl3"}, {name.removesuffix("t64") for name in session})  # so called since Debian 13
        self.assertEqual({name for name in session if name.startswith(("libgit2", "libcairo"))}, set())
        self.assertTrue({name for name in simulation if name.startswith("libgit2")})
        self.assertLessEqual({"bubblewrap", "slirp4netns", "iproute2", "xvfb", "webots-cloud-demo"},
                             self.names_in("webots-cloud-simulation-server", "Recommends"))

    def test_who_develops_gets_what_the_library_links_to(self):
        asked = self.names_in("libwebots-cloud-dev", "Depends")
        with open(os.path.join(BUILD, "webots_cloudConfig.cmake")) as file:
            found = set(re.findall(r"find_dependency\((\w+)", file.read()))
        packages = {"Threads": "", "Boost": r"libboost1\.\d+-dev", "OpenSSL": "libssl-dev", "CURL": "libcurl4-openssl-dev", "ZLIB": "zlib1g-dev",
                    "LibArchive": "libarchive-dev", "spdlog": "libspdlog-dev", "PkgConfig": "pkgconf"}
        self.assertEqual(found, set(packages))
        for wanted in [*packages.values(), r"libboost-json1\.\d+-dev", r"libboost-url1\.\d+-dev", "libgit2-dev", "libc-ares-dev"]:
            self.assertTrue(not wanted or [name for name in asked if re.fullmatch(wanted, name)], wanted)

    def test_programs_linked_to_the_shared_library_ask_for_its_package(self):
        self.assertTrue(self.read(SHARED, "DEBIAN/shlibs").startswith(f"libwebots_cloud 1 {SHARED} (>= "))
        self.assertEqual({name for name in self.contents[SHARED] if ".so" in name}, {"usr/lib/libwebots_cloud.so.1", "usr/lib/libwebots_cloud.so.1.0.0"})
        self.assertIn(f"{SHARED} (= {self.field(SHARED, 'Version')})", self.field("libwebots-cloud-dev", "Depends"))

    def test_units_start_what_is_packaged_as_users_that_are_made(self):
        for package, kind in SERVERS.items():
            unit = self.read(package, f"usr/lib/systemd/system/webots-{kind}-server.service")
            program, config = re.search(r"^ExecStart=/(\S+) /(\S+)$", unit, re.MULTILINE).groups()
            self.assertLessEqual({program, config}, self.contents[package])
            made = re.findall(r"^[ug] (\S+)", self.read(package, f"usr/lib/sysusers.d/webots-{kind}-server.conf"), re.MULTILINE)
            self.assertEqual(re.findall(r"^(?:User|SupplementaryGroups)=(\S+)", unit, re.MULTILINE), made)
            self.assertIn(f"unit=webots-{kind}-server.service\n", self.read(package, "DEBIAN/postinst"))

    def test_servers_find_the_configuration_of_the_package(self):
        for kind in SERVERS.values():
            program = os.path.join(self.root, "usr/bin", f"webots-{kind}-server")
            expected = os.path.join(self.root, "etc/webots-cloud", f"{kind}.json")
            self.assertIn(f"{expected}: good\n", run(program, "--check-config", cwd="/"))
            before = os.path.join(self.root, "etc/webots_cloud", kind, "config.json")
            os.makedirs(os.path.dirname(before))
            os.rename(expected, before)
            self.assertIn(f"{before}: good\n", run(program, "--check-config", cwd="/"), "that of releases before 1.0")
            os.remove(before)
            self.assertIn(f"usr/share/webots_cloud/config/{kind}/local.json: good\n", run(program, "--check-config", cwd="/"))
            shutil.copy(self.path(f"webots-cloud-{kind}-server", f"etc/webots-cloud/{kind}.json"), expected)

    def with_short_libraries(self, package):
        """The same package with one object in each static library: lintian takes a minute for all of them. HACKING.md says when it last looked."""
        tree = os.path.join(self.folder, "short")
        run("dpkg-deb", "--raw-extract", self.files[package], tree)
        for library in glob.glob(f"{tree}/usr/lib/*.a"):
            run("ar", "d", library, *run("ar", "t", library).split()[1:])
        names = sorted(name for name in files_below(tree) if not name.startswith("DEBIAN/") and not os.path.islink(os.path.join(tree, name)))
        with open(os.path.join(tree, "DEBIAN/md5sums"), "w") as file:
            file.write(run("md5sum", *names, cwd=tree))
        shortened = os.path.join(self.folder, "short.deb")
        run("dpkg-deb", "--build", "--root-owner-group", tree, shortened)
        return shortened

    def test_lintian_finds_no_errors_and_warns_of_nothing(self):
        if not shutil.which("lintian"):
            self.skipTest("lintian is not installed")
        more = ["--allow-root"] if os.geteuid() == 0 else []
        packages = [self.with_short_libraries(name) if name == "libwebots-cloud-dev" else path for name, path in self.files.items()]
        said = subprocess.run(["lintian", "--fail-on", "error", "--fail-on", "warning", *more, *packages], text=True, capture_output=True)
        self.assertEqual(said.returncode, 0, said.stdout + said.stderr)


def main():
    global BUILD
    BUILD = os.path.abspath(sys.argv[1])
    missing = [name for name in ("cpack", "dpkg-deb", "dpkg-shlibdeps", "file") if not shutil.which(name)]
    if missing:
        print(f"skipped: {', '.join(missing)} not installed")
        return 77
    return 0 if unittest.main(argv=sys.argv[:1] + sys.argv[2:], verbosity=2, exit=False).result.wasSuccessful() else 1


if __name__ == "__main__":
    sys.exit(main())

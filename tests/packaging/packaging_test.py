#!/usr/bin/python3
"""Uses the library as other projects do: from an installed prefix by find_package, and from its sources by add_subdirectory.

Usage: packaging_test.py BUILD_FOLDER CXX_COMPILER CXX_FLAGS [unittest arguments]
"""

import os
import re
import shutil
import subprocess
import sys
import tempfile
import unittest

HERE = os.path.dirname(os.path.abspath(__file__))
SOURCE = os.path.dirname(os.path.dirname(HERE))
ADAPTER_LIBRARIES = ("libgit2", "libcurl", "libssl", "libspdlog")
ADAPTER_PACKAGES = ("CURL", "OpenSSL", "PkgConfig", "ZLIB", "spdlog")


def run(*command):
    """Runs a command in an environment without hints to other prefixes; its whole output is the message when it fails."""
    environment = {name: value for name, value in os.environ.items() if not name.startswith(("CMAKE_", "webots_cloud_"))}
    done = subprocess.run(command, env=environment, stdin=subprocess.DEVNULL, text=True,
                          stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
    if done.returncode != 0:
        raise AssertionError(f"{' '.join(command)}: exit status {done.returncode}\n{done.stdout}")
    return done.stdout


def files_below(folder):
    return {os.path.relpath(os.path.join(parent, name), folder) for parent, _, names in os.walk(folder) for name in names}


def without_version(name):
    """libx.so of libx.so.1.2"""
    return re.sub(r"(?<=\.so)[.\d]+$", "", name)


class PackagingTest(unittest.TestCase):
    build, compiler, flags = "", "", ""

    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory(prefix="webots_cloud_packaging_")
        cls.addClassCleanup(folder.cleanup)
        cls.folder = folder.name

    def build_consumer(self, name, *arguments, build=None):
        """Configures and builds an outside project; returns its program."""
        build = os.path.join(self.folder, build or name)
        run("cmake", "-S", os.path.join(HERE, name), "-B", build, "-G", "Ninja", "-DCMAKE_BUILD_TYPE=Release",
            f"-DCMAKE_CXX_COMPILER={self.compiler}", f"-DCMAKE_CXX_FLAGS={self.flags}", *arguments)
        run("cmake", "--build", build, "--parallel", "2")
        return os.path.join(build, "consumer")

    def linked_adapter_libraries(self, program):
        linked = run("ldd", program)
        return [library for library in ADAPTER_LIBRARIES if library + "." in linked]


class Install(PackagingTest):
    """Targets that people are told to build make all that is started or installed; an incomplete build installs nothing."""

    def made_for(self, target):
        """The names of the files that a target builds."""
        if not os.path.exists(os.path.join(self.build, "build.ninja")):
            self.skipTest("the build is not one of Ninja, which says what a target needs")
        commands = run("ninja", "-C", self.build, "-t", "commands", target)
        return {without_version(os.path.basename(path)) for path in re.findall(r"(?: -o | qc | > )(\S+)", commands)}

    def test_a_start_builds_every_program_that_runs_then(self):
        script = os.path.join(SOURCE, "server.sh")
        with open(script) as file:
            self.assertRegex(file.read(), r"\n    build site\n")
        made = self.made_for("site")
        targets = run("ninja", "-C", self.build, "-t", "targets", "all")
        programs = re.findall(r"^bin/(webots-\S+):", targets, re.MULTILINE)
        # The script and what it hands over to start some, the servers others: a program of ours that none of them names is started by nobody.
        code = run("cat", script, *(os.path.join(SOURCE, file) for file in files_below(SOURCE) if re.match(r"src/(app|core|site)/.*pp$", file)))
        started = {name for name in programs if name in code}
        self.assertLessEqual({"webots-session-server", "webots-website-host", "webots-process-guard", "webots-site"}, started)
        self.assertEqual(started - made, set())

    def test_what_is_installed_is_what_its_target_builds(self):
        made = self.made_for("installable")
        prefix = os.path.join(self.folder, "prefix")
        run("cmake", "--install", self.build, "--prefix", prefix)
        built = {name for name in map(os.path.basename, files_below(prefix)) if name.startswith(("webots-", "libwebots"))}
        built = {without_version(name) for name in built if not name.endswith((".service", ".conf"))}  # of config/systemd
        self.assertIn("libwebots_cloud_testing.a", built)
        self.assertEqual(built - made, set())

    def test_of_an_unfinished_build_nothing_is_installed(self):
        build, prefix = os.path.join(self.folder, "unfinished"), os.path.join(self.folder, "nothing")
        run("cmake", "-S", SOURCE, "-B", build, "-G", "Ninja", f"-DCMAKE_CXX_COMPILER={self.compiler}",
            f"-DCMAKE_CXX_FLAGS={self.flags}", "-DWEBOTS_CLOUD_BUILD_ADAPTERS=OFF", "-DWEBOTS_CLOUD_BUILD_EXAMPLES=OFF",
            "-DWEBOTS_CLOUD_BUILD_TESTS=OFF")
        with self.assertRaisesRegex(AssertionError, f"Nothing is installed(.|\n)*cmake --build\\s+{build}\\s+--target\\s+installable"):
            run("cmake", "--install", build, "--prefix", prefix)
        self.assertFalse(os.path.exists(prefix))


class FindPackage(PackagingTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.prefix = os.path.join(cls.folder, "prefix")
        run("cmake", "--install", cls.build, "--prefix", cls.prefix)

    def test_every_public_header_is_installed(self):
        self.assertEqual(files_below(os.path.join(self.prefix, "include")), files_below(os.path.join(SOURCE, "include")))

    def test_manual_pages_and_completions_are_where_they_are_looked_for(self):
        for name in ("webots-session-server", "webots-simulation-server", "webots-process-guard"):
            for file in (f"man/man8/{name}.8", f"bash-completion/completions/{name}", f"zsh/vendor-completions/_{name}",
                         f"fish/vendor_completions.d/{name}.fish"):
                with open(os.path.join(self.prefix, "share", file)) as text:
                    self.assertIn(name, text.read().replace("\\-", "-").lower(), file)
        self.assertTrue(os.path.exists(os.path.join(self.prefix, "share/man/man1/webots-demo-simulator.1")))

    def test_core_alone_needs_no_library_of_the_adapters(self):
        absent = [f"-DCMAKE_DISABLE_FIND_PACKAGE_{package}=ON" for package in ADAPTER_PACKAGES]
        program = self.build_consumer("core_consumer", f"-DCMAKE_PREFIX_PATH={self.prefix}", *absent)
        self.assertEqual(run(program), "placed on idle:2000\n")
        self.assertEqual(self.linked_adapter_libraries(program), [])

    def test_the_whole_library_comes_with_all_that_it_links_to(self):
        program = self.build_consumer("full_consumer", f"-DCMAKE_PREFIX_PATH={self.prefix}")
        self.assertEqual(run(program), "answered hello\n")
        self.assertIn("libcurl", self.linked_adapter_libraries(program))

    def test_the_shared_library_is_the_same_library(self):
        program = self.build_consumer("full_consumer", f"-DCMAKE_PREFIX_PATH={self.prefix}", "-DCOMPONENT=shared", build="shared_consumer")
        self.assertEqual(run(program), "answered hello\n")
        needed = re.findall(r"NEEDED\s+(\S+)", run("objdump", "--private-headers", program))
        self.assertIn("libwebots_cloud.so.1", needed)
        self.assertFalse([library for library in ADAPTER_LIBRARIES if any(name.startswith(library + ".") for name in needed)])

    # What templates of other libraries leave behind is weak; of ours there is what public headers declare.
    def test_the_shared_library_exports_its_interface_alone(self):
        symbols = run("nm", "--dynamic", "--defined-only", "--demangle", os.path.join(self.prefix, "lib", "libwebots_cloud.so"))
        strong = {line.split(" ", 2)[2] for line in symbols.splitlines() if line.split(" ", 2)[1] in "TDBR"}
        self.assertIn("webots_cloud::version()", strong)
        self.assertTrue(any(name.startswith("webots_cloud::Scheduler::place(") for name in strong))
        declared = re.compile(r"(?:(?:typeinfo|typeinfo name|vtable|VTT|construction vtable) for |non-virtual thunk to )?webots_cloud::(?!(?:core|async|adapters|app|web)::)")
        self.assertEqual([name for name in strong if not declared.match(name)], [])

    def link_by_pkg_config(self, package, compiler=None):
        environment = {**os.environ, "PKG_CONFIG_PATH": os.path.join(self.prefix, "lib", "pkgconfig")}
        flags = subprocess.run(["pkg-config", "--cflags", "--libs", package], env=environment, text=True, check=True,
                               stdout=subprocess.PIPE).stdout.split()
        program = os.path.join(self.folder, package)
        run(compiler or self.compiler, "-std=c++20", os.path.join(HERE, "full_consumer", "main.cpp"), "-o", program, *flags,
            f"-Wl,-rpath,{self.prefix}/lib")
        return program

    def test_pkg_config_links_the_shared_library(self):
        program = self.link_by_pkg_config("webots_cloud")
        self.assertEqual(run(program), "answered hello\n")
        self.assertIn("libwebots_cloud.so", run("ldd", program))

    # All combinations, in a bare Debian: tests/dev_package.sh.
    def test_clang_uses_what_another_compiler_has_built(self):
        if not shutil.which("clang++"):
            self.skipTest("clang++ is not installed")
        self.assertEqual(run(self.link_by_pkg_config("webots_cloud", "clang++")), "answered hello\n")

    def test_pkg_config_links_the_static_libraries(self):
        program = self.link_by_pkg_config("webots_cloud_static")
        self.assertEqual(run(program), "answered hello\n")
        self.assertNotIn("libwebots_cloud", run("ldd", program))

    def test_a_module_of_python_schedules(self):
        self.build_consumer("python_module", f"-DCMAKE_PREFIX_PATH={self.prefix}", "-DPYTHON_EXECUTABLE=/usr/bin/python3")
        code = ("import webots_scheduler\nscheduler = webots_scheduler.Scheduler()\nscheduler.set_servers(['busy:2000', 'idle:2000'])\n"
                "scheduler.report('busy:2000', 40)\nscheduler.report('idle:2000', 10)\nprint(scheduler.place())")
        done = subprocess.run(["/usr/bin/python3", "-c", code], cwd=os.path.join(self.folder, "python_module"), text=True, capture_output=True)
        self.assertEqual((done.stdout, done.stderr), ("idle:2000\n", ""))

    def test_an_unknown_component_is_refused_with_its_name(self):
        with self.assertRaisesRegex(AssertionError, "gateway"):
            run("cmake", f"-DCMAKE_PREFIX_PATH={self.prefix}", "-S", os.path.join(HERE, "unknown_component"),
                "-B", os.path.join(self.folder, "unknown"), "-G", "Ninja")

    # Protocol section 8: the default file, also where the working folder has none.
    def test_the_installed_servers_find_their_configuration(self):
        for kind in ("session", "simulation"):
            program = os.path.join(self.prefix, "bin", f"webots-{kind}-server")
            done = subprocess.run([program, "--check-config"], cwd="/", text=True, capture_output=True)
            expected = os.path.join(self.prefix, "share", "webots_cloud", "config", kind, "local.json")
            # That file is for ./server.sh, in whose folder there are the projects, and the password and the token that it makes. Which names
            # are found and which ports are free depends on this machine.
            token = 'key "operatorTokenFile": there is no file /log/.operator-token'
            missing = {"session": ['key "teacherPasswordFile": there is no file /log/.teacher-password', token],
                       "simulation": ['key "projectsDir": there is no folder /examples/demo_projects', token, 'key "keyDir": the folder /website/key']}[kind]
            warnings = [line for line in done.stderr.splitlines() if " can't be resolved: " not in line and ": port" not in line]
            self.assertEqual((done.returncode, done.stdout.splitlines()[0], len(warnings)), (0, f"{expected}: good", len(missing)), done.stderr)
            for found, folder in zip(warnings, missing):
                self.assertRegex(found, rf"{re.escape(expected)}(:\d+:\d+)?: {re.escape(folder)}")

    # Decision 002: a linker that leaves the library out says nothing.
    def test_the_simulation_server_allocates_without_locks(self):
        with open(os.path.join(self.build, "CMakeCache.txt")) as cache:
            if "WEBOTS_CLOUD_MIMALLOC:BOOL=ON\n" not in cache.read():
                self.skipTest("WEBOTS_CLOUD_MIMALLOC is off: built without, or with sanitizers, which bring their own malloc")
        program = os.path.join(self.prefix, "bin", "webots-simulation-server")
        done = subprocess.run([program, "--version"], env={**os.environ, "MIMALLOC_VERBOSE": "1"}, text=True, capture_output=True)
        self.assertIn("mimalloc: process init", done.stderr)

    def test_what_the_simulation_server_starts_is_installed_beside_it(self):
        for program in ("webots-process-guard", "webots-demo-simulator"):
            self.assertTrue(os.access(os.path.join(self.prefix, "bin", program), os.X_OK), program)
        data = os.path.join(self.prefix, "share", "webots_cloud")
        for installed, source in (("examples/demo_projects", "examples/demo_projects"), ("demo_simulator", "examples/demo_simulator/home")):
            self.assertEqual(files_below(os.path.join(data, installed)), files_below(os.path.join(SOURCE, source)))


class AddSubdirectory(PackagingTest):
    def test_core_alone_needs_no_library_of_the_adapters(self):
        absent = [f"-DCMAKE_DISABLE_FIND_PACKAGE_{package}=ON" for package in ADAPTER_PACKAGES]
        program = self.build_consumer("subdirectory_consumer", f"-DWEBOTS_CLOUD_SOURCE_DIR={SOURCE}",
                                      "-DWEBOTS_CLOUD_UNITY_BUILD=ON", "-DCMAKE_CXX_FLAGS_RELEASE=-O0", *absent)  # for the time that it takes
        self.assertEqual(run(program), "placed on idle:2000\n")
        self.assertEqual(self.linked_adapter_libraries(program), [])


if __name__ == "__main__":
    PackagingTest.build, PackagingTest.compiler, PackagingTest.flags = sys.argv[1:4]
    unittest.main(argv=sys.argv[:1] + sys.argv[4:], verbosity=2)

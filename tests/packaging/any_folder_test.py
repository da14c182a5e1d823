#!/usr/bin/env python3
"""any_folder_test.py SOURCE CXX: the checkout lies in a folder that people have named.

The build's own commands work there whatever bytes its name has, but for those that CMake itself does not take. What they make
is compiled, too; what the compiler alone does is not repeated."""
import os
import re
import shutil
import subprocess
import sys
import tempfile
import unittest

SOURCE, CXX = sys.argv.pop(1), sys.argv.pop(1)
# CMake 3.25 fails with these in its own modules; server.sh says so.
REFUSED = '"#*;<>?[\\]|'
NAME = "webots_cloud (1), it's a&b täst 日本 " + "".join(chr(code) for code in range(0x21, 0x7f) if not chr(code).isalnum() and chr(code) not in REFUSED + "/")


class AnyFolder(unittest.TestCase):
    def setUp(self):
        self.folder = os.path.join(tempfile.mkdtemp(prefix="webots_cloud_folder_"), NAME)
        self.addCleanup(shutil.rmtree, os.path.dirname(self.folder))
        ignored = shutil.ignore_patterns("build", ".git", "node_modules", "__pycache__")
        shutil.copytree(SOURCE, self.folder, ignore=ignored, symlinks=True)

    def run_there(self, *command):
        done = subprocess.run(command, cwd=self.folder, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        self.assertEqual(done.returncode, 0, done.stdout[-3000:])

    def test_the_pages_are_embedded(self):
        self.run_there("cmake", "--preset", "release", f"-DCMAKE_CXX_COMPILER={CXX}", "-DCMAKE_DISABLE_PRECOMPILE_HEADERS=ON",
                       "-DWEBOTS_CLOUD_BUILD_TESTS=OFF")
        made = "src/CMakeFiles/webots_cloud_core.dir/web_assets.cpp.o"
        self.run_there("cmake", "--build", "--preset", "release", "--target", made)
        with open(os.path.join(self.folder, "build/release", made), "rb") as file, \
                open(os.path.join(self.folder, "src/web/viewer/index.html"), "rb") as page:
            self.assertIn(page.read(), re.sub(rb"\?v=[0-9a-f]{16}", b"", file.read()))  # what names scripts by their contents

    def test_the_script_names_what_cmake_does_not_take(self):
        for refused in REFUSED:
            folder = os.path.join(os.path.dirname(self.folder), f"a{refused}b")
            for part in ("config", "cmake/packages"):
                shutil.copytree(os.path.join(SOURCE, part), os.path.join(folder, part))
            shutil.copy(os.path.join(SOURCE, "server.sh"), folder)
            done = subprocess.run(["./server.sh", "start"], cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
            self.assertEqual((done.returncode, done.stdout.splitlines()),
                             (1, [f"Nothing can be built in a folder with {refused} in its path: CMake does not take that. Rename or move {folder}."]))


if __name__ == "__main__":
    unittest.main()

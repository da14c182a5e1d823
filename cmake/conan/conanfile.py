"""webots_cloud as a Conan 2 package: conan create cmake/conan (from a checkout). It has never been run: Debian has no Conan."""

import os

from conan import ConanFile
from conan.tools.cmake import CMake, CMakeToolchain, cmake_layout
from conan.tools.files import copy, load


class WebotsCloud(ConanFile):
    name = "webots_cloud"
    license = "Apache-2.0"
    description = "Robot simulations on the web: session server, simulation server and library"
    settings = "os", "compiler", "build_type", "arch"
    options = {"adapters": [True, False], "shared": [True, False]}
    default_options = {"adapters": False, "shared": False}
    generators = "CMakeDeps"

    def set_version(self):
        project = load(self, os.path.join(self.recipe_folder, "..", "..", "CMakeLists.txt"))
        self.version = project.split("VERSION ", 2)[2].split()[0]

    def export_sources(self):
        root = os.path.join(self.recipe_folder, "..", "..")
        for pattern in ("CMakeLists.txt", "LICENSE", "cmake/*", "include/*", "src/*", "config/*"):
            copy(self, pattern, root, self.export_sources_folder)

    def requirements(self):
        self.requires("boost/[>=1.81 <2]", transitive_headers=True)
        if self.options.adapters:
            for package in ("c-ares/[>=1.18 <2]", "libarchive/[>=3.6 <4]", "libcurl/[>=7.88 <9]", "libgit2/[>=1.5 <2]", "openssl/[>=3 <4]", "spdlog/[>=1.10 <2]",
                            "zlib/[>=1.2 <2]"):
                self.requires(package)

    def layout(self):
        cmake_layout(self)

    def generate(self):
        toolchain = CMakeToolchain(self)
        toolchain.cache_variables.update({
            "WEBOTS_CLOUD_BUILD_ADAPTERS": bool(self.options.adapters), "BUILD_SHARED_LIBS": bool(self.options.shared),
            "WEBOTS_CLOUD_BUILD_APPS": False, "WEBOTS_CLOUD_BUILD_EXAMPLES": False, "WEBOTS_CLOUD_BUILD_TESTS": False})
        toolchain.generate()

    def build(self):
        cmake = CMake(self)
        cmake.configure()
        cmake.build(target="installable")

    def package(self):
        CMake(self).install()

    def package_info(self):
        # The package's own CMake files name the targets, as they do without Conan.
        self.cpp_info.set_property("cmake_find_mode", "none")
        self.cpp_info.builddirs = [os.path.join("lib", "cmake", "webots_cloud")]

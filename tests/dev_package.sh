#!/usr/bin/env bash
# Uses the package of the library as a developer does: installs it in a bare Debian with apt, and builds programs with it there by CMake and
# by pkg-config, with the shared and the static libraries, with g++ and clang; and a module of Python. Needs root, debootstrap, the release
# built (./server.sh package), the internet, 3 GB and some minutes.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
source tests/support/bare_debian.sh

usage="Usage: tests/dev_package.sh [--suite NAME --packages FOLDER] [--in FOLDER]
  --suite NAME       which Debian; that of this machine unless given
  --packages FOLDER  with packages for it, as tests/bare_tree.sh leaves them
  --in FOLDER        where to make it: a new folder, removed at the end; /var/tmp/dev_package.XXXXXX unless given"

folder=

main()
{
    local suite packages=
    suite=$(own_suite)
    while [[ $# -gt 0 ]]; do
        case $1 in
            --suite) suite=${2:?"$usage"} && shift 2 ;;
            --packages) packages=${2:?"$usage"} && shift 2 ;;
            --in) folder=${2:?"$usage"} && shift 2 ;;
            --inside)
                inside "$2"
                exit
                ;;
            *) fail "$usage" ;;
        esac
    done
    [[ $(id -u) -eq 0 ]] || fail "Making a bare Debian needs root."
    command -v debootstrap >/dev/null || fail "debootstrap is not installed."
    folder=${folder:-$(mktemp -d /var/tmp/dev_package.XXXXXX)}
    mkdir -p "$folder"
    chmod 755 "$folder"
    trap 'rm -rf --one-file-system "$folder" "$folder.log"' EXIT

    step "Packages"
    [[ -n $packages ]] || { ./server.sh package && packages=build/release/packages; }
    step "A bare Debian: $suite"
    make_bare_debian "$suite" "$folder"
    cp "$packages"/libwebots-cloud*.deb "$folder/srv/"
    cp --recursive tests/packaging examples/01_schedule.cpp "$folder/srv/"
    unshare --mount --pid --fork --kill-child "$PWD/tests/dev_package.sh" --inside "$folder"
}

# In namespaces, which end with this command.
inside()
{
    local compiler
    folder=$1
    mount -t proc proc "$folder/proc"
    mount --rbind /dev "$folder/dev"
    step "The package, and g++"
    in_tree apt-get update -q >"$folder/apt.log" 2>&1 || { tail -n 20 "$folder/apt.log" && exit 1; }
    install ./libwebots-cloud-dev_*.deb ./libwebots-cloud[0-9]*.deb build-essential cmake
    build_consumers g++
    step "clang"
    install clang
    build_consumers clang++
    step "Python"
    install pybind11-dev python3-dev
    for compiler in g++ clang++; do
        build python_module "$compiler" core
        expect "idle:2000" in_tree env "PYTHONPATH=/srv/built/python_module-$compiler-core" python3 -c "
import webots_scheduler
scheduler = webots_scheduler.Scheduler()
scheduler.set_servers(['busy:2000', 'idle:2000'])
scheduler.report('busy:2000', 40)
scheduler.report('idle:2000', 10)
print(scheduler.place())"
    done
    step "The packages go"
    in_tree bash -c 'apt-get purge -y -q "libwebots-cloud*"' >"$folder/apt.log" 2>&1 || { tail -n 20 "$folder/apt.log" && exit 1; }
    [[ -z $(find "$folder/usr" "$folder/etc" "$folder/var/lib" -name '*webots*cloud*' -not -path '*/dpkg/*' -print -quit) ]] || fail "Files are left."
    step "Programs are built with the package"
}

# install PACKAGE...: by apt, whose words for it are shown where it can't.
install()
{
    in_tree bash -c "apt-get install -y -q --no-install-recommends $*" >"$folder/apt.log" 2>&1 || { tail -n 20 "$folder/apt.log" && exit 1; }
}

# build_consumers COMPILER: and sees them run, linked as they are meant to be.
build_consumers()
{
    local component package program
    build core_consumer "$1" core
    expect "placed on idle:2000" in_tree "built/core_consumer-$1-core/consumer"
    for component in webots_cloud shared; do
        build full_consumer "$1" "$component"
        program=built/full_consumer-$1-$component/consumer
        expect "answered hello" in_tree "$program"
        expect_link "$program" "$component"
    done
    for package in webots_cloud webots_cloud_static; do
        program=built/$1-$package
        build_by_pkg_config packaging/full_consumer/main.cpp "$1" "$package" "$program"
        expect "answered hello" in_tree "$program"
        expect_link "$program" "$([[ $package == webots_cloud ]] && echo shared || echo webots_cloud)"
    done
    build_by_pkg_config 01_schedule.cpp "$1" webots_cloud_core "built/$1-core"
    in_tree "built/$1-core" | grep -q '^browser 5: sim2.example.org:2000$' || fail "The example of docs/library.md fails"
}

# build PROJECT COMPILER COMPONENT: by CMake, into a folder that is called like that.
build()
{
    in_tree bash -c "cmake -S packaging/$1 -B built/$1-$2-$3 -DCMAKE_CXX_COMPILER=$2 -DCOMPONENT=$3 && cmake --build built/$1-$2-$3" >"$folder/build.log" 2>&1 ||
        { cat "$folder/build.log" && fail "$* is not built"; }
    echo "$*: built by CMake"
}

# build_by_pkg_config FILE COMPILER PACKAGE PROGRAM
build_by_pkg_config()
{
    in_tree bash -c "$2 -std=c++20 $1 -o $4 \$(pkg-config --cflags --libs $3)"
    echo "$1 $2 $3: built by pkg-config"
}

# expect_link PROGRAM shared|webots_cloud: it loads our library, or contains it.
expect_link()
{
    local found=webots_cloud
    [[ $(in_tree ldd "$1") != *libwebots_cloud.so* ]] || found=shared
    [[ $found == "$2" ]] || fail "$1: linked in the wrong way"
}

# expect TEXT COMMAND...
expect()
{
    local found
    found=$("${@:2}") || fail "${*:2} fails"
    [[ $found == "$1" ]] || fail "${*:2}: expected $1, found: $found"
}

in_tree()
{
    chroot "$folder" env -i -C /srv HOME=/root LC_ALL=C DEBIAN_FRONTEND=noninteractive PATH=/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin \
        "${proxies[@]}" "$@" </dev/null
}

main "$@"

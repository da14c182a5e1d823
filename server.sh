#!/usr/bin/env bash
# Builds the servers of this folder, and has webots-site (src/site) start and stop them: session server, simulation server, and the example of
# a website that starts simulations. Or makes Debian packages of the two servers, and installs them as services of this machine.
[ -n "${BASH_VERSION-}" ] || exec bash "$0" "$@" # sh server.sh
set -euo pipefail
# A site becomes whole even where nobody reads what is said: the output is closed, or whoever has read it has gone.
{ true 3>&1; } 2>/dev/null || exec >/dev/null
true 3>&2 || exec 2>/dev/null # which nobody is told
trap '' PIPE
echo() { builtin echo "$@" 2>/dev/null || true; }
cd "$(dirname "$(readlink -f "${BASH_SOURCE[0]}")")" # of the script, where this is a link to it
source cmake/packages/install.sh

site=$PWD/build/release/bin/webots-site

forms="Usage: ./server.sh start|restart [NAME|--lan] [--port NUMBER]
       ./server.sh stop|status [NAME|--lan]
       ./server.sh package|install|help"

usage()
{
    cat <<END
$forms

  start    Install missing packages, build, start the servers, and print the
           address to open. Servers that run already are left as they are.
           Either all run in the end, or what was started is stopped again.
  stop     Stop them. Simulations that run are ended cleanly.
  restart  Stop whatever runs, and start, at the same ports unless told
           otherwise.
  status   Say which servers run, since when, at which address, where they
           log, how many seats are taken, and what visitors meet.
  package  Install missing packages, build, and make Debian packages of the
           servers in build/release/packages, for other machines.
  install  The same, and install them here: as services that start with the
           machine, configured in /etc/webots-cloud. A configuration that you
           have edited is kept.
  help     Show this text.

  NAME     The servers read NAME.json in config/session, config/simulation
           and config/website_host; those whose file exists run. NAME is
           "local" unless given: a site for this machine alone. Where a
           configuration names a certificate in this folder that is not there,
           as "tls" does, one is made for a try. Nobody has signed it, so
           browsers warn.
           stop and status with a NAME are about the servers that run with it.
  --lan    Short for "lan": a site for a class, which every machine of the
           network reaches. The address for the others is printed, with a QR
           code for phones, and where a teacher opens a class, with the
           password, which the first start makes.
  --port   Move the whole site: people open it at this port, and its other
           ports move by as much.

Exit statuses: 0: done, or running; 1: it failed; 2: wrong arguments;
3, of status: no such server runs.
The servers log to log/session, log/simulation and log/website_host.
END
}

main()
{
    local name='( --lan| [A-Za-z0-9_.][A-Za-z0-9_.-]*)?' port='( --port [0-9]+)?'
    [[ ! $* =~ ^(help|-h|--help)$ ]] || { usage && exit 0; }
    [[ $* =~ ^(start|restart)($name$port|$port$name)$ || $* =~ ^(stop|status)$name$ || $* =~ ^(package|install)$ ]] || misunderstood "$@"
    case $1 in
        start | restart) prepare "${@:2}" ;;
        stop | status) [[ -x $site ]] || tell_unbuilt "$1" ;;
        package)
            make_packages
            printf '%s\n' build/release/packages/*.deb
            ;;
        install) install_site ;;
    esac
    [[ $1 != package && $1 != install ]] || exit 0
    exec "$site" "$@"
}

misunderstood()
{
    [[ $# -eq 0 ]] || echo "Not understood: ./server.sh $*" >&2
    echo "$forms
./server.sh help says what each does." >&2
    exit 2
}

# Without our program, which any start builds, no server of this version has been started.
tell_unbuilt()
{
    [[ ! -e build/release/bin/webots-session-server ]] ||
        fail "build/release/bin/webots-site is not built yet: ./server.sh start does that, and leaves running servers as they are."
    echo "No server is running"
    [[ $1 == stop ]] && exit 0 || exit 3
}

# prepare ARGUMENT...: all that has to be there before a start with these.
prepare()
{
    local name=local
    while [[ $# -gt 0 ]]; do
        case $1 in
            --port) shift ;; # and its number, below
            --lan) name=lan ;;
            *) name=$1 ;;
        esac
        shift
    done
    [[ -e config/session/$name.json || -e config/simulation/$name.json ]] ||
        fail "Expected the name of a configuration, found \"$name\":" \
            "there is neither config/session/$name.json nor config/simulation/$name.json."
    [[ ! -x $site ]] || "$site" ready || exit 1 # before anybody waits for a build
    lock
    install_packages cmake/packages/build.txt
    install_page_libraries
    build site
    exec {lock}<&-
}

# One of us at a time builds. Holds until we end.
lock()
{
    local refused='["#*;<>?[\|]|]' # CMake's own modules fail with these
    [[ ! $PWD =~ $refused ]] ||
        fail "Nothing can be built in a folder with ${BASH_REMATCH[0]} in its path: CMake does not take that. Rename or move $PWD."
    mkdir -p build/release 2>/dev/null && [[ -w build/release ]] || fail "Nothing can be built in $PWD/build: may $(id -un) write there?"
    { : >build/release/.runs && chmod +x build/release/.runs; } 2>/dev/null && ! build/release/.runs 2>/dev/null &&
        fail "No program of $PWD can be run: its disk is mounted with noexec. Move it to another disk, or mount that with exec."
    rm -f build/release/.runs
    exec {lock}<build/release
    flock "$lock"
}

make_packages()
{
    lock
    install_packages cmake/packages/build.txt cmake/packages/package.txt
    install_page_libraries
    build installable WEBOTS_CLOUD_HARDENING=ON # what others install, or what a service runs, faces a network
    rm -rf build/release/packages # of an older version
    cpack --preset release >build/release/packages.log 2>&1 || {
        tail -n 10 build/release/packages.log >&2
        fail "The packages can't be made: see build/release/packages.log"
    }
}

# Packages, and services of them.
install_site()
{
    [[ $(id -u) -eq 0 ]] || command -v sudo >/dev/null || fail "Installing needs root, and there is no sudo: run ./server.sh install as root."
    [[ ! -x $site ]] || "$site" idle || exit 1
    make_packages
    as_root apt-get install -y -q --reinstall -o Dpkg::Options::=--force-confdef -o Dpkg::Options::=--force-confold \
        "$PWD"/build/release/packages/webots-cloud-*.deb || fail "apt-get install failed."
    cat <<'END'

Installed. Open http://localhost:1999/ unless you have configured another address.
  Configurations: /etc/webots-cloud/session.json and simulation.json. The site is for this machine alone until you change
  "listenAddress" there; docs/site.md has the steps for a class, and for a public site.
  Services:       systemctl status webots-session-server webots-simulation-server
  Logs:           /var/lib/webots-cloud/session/log and /var/lib/webots-cloud/simulation/log
  To remove all:  sudo apt purge webots-cloud-session-server webots-cloud-simulation-server webots-cloud-demo
END
    [[ -d /run/systemd/system ]] || echo "This machine runs no systemd now: the services start when it does."
}

# The libraries that show 3D scenes and QR codes. Where they can't be had, the first build is made without, and later starts do not wait
# for them again.
install_page_libraries()
{
    [[ ! -e build/release/build.ninja ]] || command -v npm >/dev/null || return 0
    install_node_packages src/web/view || echo "The viewer will show pictures only, and edit programs in a plain text field: npm could not install the libraries for more." >&2
    install_node_packages src/web/class || echo "Classes will have no QR code: npm could not install its library." >&2
}

# build TARGET [NAME=VALUE]: what of it is not built yet, with that variable of CMake, showing how far it is in one line. What the tools say is
# in build/release/build.log.
build()
{
    local log=build/release/build.log mask variable=${2-}
    mask=$(umask)
    umask 022 # the users of simulations run what is built
    rm -f "$log" # whatever somebody has put in its place
    : >"$log"
    # Configured anew also when a library of the pages has come since.
    [[ -e build/release/build.ninja && ! build/node/src/web/view -nt build/release/build.ninja &&
        ! build/node/src/web/class -nt build/release/build.ninja ]] && is_set "$variable" ||
        cmake --preset release ${variable:+"-D$variable"} >"$log" 2>&1 || build_failed "$log"
    NINJA_STATUS='[%f/%t] ' cmake --build --preset release --parallel "$(compilers)" --target "$1" 2>&1 | show_progress "$log" || build_failed "$log"
    umask "$mask"
}

# is_set [NAME=VALUE]: whether the build is configured like that.
is_set()
{
    [[ -z $1 ]] || grep -qx "${1%%=*}:[A-Z]*=${1#*=}" build/release/CMakeCache.txt 2>/dev/null
}

# How many compilers may run at once: each takes up to 1 GB of memory.
compilers()
{
    local room processors
    processors=$(nproc)
    room=$(sed -n 's/^MemAvailable: *\([0-9]*\).*/\1/p' /proc/meminfo)
    room=$((${room:-0} / 1000000))
    echo $((room < 1 ? 1 : room < processors ? room : processors))
}

# show_progress LOG: keeps what Ninja says in the log, and counts its steps: in one line of a terminal, in four lines of anything else.
show_progress()
{
    local line step steps quarter told=0
    while IFS= read -r line; do
        printf '%s\n' "$line" >>"$1"
        [[ $line =~ ^\[([0-9]+)/([0-9]+)\]\  && ${BASH_REMATCH[1]} -gt 0 ]] || continue
        step=${BASH_REMATCH[1]} steps=${BASH_REMATCH[2]}
        if [[ -t 1 ]]; then
            printf '\rBuilding: step %s of %s\033[K' "$step" "$steps"
            [[ $step -lt $steps ]] || printf '\n'
        else
            quarter=$((4 * step / steps))
            [[ $quarter -eq $told ]] || echo "Building: step $step of $steps"
            told=$quarter
        fi
    done
}

# build_failed LOG: ends with what the tools complain of, without their command lines.
build_failed()
{
    local lines=40
    [[ ! -t 1 ]] || echo
    if grep -q '^FAILED: ' "$1"; then
        sed -n '/^FAILED: /,$p' "$1" | sed -e '/^FAILED: /{n;d}' -e '/^\[[0-9]/d' | head -n "$lines" >&2
    else
        tail -n "$lines" "$1" >&2
    fi
    ! grep -q 'Killed signal terminated' "$1" || echo "A compiler was killed, for the machine has too little memory: close other programs, or add swap space." >&2
    fail "The build failed. All that it said is in $1."
}

main "$@"

#!/usr/bin/env bash
# Installs the servers on a machine of their own: makes a bare Debian, boots it with its systemd in namespaces, and there installs, upgrades
# and removes the Debian packages (tests/systemd_packages.py); then installs the release from source as docs/operations.md says, and
# looks at what the units do (tests/systemd_boot.py). Needs root, debootstrap, a kernel with unified control groups, the release built
# (cmake --build --preset release), 2 GB and some minutes. It makes one control group, and removes it at the end.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
source tests/support/bare_debian.sh

usage="Usage: tests/systemd_boot.sh [--build FOLDER] [--in FOLDER]
  --build FOLDER  what to install; build/release unless given
  --in FOLDER     where to make the Debian: a new folder, removed at the end; /var/tmp/systemd_boot.XXXXXX unless given"

folder=
group= # the control group of everything that is booted
booted= # the process that keeps the namespaces

main()
{
    local build=build/release
    while [[ $# -gt 0 ]]; do
        case $1 in
            --build) build=${2:?"$usage"} && shift 2 ;;
            --in) folder=${2:?"$usage"} && shift 2 ;;
            --boot)
                boot "$2" "$3"
                exit
                ;;
            --become-systemd)
                become_systemd "$2"
                exit
                ;;
            *) fail "$usage" ;;
        esac
    done
    [[ $(id -u) -eq 0 ]] || fail "Booting a Debian needs root."
    for program in debootstrap unshare nsenter cmake; do
        command -v "$program" >/dev/null || fail "$program is not installed."
    done
    for program in session-server simulation-server process-guard demo-simulator; do
        [[ -x $build/bin/webots-$program ]] || fail "$build/bin/webots-$program is not built: cmake --preset release && cmake --build --preset release"
    done
    local groups
    groups=$(findmnt --noheadings --first-only --types cgroup2 --output TARGET) || fail "No unified control groups (cgroup2) are mounted."
    folder=${folder:-$(mktemp -d /var/tmp/systemd_boot.XXXXXX)}
    mkdir -p "$folder"
    chmod 755 "$folder"
    trap clear_away EXIT

    step "The packages"
    make_packages "$build" "$folder.packages"

    step "A bare Debian with systemd, and what our packages ask for"
    local packages=systemd,dbus,python3-websockets,git,nginx-light,fcgiwrap
    packages+=$(prerequisites "$folder.packages"/1/webots-*.deb | sed 's/^/,/' | tr -d '\n')
    # shellcheck disable=SC1091 # of the machine
    debootstrap --variant=minbase --include="$packages" "$(. /etc/os-release && echo "$VERSION_CODENAME")" "$folder" "$(mirror)" \
        >"$folder.log" 2>&1 || { tail "$folder.log" && exit 1; }
    echo '127.0.0.1 localhost' >"$folder/etc/hosts"
    mkdir -p "$folder/srv/tests/support" "$folder/put_old"
    mv "$folder.packages" "$folder/srv/packages"
    cp tests/systemd_boot.py tests/systemd_packages.py "$folder/srv/tests/"
    cp tests/support/*.py "$folder/srv/tests/support/"
    ln -s /dev/null "$folder/etc/systemd/system/nginx.service" # the tests start one of their own

    step "systemd starts"
    group=$groups/webots_cloud_systemd_boot.$$
    mkdir "$group"
    unshare --pid --fork --kill-child "$PWD/tests/systemd_boot.sh" --boot "$folder" "$group" >"$folder.log" 2>&1 </dev/null &
    booted=$!
    until_booted

    step "The packages come, are upgraded, and go"
    ln -s /usr/share/webots_cloud/examples "$folder/srv/examples"
    in_tree python3 -B /srv/tests/systemd_packages.py
    rm "$folder/srv/examples"

    step "The servers are installed from source as docs/operations.md says"
    DESTDIR=$folder cmake --install "$build" --prefix /usr/local >/dev/null
    ln -s /usr/local/share/webots_cloud/examples "$folder/srv/examples"
    in_tree bash -euxc '
        systemd-sysusers /usr/local/share/webots_cloud/config/systemd/*.conf
        install -D -m 640 -g webots-session /usr/local/share/webots_cloud/config/session/production.json /etc/webots-cloud/session.json
        install -D -m 644 /usr/local/share/webots_cloud/config/simulation/production.json /etc/webots-cloud/simulation.json
        cp /usr/local/share/webots_cloud/config/systemd/webots-*.service /etc/systemd/system/
        systemctl daemon-reload
        systemctl enable --now webots-session-server webots-simulation-server' ||
        fail "They do not start: $(in_tree journalctl --no-pager --unit 'webots-*')"

    step "What they do under systemd"
    in_tree python3 -B /srv/tests/systemd_boot.py
    step "Packages and units are good"
}

# boot TREE GROUP: in a new PID namespace, as its first process. Enters the control group, so that the namespace of control groups which is
# made then has it as its root.
boot()
{
    echo 0 >"$2/cgroup.procs"
    exec unshare --mount --ipc --uts --net --cgroup --propagation private "$PWD/tests/systemd_boot.sh" --become-systemd "$1"
}

become_systemd()
{
    local tree=$1 device
    mount --bind "$tree" "$tree"
    cd "$tree" # of the mount
    mount -t proc proc proc
    mount --bind proc/sys proc/sys
    mount -o remount,bind,ro proc/sys # settings of the kernel are the machine's
    mount -t sysfs -o ro sysfs sys
    mount -t cgroup2 cgroup2 sys/fs/cgroup
    mount -t tmpfs -o mode=755 tmpfs run
    mount -t tmpfs -o mode=1777 tmpfs tmp
    mount -t tmpfs -o mode=755 tmpfs dev
    for device in null zero full random urandom tty; do
        touch "dev/$device"
        mount --bind "/dev/$device" "dev/$device"
    done
    mkdir dev/pts dev/net dev/proc
    mknod -m 666 dev/net/tun c 10 200
    # A kernel lets sandboxes mount a /proc of their own only where one is seen whole, as on a machine without ours around it.
    mount -t proc proc dev/proc
    mount -t devpts -o newinstance,ptmxmode=666 devpts dev/pts
    ln -s pts/ptmx dev/ptmx # PrivateDevices= copies it
    ln -s /proc/self/fd dev/fd
    pivot_root . put_old
    cd /
    umount -l /put_old
    exec setpriv --bounding-set=-sys_module,-sys_time,-sys_rawio,-syslog,-mac_admin,-mac_override,-sys_boot \
        env -i container=other PATH=/usr/sbin:/usr/bin:/sbin:/bin /lib/systemd/systemd systemd.unit=multi-user.target
}

# Waits for the first process of the namespaces to be a systemd that has finished.
until_booted()
{
    local state='no answer'
    for _ in {1..300}; do
        kill -0 "$booted" 2>/dev/null || fail "It ended at once: $(tail "$folder.log")"
        state=$(in_tree systemctl is-system-running --wait 2>&1) && return
        [[ $state != degraded ]] || break
        sleep 0.2
    done
    fail "systemd is not up: $state"$'\n'"$(in_tree systemctl --failed --no-pager 2>&1)"$'\n'"$(tail "$folder.log")"
}

in_tree()
{
    local first
    first=$(pgrep --parent "$booted") || return
    nsenter --target "$first" --mount --uts --ipc --net --pid --cgroup --root --wd \
        env -i HOME=/root PATH=/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin SYSTEMD_PAGER= "$@" </dev/null
}

clear_away()
{
    if [[ -n $booted ]]; then
        kill -KILL "$booted" 2>/dev/null || true # the first process of the namespace goes with it, and all others with that
        wait "$booted" 2>/dev/null || true
    fi
    if [[ -n $group ]]; then
        until ! grep -q 'populated 1' "$group/cgroup.events"; do sleep 0.1; done
        find "$group" -depth -type d -exec rmdir {} +
    fi
    rm -rf --one-file-system "$folder" "$folder.log" "$folder.packages"
}

# make_packages BUILD FOLDER: into FOLDER/1 the packages, into FOLDER/2 those of a later version whose configurations differ.
make_packages()
{
    local file tree kind
    mkdir -p "$2/1" "$2/2"
    cpack --config "$1/CPackConfig.cmake" -B "$2" >"$folder.log" 2>&1 || fail "cpack has made no packages: $(tail "$folder.log")"
    rm -r "$2/_CPack_Packages"
    mv "$2"/*.deb "$2/1/"
    for file in "$2"/1/webots-*.deb; do
        tree=$2/tree
        dpkg-deb --raw-extract "$file" "$tree"
        sed -i 's/^Version: .*/&.1/' "$tree/DEBIAN/control"
        for kind in session simulation; do
            [[ ! -e $tree/etc/webots-cloud/$kind.json ]] || sed -i '2i\  "debug": false,' "$tree/etc/webots-cloud/$kind.json"
        done
        dpkg-deb --build --root-owner-group "$tree" "$2/2/$(basename "$file")" >/dev/null
        rm -r "$tree"
    done
}

# prerequisites PACKAGE...: the packages that these files depend on or recommend, one a line; of alternatives the first, and for a name that
# packages only provide one of those.
prerequisites()
{
    local file name
    for file in "$@"; do
        dpkg-deb --field "$file" Depends Recommends
    done | sed 's/^[A-Za-z]*: //' | tr , '\n' | sed 's/^ *//; s/[ |(].*//' | grep -v '^webots-' | sort -u | while read -r name; do
        [[ -n $(apt-cache show "$name" 2>/dev/null) ]] ||
            name=$(apt-cache showpkg "$name" | sed -n '/^Reverse Provides/,$p' | awk 'NR == 2 { print $1 }')
        echo "$name"
    done
}

main "$@"

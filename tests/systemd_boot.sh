#!/usr/bin/env bash
# Installs the servers on a machine of their own: makes a bare Debian, boots it with its systemd in namespaces, and there installs, upgrades
# and removes the Debian packages (tests/systemd_packages.py); then installs the release from source as docs/operations.md says, and
# looks at what the units do (tests/systemd_boot.py). Needs root, debootstrap, a kernel with unified control groups, the release built
# (cmake --build --preset release), 2 GB and some minutes. It makes one control group, and removes it at the end.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
source tests/support/bare_debian.sh
source tests/support/booted_debian.sh

usage="Usage: tests/systemd_boot.sh [--build FOLDER] [--in FOLDER]
  --build FOLDER  what to install; build/release unless given
  --in FOLDER     where to make the Debian: a new folder, removed at the end; /var/tmp/systemd_boot.XXXXXX unless given"

folder=

main()
{
    local build=build/release
    while [[ $# -gt 0 ]]; do
        case $1 in
            --build) build=${2:?"$usage"} && shift 2 ;;
            --in) folder=${2:?"$usage"} && shift 2 ;;
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
    mkdir -p "$folder/srv/tests/support"
    mv "$folder.packages" "$folder/srv/packages"
    cp tests/systemd_boot.py tests/systemd_packages.py "$folder/srv/tests/"
    cp tests/support/*.py "$folder/srv/tests/support/"
    ln -s /dev/null "$folder/etc/systemd/system/nginx.service" # the tests start one of their own

    step "systemd starts"
    boot_tree debian "$folder"

    step "The packages come, are upgraded, and go"
    ln -s /usr/share/webots_cloud/examples "$folder/srv/examples"
    in_tree debian python3 -B /srv/tests/systemd_packages.py
    rm "$folder/srv/examples"

    step "The servers are installed from source as docs/operations.md says"
    DESTDIR=$folder cmake --install "$build" --prefix /usr/local >/dev/null
    ln -s /usr/local/share/webots_cloud/examples "$folder/srv/examples"
    in_tree debian bash -euxc '
        systemd-sysusers /usr/local/share/webots_cloud/config/systemd/*.conf
        install -D -m 640 -g webots-session /usr/local/share/webots_cloud/config/session/production.json /etc/webots-cloud/session.json
        install -D -m 644 /usr/local/share/webots_cloud/config/simulation/production.json /etc/webots-cloud/simulation.json
        cp /usr/local/share/webots_cloud/config/systemd/webots-*.service /etc/systemd/system/
        systemctl daemon-reload
        systemctl enable --now webots-session-server webots-simulation-server' ||
        fail "They do not start: $(in_tree debian journalctl --no-pager --unit 'webots-*')"

    step "What they do under systemd"
    in_tree debian python3 -B /srv/tests/systemd_boot.py
    step "Packages and units are good"
}

clear_away()
{
    end_trees
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

main "$@"

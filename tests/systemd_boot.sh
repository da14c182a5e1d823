#!/usr/bin/env bash
# Installs the servers on a machine of their own: makes a bare Debian, boots it with its systemd in namespaces, and there installs, upgrades
# and removes the Debian packages (tests/systemd_packages.py); then installs the release from source as docs/operations.md says, and
# looks at what the units do (tests/systemd_boot.py). Needs root, debootstrap, a kernel with unified control groups, the release built
# (cmake --build --preset release), 2 GB and some minutes. It makes one control group, and removes it at the end.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
source tests/support/bare_debian.sh
source tests/support/booted_debian.sh

usage="Usage: tests/systemd_boot.sh [--build FOLDER | --suite NAME --packages FOLDER] [--in FOLDER]
  --build FOLDER     what to install; build/release unless given
  --suite NAME       another Debian than that of this machine, where the packages alone are installed
  --packages FOLDER  with packages for it, as tests/bare_tree.sh leaves them
  --in FOLDER        where to make the Debian: a new folder, removed at the end; /var/tmp/systemd_boot.XXXXXX unless given"

folder=

main()
{
    local build=build/release suite='' packages=''
    while [[ $# -gt 0 ]]; do
        case $1 in
            --build) build=${2:?"$usage"} && shift 2 ;;
            --suite) suite=${2:?"$usage"} && shift 2 ;;
            --packages) packages=${2:?"$usage"} && shift 2 ;;
            --in) folder=${2:?"$usage"} && shift 2 ;;
            *) fail "$usage" ;;
        esac
    done
    [[ $(id -u) -eq 0 ]] || fail "Booting a Debian needs root."
    for program in debootstrap unshare nsenter cmake; do
        command -v "$program" >/dev/null || fail "$program is not installed."
    done
    [[ ${suite:+given} == "${packages:+given}" ]] || fail "$usage"
    for program in session-server simulation-server process-guard demo-simulator; do
        [[ -n $suite || -x $build/bin/webots-$program ]] || fail "$build/bin/webots-$program is not built: cmake --preset release && cmake --build --preset release"
    done
    folder=${folder:-$(mktemp -d /var/tmp/systemd_boot.XXXXXX)}
    mkdir -p "$folder"
    chmod 755 "$folder"
    trap clear_away EXIT

    step "The packages"
    make_packages "$build" "$packages" "$folder.packages"

    step "A bare Debian with systemd, and what our packages ask for"
    make_bare_debian "${suite:-$(own_suite)}" "$folder" \
        systemd,dbus,python3-websockets,git,nginx-light,fcgiwrap
    satisfy "$folder" "$folder.packages"/1/webots-*.deb
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

    [[ -z $suite ]] || { step "The packages are good in $suite" && return; }
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

# make_packages BUILD PACKAGES FOLDER: into FOLDER/1 those of BUILD, or what is in PACKAGES; into FOLDER/2 those of a later version whose
# configurations differ.
make_packages()
{
    local file tree kind
    mkdir -p "$3/1" "$3/2"
    if [[ -n $2 ]]; then
        cp "$2"/*.deb "$3/1/"
    else
        cpack --config "$1/CPackConfig.cmake" -B "$3" >"$folder.log" 2>&1 || fail "cpack has made no packages: $(tail "$folder.log")"
        rm -r "$3/_CPack_Packages"
        mv "$3"/*.deb "$3/1/"
    fi
    for file in "$3"/1/webots-*.deb; do
        tree=$3/tree
        dpkg-deb --raw-extract "$file" "$tree"
        sed -i 's/^Version: .*/&.1/' "$tree/DEBIAN/control"
        for kind in session simulation; do
            [[ ! -e $tree/etc/webots-cloud/$kind.json ]] || sed -i '2i\  "debug": false,' "$tree/etc/webots-cloud/$kind.json"
        done
        dpkg-deb --build --root-owner-group "$tree" "$3/2/$(basename "$file")" >/dev/null
        rm -r "$tree"
    done
}

main "$@"

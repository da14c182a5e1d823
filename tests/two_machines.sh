#!/usr/bin/env bash
# Follows docs/site.md to a site of two machines, literally, and then to a public name for it: boots two bare Debians with their
# systemd, joined by a network of their own, runs the commands of these sections on each, and visits the site from a third machine of that
# network (tests/two_machines.py). Needs root, debootstrap, a kernel with unified control groups, the release built (./server.sh package),
# 2 GB and some minutes.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
source tests/support/bare_debian.sh
source tests/support/booted_debian.sh

usage="Usage: tests/two_machines.sh [--in FOLDER]
  --in FOLDER  where to make the Debians: a new folder, removed at the end; /var/tmp/two_machines.XXXXXX unless given"

folder=
client= # the process that keeps the network, and is the third machine in it
declare -A addresses=([first]=10.0.0.1 [second]=10.0.0.2)

main()
{
    local machine
    while [[ $# -gt 0 ]]; do
        case $1 in
            --in) folder=${2:?"$usage"} && shift 2 ;;
            *) fail "$usage" ;;
        esac
    done
    [[ $(id -u) -eq 0 ]] || fail "Booting Debians needs root."
    for program in debootstrap ip unshare nsenter; do
        command -v "$program" >/dev/null || fail "$program is not installed."
    done
    folder=${folder:-$(mktemp -d /var/tmp/two_machines.XXXXXX)}
    mkdir -p "$folder"
    chmod 755 "$folder"
    trap clear_away EXIT

    step "Packages, as docs/site.md says"
    commands docs/site.md here | bash -eux

    step "Two bare Debians, with what the packages ask for"
    make_debian "$folder/first"
    cp --archive "$folder/first" "$folder/second"

    step "They start, in a network"
    make_network
    for machine in first second; do
        echo "$machine" >"$folder/$machine/etc/hostname"
        boot_tree "$machine" "$folder/$machine"
        join "$machine"
    done

    for machine in first second; do
        step "The commands of docs/site.md on the $machine machine"
        cp build/release/packages/*.deb "$folder/$machine/home/reader/"
        follow "$machine" || fail "They fail: $(in_tree "$machine" journalctl --no-pager --unit 'webots-*')"
    done

    step "Somebody visits the site"
    visit "http://${addresses[first]}:1999"
    step "The doctor of the first machine, to which docs/site.md refers"
    in_tree first webots-session-server --doctor || [[ $? -eq 1 ]] || fail "It finds a fault." # 1: warnings

    for machine in first second; do
        step "The commands for a public name on the $machine machine"
        follow "$machine" public || fail "They fail: $(in_tree "$machine" journalctl --no-pager --unit 'webots-*')"
    done
    step "Somebody visits it by its name"
    cp "$folder/first/etc/webots-cloud/tls/certificate.pem" "$folder/trusted.pem"
    visit https://sim.example.org
    step "docs/site.md leads to a site of two machines"
}

# visit ADDRESS
visit()
{
    in_tree first sed -i '2i\  "loadThreshold": 1000,' /etc/webots-cloud/session.json # the machine that runs the tests may be busy
    in_tree first systemctl reload webots-session-server
    echo "127.0.0.1 localhost
${addresses[first]} sim.example.org" >"$folder/hosts"
    # shellcheck disable=SC2016 # for the other shell
    nsenter --target "$client" --net env SSL_CERT_FILE="$folder/trusted.pem" unshare --mount \
        bash -c 'mount --bind "$1" /etc/hosts && exec /usr/bin/python3 -B tests/two_machines.py "${@:2}"' _ \
        "$folder/hosts" "$1" "${booted_groups[second]}" ||
        fail "$(for machine in first second; do in_tree "$machine" bash -c 'tail -n 20 /var/lib/webots-cloud/*/log/*/output.log'; done)"
}

# commands FILE MARK: the block of the file's commands that has this mark in front, a remark that readers do not see.
commands()
{
    local found
    found=$(awk -v mark="<!-- two machines: $2 -->" '$0 == mark { marked = 1 } !marked { next } /^```$/ { exit } inside { print } /^```bash$/ { inside = 1 }' "$1")
    [[ -n $found ]] || fail "$1 has no commands for $2."
    echo "$found"
}

# follow MACHINE [public]: as a user who may use sudo, in a shell that stops at the first failure.
follow()
{
    commands docs/site.md "${2:+$2 }$1" >"$folder/$1/home/reader/commands"
    in_tree "$1" runuser -u reader -- bash -euxo pipefail -c 'cd && . ./commands'
}

# make_debian FOLDER: with a user who may use sudo. There is no way to the internet there, so what our packages ask for is there already, and
# apt is not to look for what that recommends.
make_debian()
{
    make_bare_debian "$(own_suite)" "$1" systemd,dbus,sudo
    satisfy "$1" build/release/packages/webots-cloud-*.deb
    echo '127.0.0.1 localhost first second' >"$1/etc/hosts"
    echo 'APT::Install-Recommends "false";' >"$1/etc/apt/apt.conf.d/90no_network"
    chroot "$1" useradd --create-home --shell /bin/bash reader
    echo 'reader ALL=(ALL) NOPASSWD: ALL' >"$1/etc/sudoers.d/reader"
}

# A switch, and the third machine: both are a network namespace.
make_network()
{
    unshare --net sleep infinity &
    client=$!
    until [[ $(readlink "/proc/$client/ns/net") != "$(readlink /proc/self/ns/net)" ]]; do sleep 0.1; done
    in_network ip link add switch type bridge
    in_network ip address add 10.0.0.3/24 dev switch
    in_network ip link set lo up
    in_network ip link set switch up
}

in_network()
{
    nsenter --target "$client" --net "$@"
}

# join MACHINE: with a cable to the switch.
join()
{
    local first
    first=$(first_process "$1")
    in_network ip link add "to_$1" type veth peer name cable netns "$first"
    in_network ip link set "to_$1" master switch up
    nsenter --target "$first" --net ip address add "${addresses[$1]}/24" dev cable
    nsenter --target "$first" --net ip link set cable up
}

clear_away()
{
    end_trees
    [[ -z $client ]] || kill "$client" 2>/dev/null || true
    rm -rf --one-file-system "$folder"
}

main "$@"

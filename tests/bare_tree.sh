#!/usr/bin/env bash
# Proves that two commands are enough on a fresh machine: makes a bare Debian, copies the checkout into it, and there runs
# ./server.sh start, looks at what it serves, stops it, and runs ./test.sh. Needs root, debootstrap, git, 6 GB and an hour.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
source tests/support/bare_debian.sh

usage="Usage: tests/bare_tree.sh [--quick] [--user] [--suite NAME] [--first COMMAND] [--in FOLDER]
  --quick          ./test.sh --quick: the release only
  --user           as somebody who is not root and may use sudo
  --suite NAME     which Debian; bookworm (12) unless given
  --first COMMAND  what the shell of the tree does first, to make it resemble another system: installs a compiler, say
  --in FOLDER      where to make it: a new folder, removed at the end; /var/tmp/bare_tree.XXXXXX unless given"

folder=
user=root # who runs the commands in the tree
home=/root

# The parts of the environment that the network may need.
proxies=()
for name in http_proxy https_proxy no_proxy; do
    [[ -z ${!name-} ]] || proxies+=("$name=${!name}")
done

main()
{
    local suite=bookworm first=true as=root options=()
    while [[ $# -gt 0 ]]; do
        case $1 in
            --quick) options+=("$1") && shift ;;
            --user) as=teacher && shift ;;
            --suite) suite=${2:?"$usage"} && shift 2 ;;
            --first) first=${2:?"$usage"} && shift 2 ;;
            --in) folder=${2:?"$usage"} && shift 2 ;;
            --inside)
                inside "${@:2}"
                exit
                ;;
            *) fail "$usage" ;;
        esac
    done
    [[ $(id -u) -eq 0 ]] || fail "Making a bare Debian needs root."
    for program in debootstrap git unshare; do
        command -v "$program" >/dev/null || fail "$program is not installed."
    done
    folder=${folder:-$(mktemp -d /var/tmp/bare_tree.XXXXXX)}
    mkdir -p "$folder"
    chmod 755 "$folder" # a root that others may not enter leaves web servers without /etc/hosts
    trap 'rm -rf --one-file-system "$folder"' EXIT

    step "A bare Debian: $suite"
    debootstrap --variant=minbase "$suite" "$folder" "$(mirror)" >"$folder.log" 2>&1 || { tail "$folder.log" && exit 1; }
    rm "$folder.log"
    cp --dereference /etc/resolv.conf /etc/hosts "$folder/etc/"
    mkdir "$folder/srv/checkout"
    git ls-files -z --cached --others --exclude-standard | tar -c --null -T - | tar -x -C "$folder/srv/checkout"
    # Mounts and processes live in namespaces of their own, which end with this command, however it ends.
    unshare --mount --pid --fork --kill-child "$PWD/tests/bare_tree.sh" --inside "$folder" "$as" "$first" "${options[@]}"
}

# In the namespaces: the proof itself.
inside()
{
    folder=$1 # the tree
    local first=$3
    mount --bind "$folder" "$folder" # a Docker daemon, which the tests start, needs a root that is a mount
    mount -t proc proc "$folder/proc"
    mount --rbind /dev "$folder/dev"
    mount --rbind /sys "$folder/sys"

    in_tree bash -c "$first"
    [[ $2 == root ]] || become "$2"
    step "./server.sh start"
    in_tree ./server.sh start | tee "$folder/start.log"
    grep -qx 'Open http://localhost:1999/viewer/' "$folder/start.log" || fail "It did not print the address to open."
    expect /viewer/ '<html'
    expect /monitor 'localhost:2000'
    expect /session 'ws://localhost:2000'

    step "./server.sh start, again"
    in_tree ./server.sh start | tee "$folder/start.log"
    [[ $(grep -c 'is already running' "$folder/start.log") -eq 2 ]] || fail "It did not say that both are running."

    step "./server.sh stop"
    in_tree ./server.sh stop | tee "$folder/stop.log"
    [[ $(grep -c '^Stopped ' "$folder/stop.log") -eq 2 ]] || fail "It did not stop both."

    step "./test.sh ${*:4}"
    in_tree ./test.sh "${@:4}"
    step "Two commands were enough"
}

in_tree()
{
    chroot --userspec "$user" "$folder" env -i -C /srv/checkout "HOME=$home" PATH=/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin \
        CI=true "${proxies[@]}" "$@" </dev/null
}

# become NAME: from now on the commands run as a new user, who may use sudo.
become()
{
    in_tree bash -c "apt-get update -q && apt-get install -y -q --no-install-recommends sudo &&
        useradd --create-home $1 && echo '$1 ALL=(ALL) NOPASSWD: ALL' >/etc/sudoers.d/$1 && chown -R $1: ." >/dev/null
    user=$1
    home=/home/$1
}

# expect PATH TEXT: the session server answers with it.
expect()
{
    local answer
    exec 3<>/dev/tcp/localhost/1999
    printf 'GET %s HTTP/1.1\r\nHost: localhost:1999\r\nConnection: close\r\n\r\n' "$1" >&3
    answer=$(tr -d '\0' <&3)
    exec 3>&-
    [[ $answer == "HTTP/1.1 200"*"$2"* ]] || fail "$1: expected $2, found: ${answer:0:500}"
    echo "$1: good"
}

main "$@"

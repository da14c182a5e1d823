#!/usr/bin/env bash
# Proves that two commands are enough on a fresh machine: makes a bare Debian, copies the checkout into it, and there runs
# ./server.sh start, looks at what it serves, stops it, and runs ./test.sh. Needs root, debootstrap, git, 6 GB and an hour. With --install it
# proves the same of ./server.sh install; then 2 GB and ten minutes are enough, since the build of this checkout is used, which has to be
# there. With another Debian than this machine's all is built in it, in twenty minutes.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
source tests/support/bare_debian.sh

usage="Usage: tests/bare_tree.sh [--quick|--install [--packages FOLDER]] [--user] [--suite NAME] [--first COMMAND] [--in FOLDER]
  --quick          ./test.sh --quick: the release only
  --install        ./server.sh install, as root, with what build/release has, if that is of the same Debian
  --packages FOLDER
                   where to leave the packages that ./server.sh install has made, for systemd_boot.sh and dev_package.sh
  --user           as somebody who is not root and may use sudo
  --suite NAME     which Debian; bookworm (12) unless given
  --first COMMAND  what the shell of the tree does first, to make it resemble another system: installs a compiler, say
  --in FOLDER      where to make it: a new folder, removed at the end; /var/tmp/bare_tree.XXXXXX unless given"

folder=
user=root # who runs the commands in the tree
home=/root
checkout=/srv/checkout # where it is in the tree

main()
{
    local suite=bookworm first=true as=root options=() install= packages=
    while [[ $# -gt 0 ]]; do
        case $1 in
            --quick) options+=("$1") && shift ;;
            --install) install=yes && shift ;;
            --packages) packages=${2:?"$usage"} && shift 2 ;;
            --user) as=teacher && shift ;;
            --suite) suite=${2:?"$usage"} && shift 2 ;;
            --first) first=${2:?"$usage"} && shift 2 ;;
            --in) folder=${2:?"$usage"} && shift 2 ;;
            --inside | --inside-install)
                "${1#--}" "${@:2}"
                exit
                ;;
            *) fail "$usage" ;;
        esac
    done
    [[ -z $packages || -n $install ]] || fail "$usage"
    [[ $(id -u) -eq 0 ]] || fail "Making a bare Debian needs root."
    for program in debootstrap git unshare; do
        command -v "$program" >/dev/null || fail "$program is not installed."
    done
    folder=${folder:-$(mktemp -d /var/tmp/bare_tree.XXXXXX)}
    mkdir -p "$folder"
    chmod 755 "$folder" # a root that others may not enter leaves web servers without /etc/hosts
    trap 'rm -rf --one-file-system "$folder"' EXIT

    step "A bare Debian: $suite"
    make_bare_debian "$suite" "$folder"
    # Mounts and processes live in namespaces of their own, which end with this command, however it ends.
    if [[ -n $install ]]; then
        [[ $as == root ]] || fail "$usage"
        if [[ $suite != "$(own_suite)" ]]; then
            first="rm -rf build && $first" # in the tree
        elif [[ ! -e build/release/build.ninja ]]; then
            fail "build/release is not built: cmake --preset release && cmake --build --preset release"
        fi
        mkdir "$folder/changed" "$folder/work"
        unshare --mount --pid --fork --kill-child "$PWD/tests/bare_tree.sh" --inside-install "$folder" "$first" "$packages"
        return
    fi
    mkdir "$folder/srv/checkout"
    git ls-files -z --cached --others --exclude-standard | tar -c --null -T - | tar -x -C "$folder/srv/checkout"
    unshare --mount --pid --fork --kill-child "$PWD/tests/bare_tree.sh" --inside "$folder" "$as" "$first" "${options[@]}"
}

# mount_tree FOLDER: in the namespaces.
mount_tree()
{
    folder=$1
    mount --bind "$folder" "$folder" # a Docker daemon, which the tests start, needs a root that is a mount
    mount -t proc proc "$folder/proc"
    mount --rbind /dev "$folder/dev"
    mount --rbind /sys "$folder/sys"
}

# In the namespaces: the proof itself. The tree becomes their root: with chroot alone the kernel would refuse user namespaces, and with them
# the sandboxes.
inside()
{
    mount_tree "$1"
    cd "$1"
    mkdir former
    pivot_root . former
    cd /
    umount --lazy /former
    rmdir /former
    folder=
    in_tree bash -c "$3"
    [[ $2 == root ]] || become "$2"
    step "./server.sh start"
    in_tree ./server.sh start | tee "$folder/tmp/start.log"
    grep -qx 'Open http://localhost:1999/' "$folder/tmp/start.log" || fail "It did not print the address to open."
    expect /viewer/ '<html'
    expect /monitor 'localhost:2000'
    expect /session 'ws://localhost:1999' # whence the session server passes browsers on

    step "./server.sh start, again"
    in_tree ./server.sh start | tee "$folder/tmp/start.log"
    [[ $(grep -c 'is already running' "$folder/tmp/start.log") -eq 3 ]] || fail "It did not say that all three are running."

    step "./server.sh stop"
    in_tree ./server.sh stop | tee "$folder/tmp/stop.log"
    [[ $(grep -c '^Stopped ' "$folder/tmp/stop.log") -eq 3 ]] || fail "It did not stop all three."

    step "./test.sh ${*:4}"
    in_tree ./test.sh "${@:4}"
    step "Two commands were enough"
}

# inside-install FOLDER COMMAND PACKAGES: the same of ./server.sh install. A build knows where it is, so the checkout is where it is here;
# what changes in it stays in the tree. The packages are left in PACKAGES, unless it is empty.
inside-install()
{
    mount_tree "$1"
    local command edited=$folder/etc/webots-cloud/session.json log=$folder/install.log
    checkout=$PWD
    mkdir -p "$folder$checkout"
    mount -t overlay -o "lowerdir=$checkout,upperdir=$folder/changed,workdir=$folder/work" overlay "$folder$checkout"
    in_tree bash -c "$2"

    step "./server.sh install"
    in_tree ./server.sh install | tee "$log"
    grep -q '^Installed. Open http://localhost:1999/ ' "$log" || fail "It did not print the address to open."
    grep -q '^This machine runs no systemd now' "$log" || fail "It did not say that nothing has been started."
    [[ -z $3 ]] || { mkdir -p "$3" && cp "$folder$checkout"/build/release/packages/*.deb "$3/"; }

    step "What is installed serves"
    in_tree unshare --net bash -euc '
        cd /tmp
        ip link set lo up
        webots-simulation-server /etc/webots-cloud/simulation.json >simulation.log 2>&1 &
        webots-session-server /etc/webots-cloud/session.json >session.log 2>&1 &
        ask() { exec 3<>"/dev/tcp/localhost/$1" && printf "GET %s HTTP/1.0\r\n\r\n" "$2" >&3 && tr -d "\0" <&3; }
        for try in {1..100}; do
            if page=$(ask 1999 /viewer/) && load=$(ask 2000 /load); then break; fi
            sleep 0.1
        done 2>/dev/null
        [[ $page == "HTTP/1.1 200"*"<html"* && $load == "HTTP/1.1 200"* ]] || { cat ./*.log && exit 1; }
        kill $(jobs -p) && wait' || fail "The servers do not answer."

    step "./server.sh install, again: an edited configuration is kept"
    sed -i '2i\  "title": "edited",' "$edited"
    in_tree ./server.sh install >"$log" || { cat "$log" && fail "It fails the second time."; }
    grep -q '"edited"' "$edited" || fail "The configuration is not kept."

    step "The command that it names removes all"
    command=$(sed -n 's/.*To remove all: *sudo apt purge/apt-get purge -y/p' "$log")
    [[ -n $command ]] || fail "It named none."
    in_tree bash -c "$command" >"$log" 2>&1 || { cat "$log" && fail "It fails."; }
    [[ ! -e $folder/etc/webots-cloud ]] || fail "/etc/webots-cloud is left: $(ls "$folder/etc/webots-cloud")"
    [[ -z $(find "$folder/usr" "$folder/var/lib" -name 'webots[-_]*' -not -path '*/dpkg/*' -print -quit) ]] || fail "Files are left."
    step "One command was enough"
}

in_tree()
{
    chroot --userspec "$user" "$folder/" env -i -C "$checkout" "HOME=$home" PATH=/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin \
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

#!/usr/bin/env bash
# Boots Debians, each with its systemd in namespaces of its own. For scripts, which source it together with bare_debian.sh:
#
#     boot_tree NAME FOLDER     starts the systemd of the tree in FOLDER, in a control group of its own, and returns when it is up
#     in_tree NAME COMMAND...   runs a command there as root
#     end_trees                 at the end: kills all that was booted, and removes the control groups
#
# Needs root, unshare, nsenter, setpriv and a kernel with unified control groups.
# shellcheck shell=bash

declare -A booted=()        # by name: the process that keeps the namespaces
declare -A booted_groups=() # and the control group

boot_tree()
{
    local name=$1 folder=$2 groups
    groups=$(findmnt --noheadings --first-only --types cgroup2 --output TARGET) || fail "No unified control groups (cgroup2) are mounted."
    mkdir "$groups/webots_cloud_$name.$$"
    booted_groups[$name]=$groups/webots_cloud_$name.$$
    unshare --pid --fork --kill-child bash "$PWD/tests/support/booted_debian.sh" --boot "$folder" "${booted_groups[$name]}" \
        >"$folder.log" 2>&1 </dev/null &
    booted[$name]=$!
    until_booted "$name" "$folder"
}

# Waits for the first process of the namespaces to be a systemd that has finished.
until_booted()
{
    local state='no answer'
    for _ in {1..300}; do
        kill -0 "${booted[$1]}" 2>/dev/null || fail "It ended at once: $(tail "$2.log")"
        state=$(in_tree "$1" systemctl is-system-running --wait 2>&1) && return
        [[ $state != degraded ]] || break
        sleep 0.2
    done
    fail "systemd is not up: $state"$'\n'"$(in_tree "$1" systemctl --failed --no-pager 2>&1)"$'\n'"$(tail "$2.log")"
}

# The first process of a tree.
first_process()
{
    pgrep --parent "${booted[$1]}"
}

in_tree()
{
    local first
    first=$(first_process "$1") || return
    nsenter --target "$first" --mount --uts --ipc --net --pid --cgroup --root --wd \
        env -i HOME=/root PATH=/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin SYSTEMD_PAGER= "${@:2}" </dev/null
}

end_trees()
{
    local each
    for each in "${booted[@]}"; do
        kill -KILL "$each" 2>/dev/null || true # the first process of the namespace goes with it, and all others with that
        wait "$each" 2>/dev/null || true
    done
    for each in "${booted_groups[@]}"; do
        until ! grep -q 'populated 1' "$each/cgroup.events"; do sleep 0.1; done
        find "$each" -depth -type d -exec rmdir {} +
    done
}

# boot TREE GROUP: in a new PID namespace, as its first process. Enters the control group, so that the namespace of control groups which is
# made then has it as its root.
boot()
{
    echo 0 >"$2/cgroup.procs"
    exec unshare --mount --ipc --uts --net --cgroup --propagation private bash "$0" --become-systemd "$1"
}

become_systemd()
{
    local tree=$1 device
    mount --bind "$tree" "$tree"
    cd "$tree" # of the mount
    mount -t proc proc proc
    mount --bind proc/sys proc/sys
    mount --bind proc/sys/net proc/sys/net
    mount -o remount,bind,ro proc/sys # settings of the kernel are the machine's; those of the network are of this namespace
    mount -t sysfs -o ro sysfs sys
    mount -t cgroup2 cgroup2 sys/fs/cgroup
    mount -t tmpfs -o mode=755 tmpfs run
    mount -t tmpfs -o mode=1777 tmpfs tmp
    mount -t tmpfs -o mode=755 tmpfs dev
    for device in null zero full random urandom tty; do
        touch "dev/$device"
        mount --bind "/dev/$device" "dev/$device"
    done
    mkdir -p dev/pts dev/net dev/proc put_old
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

if [[ ${BASH_SOURCE[0]} == "$0" ]]; then
    set -euo pipefail
    case $1 in
        --boot) boot "$2" "$3" ;;
        --become-systemd) become_systemd "$2" ;;
    esac
fi

#!/usr/bin/env bash
# Boots a virtual machine with a kernel of Debian's own, which has control groups of version 2 alone, Landlock, udev and systemd; installs
# the Debian packages there, and lets the tests of the walls (tests/virtual_machine.py) run in it. Needs root, debootstrap, qemu-system-x86,
# e2fsprogs, the release built (cmake --build --preset release --target installable), 5 GB of disk and 3 GB of memory. Where the processor
# can't run virtual machines, this one is emulated, which takes half an hour.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
source tests/support/bare_debian.sh

usage="Usage: tests/virtual_machine.sh [--build FOLDER] [--in FOLDER] [TEST ...]
  --build FOLDER  what to install; build/release unless given
  --in FOLDER     where to make the machine: a new folder, removed at the end; /var/tmp/virtual_machine.XXXXXX unless given
  TEST            as for unittest, as in UnderTheUnit; all of them unless given"

folder=
machine= # the process that is the virtual machine

main()
{
    local build=build/release
    while [[ $# -gt 0 ]]; do
        case $1 in
            --build) build=${2:?"$usage"} && shift 2 ;;
            --in) folder=${2:?"$usage"} && shift 2 ;;
            -*) fail "$usage" ;;
            *) break ;;
        esac
    done
    [[ $(id -u) -eq 0 ]] || fail "Making a Debian needs root."
    for program in debootstrap qemu-system-x86_64 mke2fs cpack; do
        command -v "$program" >/dev/null || fail "$program is not installed."
    done
    folder=${folder:-$(mktemp -d /var/tmp/virtual_machine.XXXXXX)}
    mkdir -p "$folder"
    trap clear_away EXIT

    step "The packages"
    cpack --config "$build/CPackConfig.cmake" -B "$folder/packages" >"$folder/log" 2>&1 || fail "cpack has made no packages: $(tail "$folder/log")"
    rm "$folder"/packages/libwebots-*.deb

    step "A bare Debian with a kernel, and what our packages ask for"
    make_tree "$folder/tree" "$folder"/packages/webots-*.deb
    add_tests "$folder/tree" "$@"

    step "Its disk"
    truncate --size 4G "$folder/disk"
    mke2fs -q -t ext4 -d "$folder/tree" "$folder/disk"

    step "It starts, and tests run in it"
    run_machine
}

# make_tree FOLDER PACKAGE...
make_tree()
{
    local tree=$1
    shift
    make_bare_debian "$(own_suite)" "$tree" \
        systemd-sysv,dbus,udev,linux-image-cloud-amd64,python3-websockets,openssl,git,nginx-light,fcgiwrap,uidmap,firejail
    satisfy "$tree" "$@"
    echo '127.0.0.1 localhost' >"$tree/etc/hosts"
    mkdir "$tree/srv/packages"
    cp "$@" "$tree/srv/packages/"
}

# add_tests TREE TEST...: what they need lies in the machine as it does in the sources.
add_tests()
{
    local tree=$1
    shift
    cp -r tests examples "$tree/srv/"
    cat >"$tree/etc/systemd/system/tests.service" <<UNIT
[Unit]
Description=Tests, whose output goes to the second serial line
SuccessAction=poweroff-immediate
FailureAction=poweroff-immediate
[Service]
Type=oneshot
WorkingDirectory=/srv
Environment=HOME=/root WEBOTS_CLOUD_BIN=/usr/bin
ExecStart=/usr/bin/python3 -B tests/virtual_machine.py $*
StandardOutput=file:/dev/ttyS1
StandardError=inherit
[Install]
WantedBy=multi-user.target
UNIT
    ln -s /dev/null "$tree/etc/systemd/system/nginx.service" # the tests start one of their own
    ln -s /etc/systemd/system/tests.service "$tree/etc/systemd/system/multi-user.target.wants/"
}

# Ends with the machine, which switches itself off. What its kernel and systemd say is kept until then.
run_machine()
{
    local accelerator=tcg,thread=multi status
    # A kernel that is a guest itself may offer /dev/kvm, but only for guests that know of that.
    if [[ -w /dev/kvm ]] && grep -qwE '^flags.*(vmx|svm)' /proc/cpuinfo; then
        accelerator=kvm
    else
        echo "This processor runs no virtual machines: it is emulated, which takes its time."
    fi
    qemu-system-x86_64 -accel "$accelerator" -cpu max -smp "$(nproc)" -m 3072 -display none -nic none -no-reboot \
        -kernel "$folder"/tree/boot/vmlinuz-* -initrd "$folder"/tree/boot/initrd.img-* -append 'root=/dev/vda rw console=ttyS0 panic=-1 no_timer_check' \
        -drive "file=$folder/disk,format=raw,if=virtio,cache=unsafe" \
        -serial "file:$folder/console" -serial "file:$folder/said" </dev/null &
    machine=$!
    tail --pid "$machine" --follow=name --retry --lines +1 "$folder/said" 2>/dev/null | sed -u 's|\r$||' || true
    wait "$machine" || fail "The machine ended: $(tail "$folder/console")"
    status=$(tr -d '\r' <"$folder/said" | sed -n '$s/^exit status //p')
    [[ $status == 0 ]] || fail "What systemd and the kernel said: $(tail -n 20 "$folder/console")"
    step "The walls hold there"
}

clear_away()
{
    [[ -z $machine ]] || kill "$machine" 2>/dev/null || true
    rm -rf --one-file-system "$folder"
}

main "$@"

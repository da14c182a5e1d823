# What the scripts share that make a Debian of their own.
# shellcheck shell=bash

# mirror [LABEL]: the package server that this machine itself uses, for Debian or for Debian-Security.
mirror()
{
    # shellcheck disable=SC2016 # apt's own placeholder
    apt-get indextargets 'Identifier: Packages' "Label: ${1-Debian}" --format '$(REPO_URI)' | sed -n 1p
}

# The release of Debian that this machine itself runs: bookworm.
own_suite()
{
    # shellcheck disable=SC1091 # of the machine
    (. /etc/os-release && echo "$VERSION_CODENAME")
}

# The parts of the environment that the network may need.
proxies=()
for name in http_proxy https_proxy no_proxy; do
    [[ -z ${!name-} ]] || proxies+=("$name=${!name}")
done
# The authorities of a proxy that looks into what npm fetches; a copy in the tree.
authorities=/etc/authorities_for_npm.pem
[[ -z ${NODE_EXTRA_CA_CERTS-} ]] || proxies+=("NODE_EXTRA_CA_CERTS=$authorities")

# make_bare_debian SUITE FOLDER [PACKAGE,...]: one that finds its way to the internet, with these packages.
make_bare_debian()
{
    debootstrap --variant=minbase ${3:+"--include=$3"} "$1" "$2" "$(mirror)" >"$2.log" 2>&1 || { tail "$2.log" && exit 1; }
    rm "$2.log"
    local security
    security=$(mirror Debian-Security)
    [[ -z $security ]] || echo "deb $security $1-security main" >"$2/etc/apt/sources.list.d/security.list" # as where Debian was installed
    cp --dereference /etc/resolv.conf /etc/hosts "$2/etc/"
    [[ -z ${NODE_EXTRA_CA_CERTS-} ]] || cp --dereference "$NODE_EXTRA_CA_CERTS" "$2$authorities"
}

step()
{
    printf '\n=== %(%H:%M:%S)T %s\n' -1 "$1"
}

fail()
{
    echo "$*" >&2
    exit 1
}

# satisfy TREE PACKAGE...: has the apt of a bare Debian install what these files depend on or recommend, but for packages of ours.
satisfy()
{
    local tree=$1 file wanted
    wanted=$(for file in "${@:2}"; do
        dpkg-deb --field "$file" Depends Recommends
    done | sed 's/^[A-Za-z]*: //' | tr , '\n' | sed 's/^ *//' | grep -v '^webots-' | sort -u | paste -sd,)
    printf '#!/bin/sh\nexit 101\n' >"$tree/usr/sbin/policy-rc.d" # nothing is started there
    chmod 755 "$tree/usr/sbin/policy-rc.d"
    chroot "$tree" env -i HOME=/root DEBIAN_FRONTEND=noninteractive PATH=/usr/sbin:/usr/bin:/sbin:/bin "${proxies[@]}" bash -c "
        apt-get update -q && apt-get satisfy -y -q --no-install-recommends '$wanted'" >"$tree.log" 2>&1 </dev/null || { tail "$tree.log" && exit 1; }
    rm "$tree.log" "$tree/usr/sbin/policy-rc.d"
}

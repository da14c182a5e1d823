# What the scripts share that make a Debian of their own.
# shellcheck shell=bash

# The package server that this machine itself uses.
mirror()
{
    # shellcheck disable=SC2016 # apt's own placeholder
    apt-get indextargets 'Identifier: Packages' 'Label: Debian' --format '$(REPO_URI)' | sed -n 1p
}

# The parts of the environment that the network may need.
proxies=()
for name in http_proxy https_proxy no_proxy; do
    [[ -z ${!name-} ]] || proxies+=("$name=${!name}")
done

# make_bare_debian SUITE FOLDER: one that finds its way to the internet.
make_bare_debian()
{
    debootstrap --variant=minbase "$1" "$2" "$(mirror)" >"$2.log" 2>&1 || { tail "$2.log" && exit 1; }
    rm "$2.log"
    cp --dereference /etc/resolv.conf /etc/hosts "$2/etc/"
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

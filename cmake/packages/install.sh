# Installs Debian packages that are missing. Sourced by server.sh, test.sh and docs.sh; the lists are build.txt, package.txt, test.txt and docs.txt
# beside it.
# shellcheck shell=bash

oldest_boost=1.81

# install_packages FILE...: makes sure that the packages of the lists are there. Fast and without root when they are.
install_packages()
{
    local missing=()
    boost_version=$(installed_boost)
    boost_version=${boost_version:-none}
    mapfile -t missing < <(read_lists "$@" | missing_entries)
    [[ ${#missing[@]} -gt 0 ]] || return 0
    command -v apt-get >/dev/null || fail "Missing: ${missing[*]}. Only Debian's and Ubuntu's packages can be installed here."

    echo "Updating the list of packages, because some are missing"
    as_root apt-get update -q || fail "The list of packages can't be updated (apt-get update failed)."
    [[ $boost_version != none ]] || boost_version=$(offered_boost)
    [[ -n $boost_version ]] || fail "This system offers no Boost $oldest_boost or newer: Debian 12 or Ubuntu 24.04 do."
    local packages
    packages=$(read_lists "$@" | missing_entries | choose_packages) || exit 1
    [[ -n $packages ]] || return 0
    echo "Installing ${packages//$'\n'/ }"
    # shellcheck disable=SC2086 # one word per package
    without_services apt-get install -y -q --no-install-recommends $packages || fail "apt-get install failed."
}

fail()
{
    echo "$*" >&2
    exit 1
}

as_root()
{
    if [[ $(id -u) -eq 0 ]]; then
        DEBIAN_FRONTEND=noninteractive "$@" </dev/null
    elif command -v sudo >/dev/null; then
        sudo env DEBIAN_FRONTEND=noninteractive "$@"
    else
        fail "Installing packages needs root, and there is no sudo. As root, run: $*"
    fi
}

# The entries of the lists, a line each, without comments.
read_lists()
{
    sed -e 's/#.*//' -e 's/[[:space:]]*$//' -e '/^$/d' "$@"
}

# Of the entries on standard input, those of which no alternative is installed.
missing_entries()
{
    local installed entry name found
    installed=$(dpkg-query -W -f '${db:Status-Status} ${Package}\n' | sed -n 's/^installed //p' | sort -u)
    while read -r entry; do
        found=
        for name in $(alternatives "$entry"); do
            grep -qxF -- "$name" <<<"$installed" && found=yes
        done
        [[ -n $found ]] || echo "$entry"
    done
}

# The package to install for each entry on standard input; entries that may be left out may have none.
choose_packages()
{
    local entry name chosen
    while read -r entry; do
        chosen=
        for name in $(alternatives "$entry"); do
            [[ -n $chosen ]] || ! is_offered "$name" || chosen=$name
        done
        if [[ -n $chosen ]]; then
            echo "$chosen"
        elif [[ $entry != *'?' ]]; then
            fail "This system offers no package $(alternatives "$entry" | paste -sd '|')."
        fi
    done
}

alternatives()
{
    local names=${1//[|?]/ }
    # shellcheck disable=SC2086 # words are what we want
    printf '%s\n' ${names//\{boost\}/$boost_version}
}

is_offered()
{
    [[ $(apt-cache policy "$1" | sed -n 's/^ *Candidate: //p') == [0-9]* ]]
}

# The version of the Boost headers that are installed, if they are new enough; the newest of several.
installed_boost()
{
    { dpkg-query -W -f '${db:Status-Status} ${Package}\n' 'libboost1.*-dev' 2>/dev/null || true; } |
        sed -n 's/^installed libboost\(1\.[0-9]*\)-dev$/\1/p' | new_enough | tail -n 1
}

# The oldest one on offer that is new enough: nearest to what we are tested with, and on most systems the system's own.
offered_boost()
{
    apt-cache pkgnames libboost1. | sed -n 's/^libboost\(1\.[0-9]*\)-dev$/\1/p' | new_enough | sed -n 1p
}

new_enough()
{
    local version
    sort -V | while read -r version; do
        [[ $(printf '%s\n' "$oldest_boost" "$version" | sort -V | head -n 1) == "$oldest_boost" ]] && echo "$version"
    done
    return 0
}

# Runs a command as root while Debian starts no service that it installs: the tests run web servers of their own.
without_services()
{
    # shellcheck disable=SC2016 # expanded by the inner shell
    as_root sh -c '
        policy=/usr/sbin/policy-rc.d
        if [ ! -e $policy ]; then
            trap "rm -f $policy" EXIT
            trap "exit 130" INT TERM
            printf "#!/bin/sh\nexit 101\n" >$policy
            chmod 755 $policy
        fi
        "$@"' sh "$@"
}

# install_node_packages FOLDER: what FOLDER/package.json asks for, as its package-lock.json pins it, into build/node/FOLDER. Fast
# when it is there already. Fails where there is no npm, or npm can't be reached; nothing is left behind then.
install_node_packages()
{
    local folder=$1 target=build/node/$1
    ! cmp -s "$folder/package-lock.json" "$target/package-lock.json" || return 0
    if ! command -v npm >/dev/null; then
        echo "Installing npm"
        as_root apt-get update -q && without_services apt-get install -y -q --no-install-recommends npm || return
    fi
    rm -rf "$target" "$target.new"
    mkdir -p "$target.new"
    cp "$folder/package.json" "$folder/package-lock.json" "$target.new/"
    if ! (cd "$target.new" && timeout 300 npm ci --ignore-scripts --no-audit --no-fund --loglevel=error --fetch-retries=1 --fetch-retry-mintimeout=1000 --fetch-timeout=30000); then
        rm -rf "$target.new"
        return 1
    fi
    mv "$target.new" "$target"
}

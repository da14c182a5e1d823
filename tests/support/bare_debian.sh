# What the scripts share that make a Debian of their own.
# shellcheck shell=bash

# The package server that this machine itself uses.
mirror()
{
    # shellcheck disable=SC2016 # apt's own placeholder
    apt-get indextargets 'Identifier: Packages' 'Label: Debian' --format '$(REPO_URI)' | sed -n 1p
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

#!/usr/bin/env bash
# Makes the container images of both servers from our Debian packages, and the list of what is in them (SBOM). See docs/clusters.md.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."

usage="Usage: config/containers/build.sh [OPTION...]

Makes the images webots-cloud/session-server and webots-cloud/simulation-server with the Docker daemon of DOCKER_HOST.
  --base IMAGE       what the images begin with: a Debian 12; debian:bookworm-slim unless given
  --bootstrap        make that image first, from Debian's mirror, where no registry can be reached (root, debootstrap);
                     MIRROR in the environment names another one, as in http://mirror.example.org/debian
  --packages FOLDER  where our Debian packages are, made by cpack; build/release/packages unless given
  --tag TAG          of the images; the version of the packages unless given
  --sbom FOLDER      where to write <image>.spdx.json; nowhere unless given
  --network NAME     the network of docker in which packages are fetched, as in host
  --help             this text"

base=debian:bookworm-slim
bootstrap=
packages=build/release/packages
tag=
sbom=
network=default
context=

main()
{
    while [[ $# -gt 0 ]]; do
        case $1 in
            --base) base=${2:?"$usage"} && shift 2 ;;
            --bootstrap) bootstrap=yes && shift ;;
            --packages) packages=${2:?"$usage"} && shift 2 ;;
            --tag) tag=${2:?"$usage"} && shift 2 ;;
            --sbom) sbom=${2:?"$usage"} && shift 2 ;;
            --network) network=${2:?"$usage"} && shift 2 ;;
            --help) echo "$usage" && exit ;;
            *) echo "$usage" >&2 && exit 2 ;;
        esac
    done
    command -v docker >/dev/null || fail "docker is not installed (package docker.io)."
    docker version >/dev/null || fail "The Docker daemon does not answer."
    local session simulation demo version
    session=$(package webots-cloud-session-server)
    simulation=$(package webots-cloud-simulation-server)
    demo=$(package webots-cloud-demo)
    version=$(dpkg-deb --field "$session" Version)
    tag=${tag:-${version%-*}}
    context=$(mktemp -d)
    trap 'rm -rf "$context"' EXIT
    [[ -z $bootstrap ]] || bootstrap_base
    image session-server session.Dockerfile "$session"
    image simulation-server simulation.Dockerfile "$simulation" "$demo" config/containers/simulation.json
    docker image ls --filter "reference=webots-cloud/*:$tag"
}

# The path of a package, of which there has to be one version.
package()
{
    local found
    found=$(compgen -G "$packages/$1_*.deb") || fail "$packages has no package $1. To make it:
  cmake --preset release && cmake --build --preset release --target installable && cpack --preset release"
    [[ $found != *$'\n'* ]] || fail "$packages has more than one version of $1."
    echo "$found"
}

bootstrap_base()
{
    [[ $(id -u) -eq 0 ]] || fail "--bootstrap needs root."
    command -v debootstrap >/dev/null || fail "debootstrap is not installed."
    local root=$context/root suite=bookworm
    debootstrap --variant=minbase "$suite" "$root" ${MIRROR:+"$MIRROR"} >"$context/log" 2>&1 ||
        fail "debootstrap failed: $(tail -n 3 "$context/log")"
    # Security updates are beside the packages, on Debian's servers and on whole mirrors of them.
    local sources=$root/etc/apt/sources.list security
    security=$(sed -n "s,/debian/* $suite main\$,/debian-security $suite-security main,p" "$sources")
    [[ -n $security ]] || fail "No security updates are known for $(cat "$sources"): MIRROR has to end with /debian."
    echo "$security" >>"$sources"
    rm -rf "$root"/var/cache/apt/archives/*.deb "$root"/var/lib/apt/lists/* "${root:?}"/dev/*
    tar --create --numeric-owner --directory "$root" . | docker import - "$base" >/dev/null
    rm -rf "$root"
}

# image NAME DOCKERFILE FILE...: builds it from these files alone.
image()
{
    local name=webots-cloud/$1:$tag files=$context/$1 revision
    mkdir "$files"
    cp "config/containers/$2" "${@:3}" "$files/"
    revision=$(git rev-parse HEAD 2>/dev/null || echo unknown)
    docker build --quiet --network "$network" --file "$files/$2" --tag "$name" --build-arg "BASE=$base" --build-arg "VERSION=$tag" \
        --build-arg "REVISION=$revision" "$files" || fail "$name could not be built."
    if [[ -n $sbom ]]; then
        mkdir -p "$sbom"
        config/containers/sbom.py "$name" >"$sbom/$1.spdx.json"
    fi
}

fail()
{
    echo "$*" >&2
    exit 1
}

main "$@"

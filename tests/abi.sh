#!/usr/bin/env bash
# Compares what the shared library exports with an earlier revision's, by abidiff. Builds both without optimisation: some 10 minutes.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

usage="Usage: tests/abi.sh [REVISION]
  REVISION   what to compare with; without: the last tag v*
Exit status: 0 nothing that programs use has changed, or the version says so; 1 it has; 2 it could not be compared."

folder=

main()
{
    local revision=${1-} tag= status=0
    if [[ $revision == -* ]]; then
        [[ $revision == --help ]] && echo "$usage" && exit
        stop "$usage"
    fi
    command -v abidiff >/dev/null || stop "abidiff is not installed: it is in the package abigail-tools."
    if [[ -z $revision ]]; then
        tag=$(git describe --tags --match 'v*' --abbrev=0 2>/dev/null) || stop "There is no tag v* yet to compare with: name a revision."
        revision=$tag
    fi
    folder=$(mktemp -d /var/tmp/webots_cloud_abi.XXXXXX)
    trap clear_away EXIT
    git worktree add --detach --quiet "$folder/before" "$revision"
    build "$folder/before" "$folder/build_before"
    build "$PWD" "$folder/build_now"
    local before now
    before=$(soname "$folder/build_before") now=$(soname "$folder/build_now")
    abidiff --headers-dir1 "$folder/before/include" --headers-dir2 include \
        "$folder/build_before/src/libwebots_cloud.so" "$folder/build_now/src/libwebots_cloud.so" || status=$?
    # Bits of its exit status: 1 and 2 are errors, 4 a change, 8 one that breaks programs.
    ((status & 3)) && stop "abidiff failed."
    if ((status & 8)) && [[ $before == "$now" ]]; then
        echo "Programs that are linked to $now of $revision break: undo that, or raise the version." >&2
        exit 1
    fi
    ((status == 0)) && echo "The interface of $now is that of $revision."
    return 0
}

build()
{
    cmake -S "$1" -B "$2" -G Ninja -DCMAKE_BUILD_TYPE=None -DCMAKE_CXX_FLAGS='-O0 -g' -DWEBOTS_CLOUD_UNITY_BUILD=ON -DBUILD_SHARED_LIBS=ON \
        -DWEBOTS_CLOUD_BUILD_APPS=OFF -DWEBOTS_CLOUD_BUILD_TESTS=OFF -DWEBOTS_CLOUD_BUILD_EXAMPLES=OFF -DWEBOTS_CLOUD_INSTALL=OFF >/dev/null ||
        stop "$1 can't be configured."
    cmake --build "$2" --target webots_cloud_shared || stop "$1 does not build a shared library."
}

soname()
{
    objdump --private-headers "$1/src/libwebots_cloud.so" | awk '$1 == "SONAME" { print $2 }'
}

clear_away()
{
    git worktree remove --force "$folder/before" 2>/dev/null || true
    rm -rf "$folder"
}

stop()
{
    echo "$1" >&2
    exit 2
}

main "$@"

#!/usr/bin/env bash
# Installs what the tests need, builds, and runs the whole suite: the release, and then the same tests under the address and
# undefined behaviour sanitizers of g++ and of clang. Under 35 minutes on 2 cores from nothing.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")"
source cmake/packages/install.sh

# Sanitizers find nothing more in these, which take long.
without_sanitizers='^(packaging|browser|bench)$'

main()
{
    local presets=(release asan clang-asan) preset summary=() failed=
    case "$*" in
        '') ;;
        --quick) presets=(release) ;;
        *)
            echo "Usage: ./test.sh [--quick]    --quick: only the release" >&2
            exit 2
            ;;
    esac
    install_packages cmake/packages/build.txt cmake/packages/test.txt
    for preset in "${presets[@]}"; do
        SECONDS=0
        test_preset "$preset" || failed=yes
        summary+=("$(summarise "$preset" "$SECONDS")")
    done
    printf '\n--- all tests\n'
    printf '%s\n' "${summary[@]}"
    [[ -z $failed ]] || fail "The test suite failed."
}

test_preset()
{
    local preset=$1 selection=()
    [[ $preset == release ]] || selection=(-LE "$without_sanitizers")
    printf '\n--- %s\n' "$preset"
    rm -f "build/$preset/tests.log"
    cmake --preset "$preset" &&
        cmake --build --preset "$preset" &&
        ctest --preset "$preset" --parallel "$(nproc)" "${selection[@]}" --output-log "build/$preset/tests.log"
}

# One line for a preset; below it the tests that failed or were skipped, and why those were skipped.
summarise()
{
    local log=build/$1/tests.log outcome
    if [[ -e $log ]]; then
        outcome=$(sed -n 's/^\(.*\), \(.*\) out of \(.*\)$/\1 of \3/p' "$log")
    else
        outcome="did not build"
    fi
    printf '%-12s %s, %d min %02d s\n' "$1" "$outcome" $(($2 / 60)) $(($2 % 60))
    [[ ! -e $log ]] || sed -n -e 's/^[0-9]*: \(skipped: .*\)/             \1/p' \
        -e 's/^\t *[0-9]* - \(.*\) (\(.*\))$/             \2: \1/p' "$log"
}

main "$@"

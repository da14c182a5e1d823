#!/usr/bin/env bash
# Installs what the tests need, builds, and tests: the release, made by g++, with all tests but those with the label `extended`; then, under
# the address and undefined behaviour sanitizers of clang, the unit tests, the fuzzers, and the integration tests with the label
# `sanitized`. --all leaves nothing out.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")"
source cmake/packages/install.sh

# Sanitizers find nothing more in these, which take long: theory and simulation are statistics over millions of placements, whose
# code the scheduler's own tests run as well; walls is what sandboxes keep out; hygiene and documentation read texts.
without_sanitizers='^(packaging|browser|bench|theory|simulation|walls|hygiene|documentation)$'

usage="Usage: ./test.sh [--quick|--all|PRESET ...]

Installs what the tests need, builds, and tests: the release, then with the
sanitizers of clang what they may find something in.

  --quick   the release alone
  --all     also what takes long: tests with the label extended, and nearly all
            tests with the sanitizers
  PRESET    only these presets, with all their tests: release, clang-asan, dev,
            or asan, which are the sanitizers of g++; HACKING.md has them all"

main()
{
    local presets=(release clang-asan) preset summary=() failed=
    all=
    case "$*" in
        '') ;;
        --quick) presets=(release) ;;
        --all) all=yes ;;
        help | -h | --help)
            echo "$usage"
            exit
            ;;
        -*)
            echo "$usage" >&2
            exit 2
            ;;
        *) presets=("$@") && all=yes ;;
    esac
    for preset in "${presets[@]}"; do
        grep -qF "{\"name\": \"$preset\", \"configurePreset\"" CMakePresets.json || fail "There is no preset \"$preset\": ./test.sh help names them."
    done
    install_packages cmake/packages/build.txt cmake/packages/package.txt cmake/packages/test.txt cmake/packages/docs.txt
    install_node_packages src/web/view || echo "The tests of the 3D view and of CodeMirror will be skipped: npm could not install these libraries." >&2
    install_node_packages src/web/class || echo "The QR code of a class will not be tested: npm could not install its library." >&2
    install_node_packages tests/viewer || echo "The tests of pages that need Playwright will be skipped: npm could not install it." >&2
    install_node_packages docs/site || echo "The diagrams of the documentation will not be tested: npm could not install what draws them." >&2
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
    local preset=$1 log=build/$1/tests selection=() targets=() passed=yes
    case ${all:+all-}$preset in
        all-*asan) selection=(-LE "$without_sanitizers") ;;
        all-*) ;;
        *asan) selection=(-L '^(unit|fuzz|sanitized)$') && targets=(--target sanitized_tests) ;;
        *) selection=(-LE '^extended$') ;;
    esac
    printf '\n--- %s\n' "$preset"
    rm -f "$log.log" "$log.all.log" "$log.again.log"
    cmake --preset "$preset" && cmake --build --preset "$preset" "${targets[@]}" || return
    # Many tests wait for servers most of their time: three more than there are processors.
    ctest --preset "$preset" --parallel "$(($(nproc) + 3))" "${selection[@]}" --output-log "$log.log" || passed=
    cp "build/$preset/Testing/Temporary/LastTest.log" "$log.all.log" # with what those printed that did not fail
    [[ -z $passed ]] || return 0
    printf '\n--- %s: what failed, once more and one at a time\n' "$preset"
    ctest --preset "$preset" --rerun-failed --output-log "$log.again.log"
}

# One line for a preset; below it the tests that were skipped and why, those that failed, and what these printed when they ran alone.
# A test that passes alone fails beside others for a reason that wants to be found: it is named too.
summarise()
{
    local log=build/$1/tests outcome="did not build"
    [[ ! -e $log.log ]] || outcome=$(sed -n 's/^\(.*\), \(.*\) out of \(.*\)$/\1 of \3/p' "$log.log")
    printf '%-12s %s, %d min %02d s\n' "$1" "$outcome" $(($2 / 60)) $(($2 % 60))
    [[ ! -e $log.all.log ]] || awk '
        FNR == NR { if (/^[0-9]+\/[0-9]+ Test: /) name = $3; else if (sub(/^skipped: /, "")) reason[name] = ": " $0; next }
        /^\t *[0-9]+ - .* \(.*\)$/ { gsub(/[()]/, "", $4); print "             " $4 ": " $3 ($4 == "Skipped" ? reason[$3] : "") }' \
        "$log.all.log" "$log.log"
    if [[ -e $log.again.log ]]; then
        printf '             alone: '
        sed -n 's/^\(.*\), \(.*\) out of \(.*\)$/\1 of \3/p' "$log.again.log"
        grep -A40 -E '^(FAIL|ERROR): |error: in ' "$log.log" | cut -c1-300 | head -120 || true
    fi
}

main "$@"

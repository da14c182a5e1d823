#!/bin/bash
# run_page_test.sh SCRIPT [firefox [PATTERN]]: runs tests of pages, which need Node.js, Playwright and Chromium, or Firefox ESR; with PATTERN only
# those whose names it matches. Exit code 77: something that they need is missing.

skip()
{
    echo "skipped: $*"
    exit 77
}

[[ -z ${3-} ]] || grep -qE "^test\('[^']*($3)" "$1" || { echo "$1 has no test whose name matches $3" && exit 1; }
packages=$(dirname "${BASH_SOURCE[0]}")/../../build/node/tests/viewer/node_modules
command -v node >/dev/null || skip "there is no node (package nodejs)"
[[ -d $packages/playwright-core && -d $packages/axe-core ]] || skip "Playwright is missing: test.sh installs it with npm"
export WEBOTS_CLOUD_BROWSER=${2:-chromium}
program=/usr/bin/${WEBOTS_CLOUD_BROWSER/%firefox/firefox-esr}
[[ -x $program ]] || skip "$program is missing (package ${program##*/})"
/usr/bin/python3 -c 'import websockets' 2>/dev/null || skip "websockets is missing (package python3-websockets)"
if [[ $WEBOTS_CLOUD_BROWSER == firefox ]]; then # it draws with WebGL where there is an X server only
    command -v xvfb-run >/dev/null || skip "xvfb-run is missing (package xvfb)"
    version=$(HOME=/tmp "$program" --version 2>/dev/null | grep -oE '[0-9]+' | head -n 1)
    [[ ${version:-0} -gt 140 ]] || skip "Playwright drives no Firefox as old as ${version:-this}: install that of Debian's security updates"
    exec xvfb-run --auto-servernum node ${3:+"--test-name-pattern=$3"} "$1"
fi
exec node "$1"

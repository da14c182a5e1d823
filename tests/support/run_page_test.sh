#!/bin/bash
# run_page_test.sh SCRIPT [firefox]: runs tests of pages, which need Node.js, Playwright and Chromium, or Firefox ESR. Exit code 77: one of them is missing.

skip()
{
    echo "skipped: $*"
    exit 77
}

packages=$(dirname "${BASH_SOURCE[0]}")/../../build/node/tests/viewer/node_modules
command -v node >/dev/null || skip "there is no node (package nodejs)"
[[ -d $packages/playwright-core && -d $packages/axe-core ]] || skip "Playwright is missing: test.sh installs it with npm"
export WEBOTS_CLOUD_BROWSER=${2:-chromium}
program=/usr/bin/${WEBOTS_CLOUD_BROWSER/%firefox/firefox-esr}
[[ -x $program ]] || skip "$program is missing (package ${program##*/})"
/usr/bin/python3 -c 'import websockets' 2>/dev/null || skip "websockets is missing (package python3-websockets)"
if [[ $WEBOTS_CLOUD_BROWSER == firefox ]]; then # it draws with WebGL where there is an X server only
    command -v xvfb-run >/dev/null || skip "xvfb-run is missing (package xvfb)"
    exec xvfb-run --auto-servernum node "$1"
fi
exec node "$1"

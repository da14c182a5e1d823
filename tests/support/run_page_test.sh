#!/bin/bash
# run_page_test.sh SCRIPT: runs tests of pages, which need Node.js, Playwright and Chromium. Exit code 77: one of them is missing.

skip()
{
    echo "skipped: $*"
    exit 77
}

packages=$(dirname "${BASH_SOURCE[0]}")/../../build/node/tests/viewer/node_modules
command -v node >/dev/null || skip "there is no node (package nodejs)"
[[ -d $packages/playwright-core && -d $packages/axe-core ]] || skip "Playwright is missing: test.sh installs it with npm"
[[ -x /usr/bin/chromium ]] || skip "/usr/bin/chromium is missing (package chromium)"
/usr/bin/python3 -c 'import websockets' 2>/dev/null || skip "websockets is missing (package python3-websockets)"
exec node "$1"

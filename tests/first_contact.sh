#!/usr/bin/env bash
# README's first command where a newcomer types it, in a checkout where nothing may be built yet: ./server.sh start with the configurations that
# ship, the address that it prints in a browser, a simulation that moves, and ./server.sh stop, after which nothing is left. Needs ports
# 1998 to 2000. Installs the browser, which servers do not need, only after the start.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
source cmake/packages/install.sh

main()
{
    local said site website
    log=$(mktemp)
    trap 'rm -f "$log" && ./server.sh stop >/dev/null' EXIT # of the shell, where locals are gone
    step "./server.sh start"
    ./server.sh start 2>&1 | tee "$log"
    site=$(sed -n 's/^Open \(http.*\)$/\1/p' "$log")
    website=$(sed -n 's/^A website with an editor: \(http.*\)$/\1/p' "$log")
    [[ -n $site && -n $website ]] || fail "It did not print the addresses to open."

    step "In a browser: $site"
    install_packages cmake/packages/test.txt
    install_node_packages tests/viewer || fail "Playwright can't be installed."
    SITE=$site WEBSITE=$website tests/support/run_page_test.sh tests/viewer/first_contact.mjs || fail "The first contact failed."

    step "./server.sh stop"
    ./server.sh stop | tee "$log"
    [[ $(grep -c '^Stopped ' "$log") -eq 3 ]] || fail "It did not stop all three servers."
    ./server.sh status || said=$?
    [[ ${said-} -eq 3 ]] || fail "Servers are left."
}

step()
{
    printf '\n--- first contact: %s\n' "$1"
}

main

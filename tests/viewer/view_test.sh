#!/bin/bash
# view_test.sh SCRIPT: tests of modules of src/web/view that need no browser, but Node.js alone. Exit code 77: there is none.
command -v node >/dev/null || { echo "skipped: there is no node (package nodejs)"; exit 77; }
exec node "$(dirname "${BASH_SOURCE[0]}")/$1"

#!/bin/bash
# Tests the modules of src/web/view that hold a session, with Node.js alone. Exit code 77: there is none.
command -v node >/dev/null || { echo "skipped: there is no node (package nodejs)"; exit 77; }
exec node "$(dirname "${BASH_SOURCE[0]}")/session_test.mjs"

#!/usr/bin/env bash
# Builds the documentation as a site, to be opened from disk or put on any web server. Warnings are errors.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")"
source cmake/packages/install.sh

case "$*" in
    help | -*)
        echo "Usage: ./docs.sh [FOLDER]
Installs what is missing, and makes the documentation as a site in FOLDER, which
is build/site unless given. What is in FOLDER is removed."
        [[ $* == help || $* == -h || $* == --help ]] && exit 0 || exit 2
        ;;
esac

install_packages cmake/packages/docs.txt
install_node_packages docs/site || echo "Diagrams will be shown as the text that they are written in: npm could not install what draws them."
site=${1:-build/site}
rm -rf "$site"
mkdir -p "$site"
# From nothing, since Sphinx does not repeat the warnings of pages that it has read before.
sphinx-build -W --keep-going -q -E -j auto -d "$site/.pages" -c docs/site . "$site"
rm -rf "$site/.pages"
(cat docs/site/Doxyfile && printf 'OUTPUT_DIRECTORY = "%s"\n' "$site") | doxygen -
echo "The site is in $site/index.html"

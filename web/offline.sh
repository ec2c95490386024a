#!/bin/sh
# Run by trunk after a build: writes the service worker with the list of all files and their common hash.
set -eu
cd "$TRUNK_STAGING_DIR"
# Not without link-time optimisation: there, calls stand that return at once, and are inlined with it.
[ "$TRUNK_PROFILE" != release ] || [ "${CARGO_PROFILE_WEB_LTO:-}" = off ] || sh "$TRUNK_SOURCE_DIR/web/small.sh"
files=$(find . -type f ! -name sw.js ! -name '*.map' | LC_ALL=C sort)
version=$(echo "$files" | xargs sha256sum | sha256sum | cut -c1-16)
list=$(echo "$files" | sed 's|^\./||; s|^index\.html$|./|; s|.*|"&"|' | paste -sd, -)
policy=$(sed -n 's/.*http-equiv="Content-Security-Policy" content="\([^"]*\)".*/\1/p' index.html)
[ -n "$policy" ] || { echo "index.html has no Content-Security-Policy" >&2; exit 1; }
sed "s|@VERSION@|$version|; s|@FILES@|[$list]|; s|@POLICY@|$policy|" "$TRUNK_SOURCE_DIR/web/sw.js.in" > sw.js

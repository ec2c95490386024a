#!/bin/sh
# Run by web/offline.sh after a release build: what the page never needs is taken out of the program, and the rest made smaller.
set -eu
for wasm in *_bg.wasm; do
  # Outlines of PostScript fonts: those of the page are TrueType, and nobody can bring others.
  node "$TRUNK_SOURCE_DIR/web/snip.mjs" "$wasm" read_fonts::ps:: skrifa::outline::cff::
  wasm-opt -O1 -s 1 --reorder-functions-by-name --enable-bulk-memory --enable-nontrapping-float-to-int --enable-sign-ext \
    --enable-mutable-globals --enable-reference-types --enable-multivalue --enable-simd "$wasm" -o "$wasm"
done

#!/bin/sh
# Run by web/offline.sh after a release build: what the page never needs is taken out of the program, and the rest made smaller.
set -eu
# The page's fonts (assets/fonts) are TrueType outlines alone, and nobody can bring others: no PostScript outlines, no instructions,
# no variations, no tables that place or replace glyphs; a test in src/app/style.rs holds them to that.
fonts='read_fonts::ps:: skrifa::outline::cff:: skrifa::outline::glyf::hint:: skrifa::outline::autohint::shape::GsubHandler
  skrifa::outline::varc::Outlines::draw skrifa::outline::varc::compute
  read_fonts::tables::aat read_fonts::tables::ankr read_fonts::tables::avar read_fonts::tables::cvar read_fonts::tables::gpos
  read_fonts::tables::gsub read_fonts::tables::gvar read_fonts::tables::kern read_fonts::tables::kerx
  read_fonts::tables::layout::ClassDef read_fonts::tables::layout::Coverage read_fonts::tables::morx
  read_fonts::tables::mvar read_fonts::tables::varc read_fonts::tables::variations
  harfrust::hb::aat::layout harfrust::hb::kerning harfrust::hb::ot::contextual harfrust::hb::ot::gpos harfrust::hb::ot::gsub
  harfrust::hb::ot::lookup harfrust::hb::ot_layout_gsubgpos harfrust::hb::tag_table'
# Glyphs are filled paths of one colour.
glyphs='vello_common::encode vello_cpu::filter::drop_shadow vello_cpu::filter::gaussian_blur vello_cpu::filter::shift
  vello_cpu::fine::common::gradient vello_cpu::fine::common::image vello_cpu::fine::highp Dispatcher>::stroke_path
  kurbo::offset kurbo::stroke'
# Marks an impossible sequence of vowels with a dotted circle, which the fonts do not have either.
vowels=preprocess_text_vowel_constraints
for wasm in *_bg.wasm; do
  # shellcheck disable=SC2086 # Each word is a pattern.
  node "$TRUNK_SOURCE_DIR/web/snip.mjs" "$wasm" $fonts $glyphs --return $vowels
  wasm-opt -O1 -s 1 --duplicate-function-elimination --reorder-functions-by-name --enable-bulk-memory \
    --enable-nontrapping-float-to-int --enable-sign-ext --enable-mutable-globals --enable-reference-types --enable-multivalue \
    --enable-simd "$wasm" -o "$wasm"
done

#!/usr/bin/env bash
# Sets up everything that the browser build and its tests need and that is missing: a Rust compiler for wasm32-unknown-unknown,
# wasm-bindgen, wasm-opt, trunk, playwright-core and Chromium. Idempotent: what is there and right is left alone.
#   web/tools/setup.sh [APPDIR]      APPDIR's Cargo.lock says which wasm-bindgen is needed (.)
# Afterwards `source ~/.local/wasm-tools/env` puts all of it on PATH.
# Where rustup can add the target its own compiler is used; elsewhere Debian's, whose standard library for WebAssembly is built here.
# Env: WASM_TOOLS (default ~/.local/wasm-tools), WITH_TRUNK=0 to skip trunk, WITH_BROWSER=0 to skip Chromium.
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
app=${1:-.}
tools=${WASM_TOOLS:-$HOME/.local/wasm-tools}
target=wasm32-unknown-unknown
name=web196                      # the name of the linked rustup toolchain
TRUNK_VERSION=0.21.14            # 0.22 wants a newer compiler
BINARYEN_VERSION=132.0.0
PLAYWRIGHT_VERSION=1.64.1
mkdir -p "$tools/bin"
step() { printf '== [%(%T)T] %s\n' -1 "$*"; }
export DEBIAN_FRONTEND=noninteractive

# Debian packages that are not there yet.
packages() {
  local missing=() p
  for p in "$@"; do dpkg -s "$p" 2>/dev/null | grep -q '^Status: install ok' || missing+=("$p"); done
  [ ${#missing[@]} -gt 0 ] || return 0
  [ "$(id -u)" = 0 ] || { echo "Missing: run 'sudo apt-get install ${missing[*]}', then this again." >&2; exit 1; }
  apt-get update -qq
  apt-get install -y -qq --no-install-recommends "${missing[@]}" >"$tools/apt.log" 2>&1 || { tail -20 "$tools/apt.log"; exit 1; }
}

step "1. Node and Chromium"
command -v npm >/dev/null || packages nodejs npm
if [ "${WITH_BROWSER:-1}" != 0 ]; then
  [ -n "${CHROMIUM:-}" ] || packages chromium fonts-dejavu-core
fi

printf 'export PATH=%q:$PATH\n' "$tools/bin" >"$tools/env"
if rustup target list --installed 2>/dev/null | grep -qx $target || rustup target add $target >/dev/null 2>&1; then
  step "2-4. rustup has $target"
else
step "2. Debian's compiler, with its linker"
packages rustc-web cargo-web rust-web-src
rustc=/usr/bin/rustc; cargo=/usr/bin/cargo
ver=$($rustc -vV)
llvm=$(sed -n 's/^LLVM version: \([0-9]*\).*/\1/p' <<<"$ver")
[ -x /usr/bin/lld-"$llvm" ] || packages "lld-$llvm"
host=$(sed -n 's/^host: //p' <<<"$ver")
libdir=$($rustc --print sysroot)/lib/rustlib
mkdir -p "$libdir/$host/bin"
ln -sfn /usr/bin/lld-"$llvm" "$libdir/$host/bin/rust-lld"

step "3. std for $target, from Debian's rust-web-src (all of the sysroot crates, as rustup's rust-std has them)"
stamp=$libdir/$target/.built-by
if [ "$(cat "$stamp" 2>/dev/null)" != "$ver" ]; then
  # The std's crate hashes follow the path it is built in, and crates already compiled against another
  # std then fail to load: so a fixed path, and never replace a std under a build that is using it.
  if [ -d "$libdir/$target/lib" ] && pgrep -f "/toolchains/$name/bin/(cargo|rustc) " >/dev/null; then
    echo "a build is using toolchain $name: not replacing its std; run again when it has ended"; exit 1
  fi
  w=/var/tmp/wasm-std-build; rm -rf "$w"; mkdir -p "$w"
  cp -rL "$libdir/src/rust/library" "$w/library"
  (cd "$w/library" && RUSTC=$rustc RUSTC_BOOTSTRAP=1 \
    CARGO_TARGET_WASM32_UNKNOWN_UNKNOWN_RUSTFLAGS="-Zforce-unstable-if-unmarked --remap-path-prefix=$w/library=/rustc/library" \
    $cargo build -q --locked -p sysroot --profile dist --features panic-unwind,backtrace \
      --target $target --target-dir "$w/target")
  [ ! -d "$libdir/$target/lib" ] || echo "NOTE: std replaced; delete every project's target/$target directory"
  rm -rf "${libdir:?}/$target"; mkdir -p "$libdir/$target/lib"
  cp "$w/target/$target/dist/deps/"*.rlib "$libdir/$target/lib/"
  printf '%s\n' "$ver" >"$stamp"
  rm -rf "$w"
fi

step "4. rustup toolchain '$name'"
if command -v rustup >/dev/null; then
  [ "$(rustup run $name rustc -vV 2>/dev/null)" = "$ver" ] || rustup toolchain link $name /usr
  printf 'export RUSTUP_TOOLCHAIN=%q\n' "$name" >>"$tools/env"
else
  printf 'export PATH=/usr/bin:$PATH\n' >>"$tools/env"
fi
fi

step "5. wasm-bindgen, the version in $app/Cargo.lock"
want=$(awk '/^name = "wasm-bindgen"$/{getline; gsub(/[^0-9.]/,""); print; exit}' "$app/Cargo.lock")
if [ "$("$tools/bin/wasm-bindgen" --version 2>/dev/null)" != "wasm-bindgen $want" ]; then
  grep -q "^version = \"$want\"" "$here/wasm-bindgen-cli/Cargo.toml" || { echo "wasm-bindgen-cli is not at $want: set its two versions and cargo update"; exit 1; }
  (cd "$here/wasm-bindgen-cli" && cargo build -q --release --locked --target-dir "$tools/build")
  install -m755 "$tools/build/release/wasm-bindgen" "$tools/bin/wasm-bindgen"
fi

step "6. wasm-opt and playwright-core from npm"
if [ "$("$tools/bin/wasm-opt" --version 2>/dev/null)" != "wasm-opt version ${BINARYEN_VERSION%%.*} (version_${BINARYEN_VERSION%%.*})" ] \
   || [ ! -d "$tools/node_modules/playwright-core" ]; then
  (cd "$tools" && { [ -f package.json ] || echo '{"private":true}' >package.json; } \
    && npm install --no-audit --no-fund --save-exact "binaryen@$BINARYEN_VERSION" "playwright-core@$PLAYWRIGHT_VERSION" >npm.log 2>&1) \
    || { tail "$tools/npm.log"; exit 1; }
  ln -sfn ../node_modules/.bin/wasm-opt "$tools/bin/wasm-opt"
fi

if [ "${WITH_TRUNK:-1}" != 0 ]; then
  step "7. trunk $TRUNK_VERSION"
  if [ "$("$tools/bin/trunk" --version 2>/dev/null)" != "trunk $TRUNK_VERSION" ]; then
    CARGO_PROFILE_RELEASE_LTO=off CARGO_PROFILE_RELEASE_CODEGEN_UNITS=16 CARGO_PROFILE_RELEASE_OPT_LEVEL=1 \
      cargo install -q --locked trunk --version "$TRUNK_VERSION" --root "$tools" --target-dir "$tools/build-trunk" --no-track --force
    rm -rf "$tools/build-trunk"
  fi
fi
step "done"

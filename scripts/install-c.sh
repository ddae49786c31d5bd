#!/usr/bin/env bash
# Builds the library for C and installs it: scripts/install-c.sh PREFIX. There, headers are in include/, libraries in lib/, and what CMake and
# pkg-config look for beside them.
set -euo pipefail
prefix=$(mkdir -p "$1" && cd "$1" && pwd)
cd "$(dirname "$0")/.."
cargo build --release --locked -q -p enfilade-capi
version=$(cargo pkgid -p enfilade-capi | sed 's/.*[@#]//')
built=${CARGO_TARGET_DIR:-target}/release
mkdir -p "$prefix"/{include,lib/pkgconfig,lib/cmake/enfilade}
cp crates/capi/include/enfilade.{h,hpp} "$prefix/include"
cp crates/capi/install/enfiladeConfig.cmake "$prefix/lib/cmake/enfilade"
sed "s/@version@/$version/" crates/capi/install/enfilade.pc >"$prefix/lib/pkgconfig/enfilade.pc"
for library in "$built"/libenfilade.{a,so,dylib} "$built"/enfilade.{dll,lib}; do
  [ ! -e "$library" ] || cp "$library" "$prefix/lib"
done

#!/usr/bin/env bash
# Installs the library for C, and has the programs of crates/capi say of a building what Rust says: in C (static and shared), C++ and Python,
# found by pkg-config and CMake, under AddressSanitizer and valgrind; counts allocations of frames; holds the static library to its size.
set -euo pipefail
cd "$(dirname "$0")/.."
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
most_bytes=1500000
programs=crates/capi/programs
bash scripts/install-c.sh "$work/prefix"
export PKG_CONFIG_PATH=$work/prefix/lib/pkgconfig
warnings=(-Wall -Wextra -Werror -pedantic -O2 -g)
static=("-I$work/prefix/include" "$work/prefix/lib/libenfilade.a" -lpthread -ldl -lm)
read -ra shared <<<"$(pkg-config --cflags --libs enfilade) -Wl,-rpath,$work/prefix/lib"
c() { cc -std=c11 "${warnings[@]}" "$programs/$1.c" -o "$work/$2" "${@:3}"; }

# An office of a few rooms.
enfilade=${ENFILADE:-target/release/enfilade}
[ -x "$enfilade" ] || { cargo build --release --locked -q -p enfilade-cli && enfilade=${CARGO_TARGET_DIR:-target}/release/enfilade; }
"$enfilade" generate office --rooms 24 -o "$work/office.glb" >/dev/null
"$enfilade" bake "$work/office.glb" -o "$work/office.pvs" --rays 200k >/dev/null
cargo build --release --locked -q -p enfilade-capi --example walk
"${CARGO_TARGET_DIR:-target}/release/examples/walk" "$work/office.pvs" >"$work/rust.txt"
same() {
  diff "$work/rust.txt" - >/dev/null || { echo "$1 says something else than Rust" >&2; exit 1; }
  echo "$1: as Rust"
}

c walk static "${static[@]}" -Wl,--gc-sections
"$work/static" "$work/office.pvs" | same "C, static"
c walk shared "${shared[@]}"
"$work/shared" "$work/office.pvs" | same "C, shared"
c++ -std=c++17 "${warnings[@]}" "$programs/walk.cpp" -o "$work/cpp" "${shared[@]}"
"$work/cpp" "$work/office.pvs" | same "C++"
python3 "$programs/walk.py" "$(ls "$work"/prefix/lib/libenfilade.{so,dylib} 2>/dev/null)" "$work/office.pvs" | same Python
if command -v cmake >/dev/null; then
  printf '%s\n' 'cmake_minimum_required(VERSION 3.10)' 'project(walk C)' 'find_package(enfilade REQUIRED)' \
    "foreach(kind enfilade static)" "add_executable(walk_\${kind} \"$PWD/$programs/walk.c\")" \
    'target_link_libraries(walk_${kind} enfilade::${kind})' 'endforeach()' >"$work/CMakeLists.txt"
  cmake -S "$work" -B "$work/build" -DCMAKE_PREFIX_PATH="$work/prefix" >/dev/null
  cmake --build "$work/build" >/dev/null
  for kind in enfilade static; do "$work/build/walk_$kind" "$work/office.pvs" | same "CMake, $kind"; done
else
  echo "not tried: CMake"
fi

c abuse abuse "${static[@]}"
"$work/abuse" "$work/office.pvs"
c abuse sanitized -fsanitize=address,undefined "${static[@]}"
"$work/sanitized" "$work/office.pvs" >/dev/null
echo "AddressSanitizer: nothing"
if command -v valgrind >/dev/null; then
  # The handle of a thread stays with it.
  valgrind -q --error-exitcode=1 --leak-check=full --show-leak-kinds=definite --errors-for-leak-kinds=definite "$work/abuse" "$work/office.pvs" >/dev/null
  echo "valgrind: nothing"
else
  echo "not tried: valgrind"
fi
wrapped=(-Wl,--wrap=malloc,--wrap=calloc,--wrap=realloc,--wrap=posix_memalign)
c allocations allocations "${static[@]}" "${wrapped[@]}"
"$work/allocations" "$work/office.pvs"

# The program of the guide, as written there.
sed -n '/^```c$/,/^```$/p' crates/capi/README.md | sed '/^```/d' >"$work/guide.c"
cc -std=c11 "${warnings[@]}" "$work/guide.c" -o "$work/guide" "${shared[@]}"
"$work/guide" "$work/office.pvs"
strip "$work/static"
bytes=$(stat -c %s "$work/static")
echo "a C program with the library: $bytes bytes"
[ "$bytes" -le "$most_bytes" ] || { echo "that is more than $most_bytes" >&2; exit 1; }

#!/usr/bin/env bash
# Builds the library alone and the program with each feature, and prints crates and processor seconds. The run time alone is built into an empty
# folder, and held to 6 crates: a game that takes it must not grow. What `just clippy` and `just features` lint isn't built again; FRESH=1
# builds all into empty folders.
set -euo pipefail
cd "$(dirname "$0")/.."
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
most_crates=6
TIMEFORMAT='%U %S'

# Of `cargo COMMAND ...`, processor seconds.
seconds() {
  { time cargo "$@" --locked -q 1>&2; } 2>&1 | tee /dev/stderr | awk 'END { print $1 + $2 }'
}

# NAME CRATE FEATURES
while read -r name crate features; do
  flags=(-p "$crate" --no-default-features)
  [ "$features" = none ] || flags+=(--features "$features")
  crates=$(cargo tree --locked -e normal,build --prefix none "${flags[@]}" | sed 's/ (.*//' | sort -u | wc -l)
  case $name:${FRESH:-} in
    builder: | full:) spent="0 (linted elsewhere)" ;;
    run-time:* | *:1) spent=$(seconds build --release --target-dir "$folder/$name" "${flags[@]}" 2>/dev/null) ;;
    *) spent="$(seconds check "${flags[@]}" 2>/dev/null) (checked only)" ;;
  esac
  [[ $spent =~ ^[0-9] ]] || { echo "$name does not build alone" >&2; exit 1; }
  echo "$name: $crates crates, $spent processor seconds"
  if [ "$name" = run-time ] && [ "$crates" -gt "$most_crates" ]; then
    echo "the run time alone takes more than $most_crates crates" >&2
    exit 1
  fi
done <<'LIST'
run-time enfilade none
simd enfilade simd
gpu enfilade gpu
builder enfilade bake
program enfilade-cli none
draco enfilade-cli draco
meshopt enfilade-cli meshopt
ifc enfilade-cli ifc
full enfilade-cli full
LIST

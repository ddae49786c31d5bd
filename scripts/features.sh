#!/usr/bin/env bash
# Builds the library with each feature alone, and prints crates and processor seconds. The run time alone is built into an empty folder, and held
# to 20 crates: a game that takes it must not grow. Of the other features, those that `just clippy` and `just features` don't lint are checked, on
# top of what is built already; FRESH=1 builds all into empty folders.
set -euo pipefail
cd "$(dirname "$0")/.."
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
most_crates=20
TIMEFORMAT='%U %S'

# Of `cargo COMMAND ...`, processor seconds.
seconds() {
  { time cargo "$@" --locked --lib -q 1>&2; } 2>&1 | tee /dev/stderr | awk 'END { print $1 + $2 }'
}

for features in none simd gpu bake cli draco ifc meshopt quake full; do
  flags=(--no-default-features)
  [ "$features" = none ] || flags+=(--features "$features")
  crates=$(cargo tree --locked -e normal,build --prefix none -p enfilade "${flags[@]}" | sed 's/ (.*//' | sort -u | wc -l)
  case $features:${FRESH:-} in
    bake: | cli: | full:) spent="0 (linted elsewhere)" ;;
    none:* | *:1) spent=$(seconds build --release --target-dir "$folder/$features" "${flags[@]}" 2>/dev/null) ;;
    *) spent="$(seconds check "${flags[@]}" 2>/dev/null) (checked only)" ;;
  esac
  [[ $spent =~ ^[0-9] ]] || { echo "$features does not build alone" >&2; exit 1; }
  echo "$features: $crates crates, $spent processor seconds"
  if [ "$features" = none ] && [ "$crates" -gt "$most_crates" ]; then
    echo "the run time alone takes more than $most_crates crates" >&2
    exit 1
  fi
done

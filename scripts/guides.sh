#!/usr/bin/env bash
# Runs the commands of the three guides as written there: each of their ```sh blocks, in order, with the release build.
set -euo pipefail
cd "$(dirname "$0")/.."
cargo build --release
# The guides name the binary where cargo puts it unless told otherwise.
built=${CARGO_TARGET_DIR:-target}
[ "$built" = target ] || { mkdir -p target/release && ln -sf "$(realpath "$built")/release/enfilade" target/release/enfilade; }
for guide in docs/guide-*.md; do
  echo "+ $guide"
  awk '/^```sh/{on=1;next} /^```/{on=0} on' "$guide" | bash -euo pipefail >/dev/null
done

#!/usr/bin/env bash
# Runs the README's commands as written there: every line of its ```sh blocks, the tests among them. CI has no display, so the viewer draws a
# picture in place of its window; a software driver is enough for that.
set -euo pipefail
cd "$(dirname "$0")/.."
mkdir -p out
awk '/^```sh/{on=1;next} /^```/{on=0} on' README.md | while IFS= read -r line; do
  case $line in *" -p enfilade-viewer "*) line="$line --shot out/viewer.png" ;; esac
  echo "+ $line"
  bash -euo pipefail -c "$line" </dev/null
done
test -s out/viewer.png && test -s out/villa.pvs && ls out/villa/*.png >/dev/null && grep -q '"summary"' out/villa.jsonl

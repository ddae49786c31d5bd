#!/usr/bin/env bash
# Runs the README's commands as written there: every line of its ```sh blocks, the tests among them.
set -euo pipefail
cd "$(dirname "$0")/.."
awk '/^```sh/{on=1;next} /^```/{on=0} on' README.md | while IFS= read -r line; do
  echo "+ $line"
  bash -euo pipefail -c "$line" </dev/null
done
test -s out/villa.pvs && ls out/villa/*.png >/dev/null && grep -q '"summary"' out/villa.jsonl

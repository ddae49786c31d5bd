#!/bin/sh
# The moving picture of the viewer, for README.md and docs/viewer.md: `sh scripts/viewer-walk.sh`. Needs a device or a software driver.
# The path that it goes along is left in out/pictures/viewer_walk.path.json.
set -eu
cd "$(dirname "$0")/.."
mkdir -p out/pictures
# A copy: the file that is baked lies beside its model.
cp -n data/buildings/office.glb out/pictures/ 2>/dev/null || true
cargo run --release -p enfilade-viewer --example walk -- out/pictures/office.glb \
  docs/pictures/viewer_walk.gif out/pictures/viewer_walk.path.json

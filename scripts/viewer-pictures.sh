#!/bin/sh
# The picture of a scene as the viewer draws it, for README.md and docs/viewer.md: `sh scripts/viewer-pictures.sh`, after
# `cargo build --release -p enfilade-viewer`. Needs a device or a software driver.
set -eu
cd "$(dirname "$0")/.."
mkdir -p out/pictures
viewer() {
  model=$1 picture=$2
  shift 2
  # A copy: the file that is baked lies beside its model.
  cp -n "data/buildings/$model.glb" out/pictures/ 2>/dev/null || true
  target/release/enfilade-viewer "out/pictures/$model.glb" --size 960x540 --shot "docs/pictures/$picture.png" "$@"
}
viewer villa_rotonda viewer_full --path data/buildings/villa_rotonda.path.json --frame 60 --mode both

#!/bin/sh
# The pictures of the viewer, for README.md and docs/viewer.md: `sh scripts/viewer-pictures.sh`, after
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
viewer office viewer_portals --path data/buildings/office.path.json --frame 40 --mode portals --show portals,rectangles,plan
viewer office viewer_matrix --path data/buildings/office.path.json --frame 40 --mode both --show cells,matrix,graphs
# A view from outside of what a frame in the office draws.
cat > out/pictures/outside.path.json <<'END'
{"name": "outside", "fov_y_degrees": 50, "near": 0.01, "frames": [
  {"eye": [1.875, 1.6, 6.3], "target": [4.375, 1.6, 6.3]},
  {"eye": [-25.8, 30.9, 36.2], "target": [2.2, 4.9, 6.2]}]}
END
outside() {
  viewer office "$1" --path out/pictures/outside.path.json --frame 1 --freeze 0 --mode both --show "$2" --detail "$3"
}
outside viewer_frozen graphs full
outside viewer_split waste,split plain

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
# A room whose windows show hills that were made for it.
awk '
  function step(a) { a = a < 0 ? 0 : a > 1 ? 1 : a; return a * a * (3 - 2 * a) }
  BEGIN {
    print "ncols 601\nnrows 601\nxllcorner 0\nyllcorner 0\ncellsize 10"
    for (r = 0; r < 601; r++) for (c = 0; c < 601; c++) {
      x = 10 * (c - 300); z = 10 * (r - 300); d = sqrt(x * x + z * z)
      m = 0; size = 1; f = 1 / 700
      for (o = 1; o <= 6; o++) {
        u = x * cos(1.7 * o) + z * sin(1.7 * o); v = z * cos(1.7 * o) - x * sin(1.7 * o)
        s = sin(u * f + 1.3 * sin(0.7 * v * f + o)); m += size * (1 - (s < 0 ? -s : s))
        size /= 2; f *= 2.03
      }
      h = 40 + step((d - 50) / 250) * 5 * sin(x / 90) * cos(z / 70) + step((d - 200) / 2600) * 330 * m
      printf "%.2f%s", h, c < 600 ? " " : "\n"
    }
  }' > out/pictures/hills.asc
cargo run --release --quiet -- ground out/pictures/hills.asc -o out/pictures/hills.ground
cat > out/pictures/windows.path.json <<'END'
{"name": "windows", "fov_y_degrees": 62, "near": 0.01, "frames": [
  {"eye": [-8.0, 4.7, 7.7], "target": [-12, 4.6, 10.5]},
  {"eye": [-60, 14, 50], "target": [0, 7, -4]}]}
END
window() {
  viewer villa_rotonda "$1" --ground out/pictures/hills.ground --path out/pictures/windows.path.json --frame "$2" --mode both --detail smooth
}
window ground 0
window ground_outside 1
cargo run --release --quiet -- generate pipes --sections 640000 -o out/pictures/pipes.glb
cargo run --release --quiet -- bake out/pictures/pipes.glb --rays 100k -o out/pictures/pipes.pvs
target/release/enfilade-viewer out/pictures/pipes.pvs --frame 5 --show tubes --size 960x540 \
  --shot docs/pictures/tubes.png
outside viewer_frozen graphs full
outside viewer_split waste,split plain

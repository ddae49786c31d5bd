#!/usr/bin/env bash
# The commands of docs/results.md that take at most ten minutes each, on the models and levels of $ENFILADE_DATA: all, or those of
# the named questions (`bash scripts/results.sh bounds doors`). Builds once, then writes a file a question to out/results. It leaves
# out models that are not there, names commands that failed, and then exits with 1. The questions `cubes` and `viewer` need a Vulkan
# driver, and `cubes` also libembree-dev and g++.
set -euo pipefail
cd "$(dirname "$0")/.."
data=${ENFILADE_DATA:-../shared/data}
out=out/results
questions=" $* "
mkdir -p "$out/files"
cargo build --release --features full
enfilade=$PWD/target/release/enfilade

buildings=(duplex/Duplex_A_20110907.ifc kit-apache/AC11-FZK-Haus.ifc webifc-mpl/AC20-FZK-Haus.ifc kit-apache/AC11-Smiley-West.ifc
  webifc-mpl/Office_A_20110811.ifc bimwhale-mit/LargeBuilding.ifc bimwhale-mit/TallBuilding.ifc)
models=("$data"/duplex/Duplex_A_20110907.ifc "$data"/kit-apache/AC11-FZK-Haus.ifc "$data"/webifc-mpl/Office_A_20110811.ifc
  "$data"/godot-demos/zdm2.glb "$data"/game-maps-obj/pandora.obj data/buildings/villa_rotonda.glb data/buildings/office.glb
  data/buildings/gallery100.glb)
own=(villa_rotonda office gallery100)
levels=(lqdm12 id_dm4 lq_e0m1 lqdm13 id_e1m3 lq_e0m3 lq_e0m2)
failed=()

# Whether a question is to be answered.
asked() { [[ $questions == "  " || $questions == *" $1 "* ]]; }

# Runs a command for at most ten minutes and adds its name and its output to the file of a question: run QUESTION COMMAND...
run() {
  local question=$1
  shift
  asked "$question" || return 0
  echo "$question: $*" >&2
  echo "+ $*" >>"$out/$question.txt"
  timeout 600 "$@" >>"$out/$question.txt" 2>>"$out/$question.log" || failed+=("$question: $*")
}

# The name of a file without folder and extension.
name() { basename "${1%.*}"; }

# Whether a file is there.
has() { [ -e "$1" ] || { echo "left out: $1" >&2 && return 1; }; }

# Runs cargo in an empty folder, or in the folder that stands in $folder, and adds the seconds that it took.
build() {
  asked builds || return 0
  echo "builds: cargo $*" >&2
  local fresh
  fresh=$(mktemp -d)
  TIMEFORMAT="cargo $*: %U s user, %S s system, %R s"
  { time CARGO_TARGET_DIR=${folder:-$fresh} cargo "$@" >>"$out/builds.log" 2>&1; } 2>>"$out/builds.txt" || failed+=("builds: $*")
  rm -rf "$fresh"
}

for file in "$out"/*.txt "$out"/*.log; do
  question=$(basename "${file%.*}")
  ! asked "$question" || rm -f "$file"
done

cargo fetch --locked
build build --release
build build --release --features full
build build --release -p enfilade --lib --no-default-features
tests=$(mktemp -d)
folder=$tests build test --no-run
folder=$tests build test
rm -rf "$tests"

for model in "${models[@]}"; do
  has "$model" || continue
  run bounds "$enfilade" bake "$model" --keep-bounds --json -o "$out/files/$(name "$model").pvs"
done

if has "$data/godot-demos/zdm2.glb"; then
  run sampling "$enfilade" report "$data/godot-demos/zdm2.glb" --views 1000 --rays 6M --json -o "$out/files/zdm2.html"
fi
if has "$data/webifc-mpl/Office_A_20110811.ifc"; then
  run sampling "$enfilade" report "$data/webifc-mpl/Office_A_20110811.ifc" --views 1000 --rays 20M --json -o "$out/files/Office_A.html"
fi
furnished=$out/files/office-1000
"$enfilade" generate office --rooms 1000 --furnished --facts -o "$furnished.glb"
run sampling "$enfilade" report "$furnished.glb" --views 1000 --rays 15M --json -o "$furnished.html"

run confidence cargo test --release --features full --test suite -- --ignored unseen::

for building in "${buildings[@]}"; do
  model=$data/$building rooms=$data/${building%.ifc}.rooms.json file=$out/files/$(name "$building").plan.pvs
  has "$model" || continue
  run rooms "$enfilade" bake "$model" --cells plan --rays 0 -o "$file" --json
  run rooms "$enfilade" check "$file" --model "$model" --rooms "$rooms" --rays 0 --views 0 --json
  run sealed "$enfilade" check "$file" --model "$model" --rays 1M --views 0 --json
done

# Models that nobody made for this project, by the strategy that `auto` takes and by the others.
"$enfilade" generate plant --size 125 -o "$out/files/messy-plant.glb"
"$enfilade" generate city --dense -o "$out/files/messy-city.glb"
for model in "$data"/godot-demos/zdm2.glb "$data"/game-maps-obj/pandora.obj "$data"/classics/{sponza,dungeon,nav_test}.obj \
  "$out"/files/messy-{plant,city}.glb; do
  has "$model" || continue
  for cells in auto plan; do
    case $(name "$model")-$cells in messy-city-plan) continue ;; esac
    file=$out/files/$(name "$model").$cells.pvs
    run messy "$enfilade" bake "$model" --tubes never --rays 5M --cells "$cells" -o "$file" --json
    run messy "$enfilade" walk "$file" --model "$model" --mode all --verify-pixels --every 4 --size 480x270 --json
  done
done

for building in "${own[@]}"; do
  model=data/buildings/$building file=$out/files/$building.5M.pvs
  run modes "$enfilade" bake "$model.glb" --rays 5M -o "$file" --json
  run modes "$enfilade" walk "$file" --model "$model.glb" --path "$model.path.json" --mode all --verify-pixels \
    --every 4 --size 320x180 --json
done
for building in "${own[@]/#/data/buildings/}" "$data"/duplex/Duplex_A_20110907 "$data"/webifc-mpl/Office_A_20110811; do
  model=$building.glb file=$out/files/$(basename "$building").doors.pvs
  [ -e "$model" ] || model=$building.ifc
  has "$model" || continue
  run doors "$enfilade" bake "$model" --rays 5M -o "$file" --json
  run doors "$enfilade" walk "$file" --model "$model" --random 10000 --size 160x90 --doors as-found --mode portals --mode both \
    --verify-pixels --json
done

run frames cargo bench --bench frames
run frames "$enfilade" bake "$furnished.glb" --rays 5M -o "$furnished.pvs" --json
run frames cargo bench --bench frames -- "$PWD/$furnished.pvs" "$PWD/$furnished.glb" "$PWD/$furnished.path.json"
run outdoors cargo bench -p enfilade-studies --bench tables
run cubes cargo bench --bench cubes -- --quick
run difficult cargo test --release --features full --test suite -- extremes::error_against_run_time --include-ignored --nocapture

for level in "${levels[@]}"; do
  prt=$data/prt/$level.prt theirs=$out/files/$level.txt rows=$out/files/$level.rows state=$out/files/$level.state
  has "$prt" || continue
  gzip -dc "$data/prt/$level.vis.txt.gz" >"$theirs"
  run levels "$enfilade" vis "$prt" --against "$theirs" --rows "$rows" --state "$state" --threads 1 --json
  run lines "$enfilade" check "$prt" --rows "$rows" --rays 2M --json
  run closing "$enfilade" report "$prt" --rows "$theirs" --threads 1 -o "$out/files/$level.html" --json
done

# The same with three decimals, and copies of the largest side by side.
for level in "${levels[@]}"; do
  prt=$data/prt/$level.prt
  has "$prt" || continue
  bash scripts/prt-copies.sh "$prt" 1 3 >"$out/files/$level.3.prt"
  run rounded "$enfilade" vis "$out/files/$level.3.prt" --rows "$out/files/$level.3.rows" --json
done
for copies in 1 2 8 49; do
  has "$data/prt/lq_e0m2.prt" || continue
  bash scripts/prt-copies.sh "$data/prt/lq_e0m2.prt" "$copies" >"$out/files/copies.$copies.prt"
  run copies "$enfilade" vis "$out/files/copies.$copies.prt" --rows "$out/files/copies.$copies.rows" --json
done

for level in dm4 e1m1 e1m3 e2m2 start; do
  bsp=$data/quake-id-gpl/$level.bsp
  has "$bsp" || continue
  run quake "$enfilade" vis "$bsp" --against "$bsp" -o "$out/files/$level.bsp" --state "$out/files/$level.state" --json
done

# Faces of the same levels as meshes, without their portals: rows against exact ones, and walks within the level.
run truth cargo bench -p enfilade-levels --features quake --bench truth
run truth cargo bench -p enfilade-levels --features quake --bench truth -- --write "$PWD/$out/files"
for level in dm4 e1m1 e1m3 e2m2 start; do
  mesh=$out/files/$level
  has "$data/quake-id-gpl/$level.bsp" || continue
  run truth "$enfilade" bake "$mesh.obj" --rays 5M -o "$mesh.pvs" --json
  run truth "$enfilade" walk "$mesh.pvs" --model "$mesh.obj" --path "$mesh.path.json" --mode all --verify-pixels \
    --size 480x270 --json
done

run viewer cargo build --release -p enfilade-viewer --features ifc,quake
viewed=("$furnished")
# Nothing of a city can be closed: one open cell, whose objects are found by queries.
echo '{ "cells": [{ "id": 0, "open": true, "pieces": [{ "planes": [[0, -1, 0, 1000]] }] }], "portals": [] }' >"$out/files/open.json"
for kind in dense sparse; do
  viewed+=("$out/files/city-$kind")
  run viewer "$enfilade" generate city "--$kind" --facts -o "$out/files/city-$kind.glb"
  run viewer "$enfilade" bake "$out/files/city-$kind.glb" --cells-file "$out/files/open.json" --rays 0 -o "$out/files/city-$kind.pvs"
done
if has "$data/webifc-mpl/Office_A_20110811.ifc"; then
  run viewer "$enfilade" bake "$data/webifc-mpl/Office_A_20110811.ifc" -o "$out/files/Office_A.pvs" --json
  run viewer target/release/enfilade-viewer "$out/files/Office_A.pvs" --model "$data/webifc-mpl/Office_A_20110811.ifc" --bench
fi
for model in "${viewed[@]}"; do
  [ -e "$model.pvs" ] || run viewer "$enfilade" bake "$model.glb" --rays 5M -o "$model.pvs" --json
  run viewer target/release/enfilade-viewer "$model.pvs" --model "$model.glb" --path "$model.path.json" --bench
done

if [ ${#failed[@]} -gt 0 ]; then
  printf 'failed: %s\n' "${failed[@]}" >&2
  exit 1
fi

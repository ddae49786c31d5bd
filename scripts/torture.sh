#!/usr/bin/env bash
# The long tests, on the real buildings and levels of $ENFILADE_DATA: bake, ten million rays, every pixel of
# a walk through every cell and of ten thousand random views in each mode. Prints one line of JSON a model and leaves everything in out/torture.
# Then what is hostile: a million mutants of `.pvs` files and many of every other format, fifty kills of a bake and fifty of workers who share one, extreme scenes of up to 100,000 cells. With
# ONLY=extremes nothing but that.
set -euo pipefail
cd "$(dirname "$0")/.."
data=${ENFILADE_DATA:-../shared/data}
rays=${RAYS:-10000000}
every=${EVERY:-1}
random=${RANDOM_VIEWS:-10000}
cargo build --release --features full
mkdir -p out/torture
models=("$@")
[ $# -gt 0 ] || models=("$data"/duplex/Duplex_A_20110907.ifc "$data"/kit-apache/AC11-FZK-Haus.ifc "$data"/webifc-mpl/Office_A_20110811.ifc
  "$data"/godot-demos/zdm2.glb "$data"/game-maps-obj/pandora.obj data/buildings/villa_rotonda.glb data/buildings/office.glb
  data/buildings/gallery100.glb)
failed=0
[ "${ONLY:-}" != extremes ] || models=()
for model in "${models[@]}"; do
  name=$(basename "${model%.*}")
  out=out/torture/$name
  ./target/release/enfilade bake "$model" -o "$out.pvs" --json >"$out.bake.json"
  ./target/release/enfilade check "$out.pvs" --model "$model" --rays "$rays" --json >"$out.check.json" || failed=1
  ./target/release/enfilade walk "$out.pvs" --model "$model" --mode all --verify-pixels --every "$every" --json >"$out.walk.jsonl" || failed=1
  ./target/release/enfilade walk "$out.pvs" --model "$model" --mode all --verify-pixels --path "random:$random" --size 160x90 --json \
    >"$out.random.jsonl" || failed=1
  path=${model%.*}.path.json
  if [ -e "$path" ]; then
    ./target/release/enfilade walk "$out.pvs" --model "$model" --path "$path" --mode all --verify-pixels --json >"$out.path.jsonl" || failed=1
  fi
  echo "$name baked, checked, walked: $([ $failed = 0 ] && echo passed || echo FAILED)"
done
[ "${ONLY:-}" = extremes ] || cargo test --release --features full --test suite -- --ignored unseen:: || failed=1
ENFILADE_MUTANTS=${MUTANTS:-1000000} cargo test --release --features full --test counted -- hostile:: 2>&1 | tee out/torture/hostile.txt || failed=1
ENFILADE_KILLS=${KILLS:-50} cargo test --release --features full --test suite -- resume::a_killed_bake 2>&1 | tee out/torture/kills.txt || failed=1
ENFILADE_KILLS=${KILLS:-50} cargo test --release --features full --test suite -- workers::killed_workers 2>&1 | tee out/torture/killed-workers.txt || failed=1
cargo test --release --features full --test suite -- extremes:: --include-ignored --test-threads 1 2>&1 | tee out/torture/extremes.txt || failed=1
exit $failed

#!/usr/bin/env bash
# What tubes save, on the Vulkan driver that is there: frames a second of meshes and of tubes by size, and three flights of 600 frames (along,
# over, away) a model. `scripts/tubes.sh [MODEL.pvs ...]` builds both programs and writes to out/tubes.
set -euo pipefail
cd "$(dirname "$0")/.."
out=out/tubes
mkdir -p "$out"
cargo build --release --features full
cargo build --release -p enfilade-viewer --features ifc,quake
enfilade=target/release/enfilade
bench() { target/release/enfilade-viewer "$@" --bench --mode frustum --size 960x540 2>/dev/null; }

# Three paths: through the middle along the longest side, over it, and away until pipes of RADIUS are 0.02 pixels wide.
flights() {
  "$enfilade" export "$1" --model "$2" -o "$out/scene.glb" >/dev/null
  python3 - "$out/scene.glb" "$out" "$3" <<'PY'
import json, math, struct, sys
data = open(sys.argv[1], "rb").read()
scene = json.loads(data[20:20 + struct.unpack("<I", data[12:16])[0]])
points = []

# Nodes of these models are moved, never turned.
def visit(node, at):
    at = [a + b for a, b in zip(at, node.get("translation", [0, 0, 0]))]
    for part in scene["meshes"][node["mesh"]]["primitives"] if "mesh" in node else []:
        box = scene["accessors"][part["attributes"]["POSITION"]]
        points.extend([a + b for a, b in zip(at, box[end])] for end in ("min", "max"))
    for child in node.get("children", []):
        visit(scene["nodes"][child], at)

for root in scene["scenes"][scene.get("scene", 0)]["nodes"]:
    visit(scene["nodes"][root], [0, 0, 0])
low, high = ([f(p[k] for p in points) for k in range(3)] for f in (min, max))
middle = [(a + b) / 2 for a, b in zip(low, high)]
side = 0 if high[0] - low[0] > high[2] - low[2] else 2
size = max(high[k] - low[k] for k in range(3))
FRAMES, FOCAL = 600, 540 / 2 / math.tan(math.radians(30))

def save(name, frames):
    path = {"name": name, "fov_y_degrees": 60, "near": 0.05, "frames": [{"eye": e, "target": t} for e, t in frames]}
    json.dump(path, open(f"{sys.argv[2]}/{name}.path.json", "w"))

def at(share, up):
    eye = list(middle)
    eye[side], eye[1] = low[side] + share * (high[side] - low[side]), up
    return eye

def ahead(eye, by, down=0.0):
    to = list(eye)
    to[side], to[1] = to[side] + by, to[1] - down
    return to

shares = [k / (FRAMES - 1) for k in range(FRAMES)]
save("along", [(at(t, middle[1]), ahead(at(t, middle[1]), 10.0)) for t in shares])
up = high[1] + 0.1 * size
save("over", [(at(t, up), ahead(at(t, up), 10.0, 7.0)) for t in shares])
last = 2 * float(sys.argv[3]) * FOCAL / 0.02
away = [0.5 * size * (max(last, size) / (0.5 * size)) ** t for t in shares]
save("away", [([m + 0.577 * d for m in middle], middle) for d in away])
PY
}

echo "sections mesh tubes weighed wide" | tee "$out/sizes.txt"
for sections in 170 1700 3300 8300 17000 33000; do
  "$enfilade" generate pipes --sections "$sections" -o "$out/pipes.glb" >/dev/null
  row=$sections
  for tubes in never auto; do
    "$enfilade" bake "$out/pipes.glb" --tubes "$tubes" --rays 10k -o "$out/$tubes.pvs" >/dev/null
  done
  fps() { python3 -c 'import json, sys; print(json.load(sys.stdin)["fps"])'; }
  row+=" $(bench "$out/never.pvs" --model "$out/pipes.glb" | fps)"
  for thin in off weighed wide; do
    row+=" $(bench "$out/auto.pvs" --model "$out/pipes.glb" --thin-tubes "$thin" | fps)"
  done
  echo "$row" | tee -a "$out/sizes.txt"
done
rm -f "$out/flights.txt"
while [ $# -gt 1 ]; do
  flights "$1" "$2" "${RADIUS:-0.1}"
  for flight in along over away; do
    echo "$1 $flight $(bench "$1" --model "$2" --path "$out/$flight.path.json")" | tee -a "$out/flights.txt"
  done
  shift 2
done

#!/usr/bin/env bash
# What strangers' models come to: a markdown table with a line a model, of all readable models in a folder and below it, or of those that
# are named: `bash scripts/gauntlet.sh FOLDER_OR_MODEL... [-- FLAGS OF BAKE]`. A bake may take 200 s, and so may the walk that compares
# each fourth frame with a picture of everything; then `check` casts 200,000 rays. Files and logs go to out/gauntlet. Needs python3.
set -euo pipefail
root=$(cd "$(dirname "$0")/.." && pwd)
out=$root/out/gauntlet
enfilade=$root/target/release/enfilade
limit=(timeout --foreground -k 10 200)
given=()
while [ $# -gt 0 ] && [ "$1" != -- ]; do
  given+=("$1")
  shift
done
[ $# -eq 0 ] || shift
flags=("$@")
[ ${#given[@]} -gt 0 ] || { echo "usage: gauntlet.sh FOLDER_OR_MODEL... [-- FLAGS OF BAKE]" >&2 && exit 2; }
[ -x "$enfilade" ] || cargo build --release --features full --manifest-path "$root/Cargo.toml"
mkdir -p "$out"

# Runs a command, and writes its user seconds, system seconds and KiB at peak (0 where they are not known) to a file: spent FILE COMMAND...
spent() {
  local file=$1
  shift
  if [ -x /usr/bin/time ]; then
    /usr/bin/time -q -f '%U %S %M' -o "$file" "$@"
  else
    local TIMEFORMAT='%U %S 0' code=0
    { time "$@" 2>&3 || code=$?; } 3>&2 2>"$file"
    return $code
  fi
}

# The line of a model, or the last lines of the table: python STEM MODEL, python all.
line() {
  python3 - "$out" "$@" <<'PYTHON'
import glob, json, math, os, sys

out, *given = sys.argv[1:]
short = lambda text, most: text if len(text) <= most else text[: most - 1] + "…"


def load(path, each):
    try:
        return [json.loads(part) for part in (open(path) if each else [open(path).read()])]
    except (OSError, ValueError):
        return []


def of(stem):
    bake = (load(f"{stem}.json", False) or [{}])[0]
    modes = {m["summary"]["mode"]: m["summary"] for m in load(f"{stem}.walk", True) if "summary" in m}
    log = open(f"{stem}.log").read().strip().splitlines()
    user, system, peak = map(float, open(f"{stem}.time").read().split()[-3:])
    code = int(open(f"{stem}.code").read())
    return bake, modes, log, user + system, max(peak / 1024, bake.get("peak_rss_mb") or 0), code


def mean(modes, mode):
    return modes[mode]["triangles_mean"] if mode in modes else None


# What `check` found, where it fails: the line before the word.
def failed(stem):
    said = open(f"{stem}.check").read().strip().splitlines() if os.path.exists(f"{stem}.check") else []
    return said[-2].strip() if said[-1:] == ["failed"] and len(said) > 1 else None


def row(stem, model):
    bake, modes, log, seconds, peak, code = of(stem)
    number = lambda x, digits=0: "" if x is None else f"{x:.{digits}f}"
    pvs = bake.get("pvs", {}).get("gap", {})
    missed = sum(m.get("missed_pixels", 0) for m in modes.values()) if modes else None
    gap = None if pvs.get("closed") is None else 100 * pvs["closed"]
    words = [bake["strategy"]["reason"], *bake["notes"], *bake["details"]] if bake else []
    if code:
        words = [f"exit {code}: {log[-1] if log else 'no word'}"]
    elif failed(stem):
        words = [f"check fails: {failed(stem)}", *words]
    elif not modes:
        words = [f"walk: {log[-1] if log else 'no word'}", *words]
    cells = f"{bake['cells']} ({bake['open_cells']})" if bake else ""
    visible = modes["both"].get("exact_triangles_mean") if "both" in modes else None
    name, kind = os.path.splitext(os.path.basename(model))
    fields = [short(name, 32), kind[1:], bake.get("triangles", ""), bake["strategy"]["cells"] if bake else "", cells]
    fields += [bake.get("portals", ""), number(seconds, 1), number(peak), number(gap, 2), number(missed)]
    fields += [number(mean(modes, mode)) for mode in ("frustum", "portals", "pvs", "both")] + [number(visible)]
    fields += ["; ".join(short(word, 90) for word in words).replace("|", "/")]
    print("|", " | ".join(map(str, fields)), "|", flush=True)


def total():
    all = [of(path[: -len(".code")]) for path in sorted(glob.glob(f"{out}/*.code"))]
    visible = lambda modes: modes["both"].get("exact_triangles_mean") if "both" in modes else None
    least = lambda modes: min(filter(None, (mean(modes, mode) for mode in ("both", "chc"))), default=None)

    def ratio(name, pairs):
        logs = [math.log(a / b) for a, b in pairs if a and b]
        print(f"{name}, geometric mean of {len(logs)}: {math.exp(sum(logs) / len(logs)):.3f}" if logs else f"{name}: no walks")

    one = [bake for bake, *_ in all if bake and bake["cells"] == bake["open_cells"] == 1]
    # From here on `bake` says in prose that portals and rows save nothing, and what to do.
    said = lambda bake: ((bake.get("expected_draw") or {}).get("both") or 0) > 0.9
    print()
    print(f"models: {len(all)}, refused or stopped: {sum(code != 0 for *_, code in all)}")
    ratio("both/frustum", [(mean(modes, "both"), mean(modes, "frustum")) for _, modes, *_ in all])
    ratio("both/visible", [(mean(modes, "both"), visible(modes)) for _, modes, *_ in all])
    ratio("least of both and chc/visible", [(least(modes), visible(modes)) for _, modes, *_ in all])
    print(f"missed pixels: {sum(m.get('missed_pixels', 0) for _, modes, *_ in all for m in modes.values())}")
    print(f"one open cell: {len(one)}, without a word about it: {sum(not said(bake) for bake in one)}")
    stems = [path[: -len(".code")] for path in glob.glob(f"{out}/*.code")]
    print(f"check fails: {sum(failed(stem) is not None for stem in stems)}")
    print(f"over 120 CPU s: {sum(s > 120 for *_, s, _, _ in all)}, over 1 GB: {sum(mb > 1000 for *_, mb, _ in all)}")


total() if given == ["all"] else row(*given)
PYTHON
}

rm -f "$out"/*.{check,code,json,log,pvs,time,walk}
echo "| model | format | triangles | cells by | cells (open) | portals | bake, CPU s | MB | gap, % | missed pixels | frustum | portals | pvs |" \
  "both | visible | remarks |"
echo "| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |"
while IFS= read -r model; do
  stem=$out/$(tr -c 'A-Za-z0-9\n._-' _ <<<"${model#/}")
  code=0
  spent "$stem.time" "${limit[@]}" "$enfilade" bake "$model" -o "$stem.pvs" --json "${flags[@]}" >"$stem.json" 2>"$stem.log" || code=$?
  echo "$code" >"$stem.code"
  rm -f "$stem.bake-state"
  if [ "$code" -eq 0 ]; then
    "${limit[@]}" "$enfilade" walk "$stem.pvs" --model "$model" --mode all --verify-pixels --every 4 --size 480x270 --json \
      >"$stem.walk" 2>>"$stem.log" || true
    "${limit[@]}" "$enfilade" check "$stem.pvs" --model "$model" --rays 200k --views 1 >"$stem.check" 2>&1 || echo failed >>"$stem.check"
  fi
  line "$stem" "$model"
done < <(find "${given[@]}" -type f \( -iname '*.glb' -o -iname '*.gltf' -o -iname '*.obj' -o -iname '*.ifc' -o -iname '*.gml' -o -iname '*.geojson' -o -iname '*.ifczip' \
  -o -iname '*.ply' -o -iname '*.stl' -o -iname '*.bsp' -o -iname '*.map' \) | sort)
line all

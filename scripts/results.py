#!/usr/bin/env python3
"""Makes docs/results.md: eight questions, a table each, from one commit.

Run it on a quiet machine, from anywhere: `python3 scripts/results.py`. It builds the release binaries, reads the models of $ENFILADE_DATA (by
default ../shared/data) and leaves out those that are not there. It takes about half an hour. `--only gap,vis` makes some tables anew and keeps the
others, which then stand under the commit of the first line. What ran is kept in out/results.
"""

import argparse
import gzip
import json
import os
import pathlib
import subprocess
import time

ROOT = pathlib.Path(__file__).resolve().parent.parent
DATA = pathlib.Path(os.environ.get("ENFILADE_DATA", ROOT / "../shared/data")).resolve()
OUT = ROOT / "out/results"
ENFILADE = ROOT / "target/release/enfilade"
VIEWER = ROOT / "target/release/enfilade-viewer"
MOST_LINES = 300

# Models of the tables about rows and frames: name, where it lies, what it is.
MODELS = [
    ("villa_rotonda", ROOT / "data/buildings/villa_rotonda.glb", "a villa, made here"),
    ("office", ROOT / "data/buildings/office.glb", "an office, made here"),
    ("gallery100", ROOT / "data/buildings/gallery100.glb", "100 rooms, made here"),
    ("furnished", OUT / "furnished.glb", "an office of 80 rooms with furniture, generated"),
    ("Duplex_A", DATA / "duplex/Duplex_A_20110907.ifc", "two flats, IFC"),
    ("FZK-Haus", DATA / "kit-apache/AC11-FZK-Haus.ifc", "a house, IFC"),
    ("Office_A", DATA / "webifc-mpl/Office_A_20110811.ifc", "an office, IFC"),
    ("LargeBuilding", DATA / "bimwhale-mit/LargeBuilding.ifc", "a building, IFC"),
    ("zdm2", DATA / "godot-demos/zdm2.glb", "a game's level"),
    ("pandora", DATA / "game-maps-obj/pandora.obj", "a game's level"),
    ("sponza", DATA / "classics/sponza.obj", "an atrium"),
    ("e1m1", DATA / "quake-id-gpl/e1m1.bsp", "a Quake level with its leaves"),
    ("dense city", OUT / "city.glb", "25,426 buildings, generated; one open cell"),
]
# IFC models whose rooms are known from the file; the split does not read them.
ROOMS = ["duplex/Duplex_A_20110907", "kit-apache/AC11-FZK-Haus", "webifc-mpl/AC20-FZK-Haus", "kit-apache/AC11-Smiley-West",
         "webifc-mpl/Office_A_20110811", "bimwhale-mit/LargeBuilding", "bimwhale-mit/TallBuilding"]
# Levels, and the seconds that ericw-tools vis 2.0.0-alpha11 at level 4 took on another machine of two cores.
LEVELS = {"lqdm12": 0.2, "id_dm4": 0.72, "lq_e0m1": 0.59, "lqdm13": 51.3, "id_e1m3": 4.7, "lq_e0m3": 11.4, "lq_e0m2": 34.0}
QUAKE = ["dm4", "e1m1", "e1m3", "e2m2", "start"]
MODES = ["none", "frustum", "pvs", "portals", "both", "auto", "chc++", "chc"]


def run(*command):
    """The standard output of a command, and its processor seconds; the command is kept in out/results/commands.txt."""
    text = " ".join(str(part) for part in command)
    with open(OUT / "commands.txt", "a", encoding="utf-8") as log:
        log.write(text + "\n")
    print("+", text, flush=True)
    before = os.times()
    done = subprocess.run([str(part) for part in command], cwd=ROOT, capture_output=True, text=True)
    after = os.times()
    spent = after.children_user - before.children_user + after.children_system - before.children_system
    if done.returncode not in (0, 1):
        raise SystemExit(f"{text}: {done.stderr.strip().splitlines()[-1:]}")
    return done.stdout, spent


def last_json(text):
    return json.loads(text[text.index("{"):]) if text.lstrip().startswith("{\n") else json.loads(text.strip().splitlines()[-1])


def table(head, rows):
    lines = ["| " + " | ".join(head) + " |", "| " + " | ".join("---" for _ in head) + " |"]
    return lines + ["| " + " | ".join(str(cell) for cell in row) + " |" for row in rows]


def share(part, whole):
    return f"{part / whole:.3f}" if whole else ""


class Baked:
    """Bakes each model once, and walks through it once."""

    def __init__(self):
        self.bakes, self.walks = {}, {}

    def models(self):
        return [(name, path, what) for name, path, what in MODELS if path.exists()]

    def file(self, name):
        return OUT / f"{name.replace(' ', '_')}.pvs"

    def bake(self, name, path):
        if name not in self.bakes:
            out, spent = run(ENFILADE, "bake", path, "--rays", "5M", "--rows", "both", "--fresh", "--json", "-o", self.file(name))
            self.bakes[name] = (last_json(out), spent)
        return self.bakes[name]

    def walk(self, name, path):
        self.bake(name, path)
        if name not in self.walks:
            frames = ["--every", "4"]
            given = path.with_suffix(".path.json")
            if given.exists():
                frames = ["--path", given, "--every", "8"]
            out, _ = run(ENFILADE, "walk", self.file(name), "--model", path, *frames, "--mode", "all", "--verify-pixels", "--size", "480x270",
                         "--json")
            summaries = [json.loads(line)["summary"] for line in out.splitlines() if line.startswith('{"summary"')]
            self.walks[name] = {summary["mode"]: summary for summary in summaries}
        return self.walks[name]


def saves(baked):
    rows = []
    for name, path, what in baked.models():
        walk = baked.walk(name, path)
        drawn = [f"{walk[mode]['triangles_mean']:,.0f}" for mode in MODES]
        seen = walk["both"]["exact_triangles_mean"]
        missed = sum(walk[mode]["missed_pixels"] for mode in MODES)
        rows.append([f"{name} ({what})", *drawn, f"{seen:,.0f}", missed])
    return ["Mean triangles of a frame. *Visible* counts the objects that have a pixel: the least that a culler by objects can draw. *Missed* are "
            "pixels over all modes, against a picture of everything.", "",
            "    enfilade walk FILE.pvs --model MODEL --mode all --verify-pixels --size 480x270 --json", "",
            *table(["model", *MODES, "visible", "missed"], rows)]


def right(baked):
    rows = []
    for name, path, _ in baked.models():
        baked.bake(name, path)
        out, _ = run(ENFILADE, "check", baked.file(name), "--model", path, "--rays", "1M", "--json")
        check = last_json(out)
        rows.append([name, f"{check['rays']:,}", check["missed_rays"], check["missed_pairs"], check["missed_cell_pairs"], check["missed_segments"],
                     check["structure"]["count"], check["crack_rays"], "yes" if check["passed"] else "**no**"])
    found = []
    for stem in ROOMS:
        model, rooms = DATA / f"{stem}.ifc", DATA / f"{stem}.rooms.json"
        if not (model.exists() and rooms.exists()):
            continue
        file = OUT / f"{model.stem}.plan.pvs"
        run(ENFILADE, "bake", model, "--cells", "plan", "--rays", "0", "--fresh", "-o", file, "--json")
        out, _ = run(ENFILADE, "check", file, "--model", model, "--rooms", rooms, "--rays", "0", "--views", "0", "--json")
        score = last_json(out)["rooms"]
        doors = score["doors"]
        found.append([model.stem, f"{score['rooms_found']} of {score['rooms']}", f"{score['cells_right']} of {score['cells']}",
                      f"{doors['located']}, {doors['joining']} of {doors['count']}", f"{score['mean_iou']:.3f}"])
    return ["A million rays of a tracer of its own. *Missed* rays, pairs and segments contradict the file. *At cracks*: rays that pass nearer to a "
            "surface than the clearance that the file states.", "",
            "    enfilade check FILE.pvs --model MODEL --rays 1M --json", "",
            *table(["model", "rays", "missed rays", "pairs", "cell pairs", "segments", "faults of structure", "at cracks", "passed"], rows), "",
            "Rooms and doors of the authors, which the split by `plan` does not read:", "",
            "    enfilade check FILE.pvs --model MODEL.ifc --rooms MODEL.rooms.json --rays 0 --views 0 --json", "",
            *table(["building", "rooms found", "cells right", "doors located, joining", "mean overlap"], found)]


def gap(baked):
    rows = []
    for name, path, _ in baked.models():
        report, _ = baked.bake(name, path)
        pvs = report.get("pvs") or {}
        if not pvs.get("total_pairs"):
            continue
        closed = (pvs.get("gap") or {}).get("closed")
        unseen = (pvs.get("unseen") or {}).get("mean")
        rows.append([name, report["cells"], report["objects"], f"{pvs['lower_pairs']:,}", f"{pvs['undecided_pairs']:,}",
                     f"{pvs['total_pairs'] - pvs['upper_pairs']:,}", share(pvs["undecided_pairs"], pvs["upper_pairs"]),
                     "" if closed is None else f"{closed:.3f}", "" if unseen is None else f"{100 * unseen:.3f} %", pvs["contradictions"]])
    return ["Pairs of a cell and an object after five million rays. *Gap*: undecided pairs over those not hidden. *Closed cells*: the same, of cells "
            "that are indoors. *Unseen*: bound on the mean solid angle that sampling has not seen, with 95 % confidence.", "",
            "    enfilade bake MODEL --rays 5M --rows both --json -o FILE.pvs", "",
            *table(["model", "cells", "objects", "witnessed", "undecided", "hidden", "gap", "closed cells", "unseen", "contradictions"], rows)]


def cost(baked):
    rows = []
    for name, path, _ in baked.models():
        report, spent = baked.bake(name, path)
        seconds = report["seconds"]
        rows.append([name, f"{report['triangles']:,}", f"{seconds['import']:.1f}", f"{seconds['cells']:.1f}", f"{seconds['pvs']:.1f}",
                     f"{seconds['total']:.1f}", f"{spent:.1f}", f"{report['peak_rss_mb']:.0f}"])
    return ["Wall seconds on two cores, and processor seconds of the whole program.", "",
            *table(["model", "triangles", "import", "cells", "rows", "all", "CPU s", "peak, MB"], rows)]


def frame(baked):
    rows = []
    for name, path, _ in baked.models():
        walk = baked.walk(name, path)
        culls = [f"{walk[mode]['us_median']:.1f} ({walk[mode]['us_p99']:.0f})" for mode in MODES if mode not in ("auto", "chc", "chc++")]
        frames = [f"{walk[mode]['frame_us_median']:,.0f}" for mode in ("frustum", "both", "auto", "chc")]
        rows.append([name, *culls, *frames])
    return ["Microseconds: the median of culling and its 99th percentile; then whole frames with what is left drawn into the depth buffer on the "
            "processor, 480 x 270.", "",
            *table(["model", *[f"{mode}" for mode in MODES if mode not in ("auto", "chc", "chc++")],
                    *[f"frame: {mode}" for mode in ("frustum", "both", "auto", "chc")]], rows)]


def sizes(baked):
    rows = []
    for name, path, _ in baked.models():
        report, _ = baked.bake(name, path)
        pvs = report.get("pvs") or {}
        plain = OUT / "plain.pvs"
        run(ENFILADE, "bake", path, "--rays", "0", "--fresh", "--json", "-o", plain)
        rows.append([name, f"{path.stat().st_size:,}", f"{plain.stat().st_size:,}", f"{baked.file(name).stat().st_size:,}",
                     f"{pvs.get('row_bytes', 0):,}", f"{pvs.get('bits_per_pair') or 0:.3f}", f"{pvs.get('entropy_bits_per_pair') or 0:.3f}"])
    return ["Bytes. *File* has conservative rows without rays, *with bounds* what `--rows both` adds. Bits a pair stand beside the entropy of a pair "
            "that knows its row's density alone.", "",
            *table(["model", "model's own", "file", "with bounds", "rows", "bits a pair", "entropy"], rows)]


def vis(_):
    rows = []
    for level, reference in LEVELS.items():
        prt, theirs = DATA / f"prt/{level}.prt", OUT / f"{level}.txt"
        if not prt.exists():
            continue
        theirs.write_bytes(gzip.decompress((DATA / f"prt/{level}.vis.txt.gz").read_bytes()))
        out, spent = run(ENFILADE, "vis", prt, "--against", theirs, "--rows", OUT / f"{level}.rows", "--threads", "1", "--json")
        report = last_json(out)
        rows.append([level, report["clusters"], report["portals"], *level_cells(report), f"{reference:.1f}", f"{spent:.2f}"])
    quake = []
    for level in QUAKE:
        bsp = DATA / f"quake-id-gpl/{level}.bsp"
        if not bsp.exists():
            continue
        out, spent = run(ENFILADE, "vis", bsp, "--against", bsp, "-o", OUT / f"{level}.bsp", "--json")
        report = last_json(out)
        quake.append([level, report["clusters"], report["portals"], *level_cells(report), f"{spent:.2f}"])
    return ["The reference is ericw-tools vis 2.0.0-alpha11 at level 4, on another machine of two cores. Ordered pairs of clusters. *Refuted* pairs "
            "are in its rows and proven hidden; *lost* pairs are not, although a line proves them.", "",
            "    enfilade vis LEVEL.prt --against LEVEL.txt --rows LEVEL.rows --threads 1 --json", "",
            *table(["level", "clusters", "portals", *LEVEL_HEAD, "CPU s, reference", "CPU s"], rows), "",
            "Published Quake levels, whose rows an unknown tool made (`enfilade vis LEVEL.bsp --against LEVEL.bsp -o OUT.bsp --json`):", "",
            *table(["level", "leaves", "portals", *LEVEL_HEAD, "CPU s"], quake)]


LEVEL_HEAD = ["theirs", "ours", "undecided", "refuted", "lost"]


def level_cells(report):
    against = report["against"]
    return [f"{against['their_pairs']:,}", f"{report['upper_pairs']:,}", report["undecided_pairs"], against["refuted_pairs"], against["lost_pairs"]]


def device(_):
    if not VIEWER.exists():
        return ["Not measured: there is no viewer."]
    rows = []
    for name, path, _ in MODELS:
        if name not in ("villa_rotonda", "office", "gallery100", "dense city") or not path.exists():
            continue
        for mode in ("frustum", "both", "chc", "hiz"):
            given = path.with_suffix(".path.json")
            way = ["--path", given] if given.exists() else []
            out, _ = run(VIEWER, OUT / f"{name.replace(' ', '_')}.pvs", "--model", path, *way, "--bench", "--mode", mode, "--size", "960x540")
            report = last_json(out)
            rows.append([name, mode, f"{report['fps']:.0f}", f"{report['triangles_mean']:,.0f}", f"{report['objects_mean']:,.0f}"])
    return ["Frames of the viewer at 960 x 540 with a software driver (lavapipe); `hiz` decides on the device.", "",
            "    enfilade-viewer FILE.pvs --model MODEL --bench --mode MODE --size 960x540", "",
            *table(["model", "mode", "frames a second", "triangles", "objects"], rows)]


QUESTIONS = [
    ("saves", "What does culling save?", saves),
    ("right", "Are the rows right, and the rooms?", right),
    ("gap", "How wide is the gap?", gap),
    ("cost", "What does a bake cost?", cost),
    ("frame", "What does a frame cost?", frame),
    ("sizes", "How large are files?", sizes),
    ("vis", "How does `vis` stand beside its references?", vis),
    ("device", "What does a device do?", device),
]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", default="", help="questions to answer anew, with commas between")
    parser.add_argument("--no-build", action="store_true", help="take the binaries as they are")
    given = parser.parse_args()
    OUT.mkdir(parents=True, exist_ok=True)
    (OUT / "commands.txt").unlink(missing_ok=True)
    if not given.no_build:
        subprocess.run(["cargo", "build", "--release", "-p", "enfilade-cli", "-p", "enfilade-viewer", "--features", "enfilade-cli/full"], cwd=ROOT,
                       check=True)
    run(ENFILADE, "generate", "office", "--rooms", "80", "--furnished", "--facts", "-o", OUT / "furnished.glb")
    run(ENFILADE, "generate", "city", "--facts", "-o", OUT / "city.glb")
    baked, only = Baked(), {name for name in given.only.split(",") if name}
    start = time.monotonic()
    for name, title, answer in QUESTIONS:
        if not only or name in only:
            (OUT / f"{name}.md").write_text("\n".join([f"## {title}", "", *answer(baked)]) + "\n", encoding="utf-8")
    commit = subprocess.run(["git", "rev-parse", "--short", "HEAD"], cwd=ROOT, capture_output=True, text=True, check=True).stdout.strip()
    head = ["# Results", "",
            f"{time.strftime('%Y-%m-%d')}, commit {commit}, {os.cpu_count()} cores of a virtual machine. Made by `python3 scripts/results.py` in "
            f"{(time.monotonic() - start) / 60:.0f} minutes.", "",
            "Counts (pairs, rays, triangles) are the same on every machine; times are not, so only those of one run are compared. Models of "
            "`$ENFILADE_DATA` are not in this repository. What was tried and does not pay is in [crates/studies](../crates/studies/README.md).", ""]
    parts = [(OUT / f"{name}.md") for name, _, _ in QUESTIONS]
    text = "\n".join(head) + "\n" + "\n".join(part.read_text(encoding="utf-8") for part in parts if part.exists())
    lines = text.count("\n")
    if lines > MOST_LINES:
        raise SystemExit(f"docs/results.md would have {lines} lines, more than {MOST_LINES}")
    (ROOT / "docs/results.md").write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()

#!/usr/bin/env python3
"""Lines of water networks (EPANET .inp) and of tracts (TrackVis .trk) as GeoJSON with a diameter, for `enfilade bake`.

    scripts/lines-to-geojson.py network.inp network.geojson          metres; --us for feet with diameters in inches
    scripts/lines-to-geojson.py tracts.trk tracts.geojson --radius 0.2    in the file's own unit, millimetres
"""
import argparse
import json
import struct
import sys


def inp(text, per_diameter):
    """Pipes with their vertices, in the unit of the coordinates; heights are those of the nodes."""
    section, at, between, height, pipes = None, {}, {}, {}, []
    for line in text.splitlines():
        words = line.split(";")[0].split()
        if not words:
            continue
        if words[0].startswith("["):
            section = words[0].strip("[]").upper()
        elif section == "COORDINATES":
            at[words[0]] = [float(words[1]), float(words[2])]
        elif section == "VERTICES":
            between.setdefault(words[0], []).append([float(words[1]), float(words[2])])
        elif section in ("JUNCTIONS", "TANKS", "RESERVOIRS"):
            height[words[0]] = float(words[1])
        elif section == "PIPES":
            pipes.append((words[0], words[1], words[2], float(words[4])))
    for name, a, b, diameter in pipes:
        if a in at and b in at:
            points = [at[a], *between.get(name, []), at[b]]
            low, high = height.get(a, 0.0), height.get(b, 0.0)
            last = len(points) - 1
            yield name, diameter / per_diameter, [[x, y, low + (high - low) * k / last] for k, (x, y) in enumerate(points)]


def trk(data, diameter):
    """Tracts; scalars and properties are skipped."""
    if data[:5] != b"TRACK" or len(data) < 1000:
        sys.exit("not a TrackVis file: it doesn't begin with TRACK and a header of 1,000 bytes")
    scalars, = struct.unpack_from("<h", data, 36)
    properties, = struct.unpack_from("<h", data, 238)
    place, number = 1000, 0
    while place + 4 <= len(data):
        count, = struct.unpack_from("<i", data, place)
        place += 4
        step = 4 * (3 + scalars)
        if count < 0 or place + count * step + 4 * properties > len(data):
            sys.exit(f"tract {number} is cut off")
        yield str(number), diameter, [list(struct.unpack_from("<3f", data, place + k * step)) for k in range(count)]
        place += count * step + 4 * properties
        number += 1


def main():
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("source")
    arguments.add_argument("output")
    arguments.add_argument("--us", action="store_true", help="coordinates in feet, diameters in inches")
    arguments.add_argument("--radius", type=float, default=0.2, help="of tracts, in the file's unit")
    given = arguments.parse_args()
    with open(given.source, "rb") as file:
        data = file.read()
    if given.source.lower().endswith(".trk"):
        lines = trk(data, 2.0 * given.radius)
    else:
        # Metres and millimetres, or feet and inches.
        lines = inp(data.decode("latin-1"), 12.0 if given.us else 1000.0)
    features = [
        {"type": "Feature", "id": name, "properties": {"diameter": diameter},
         "geometry": {"type": "LineString", "coordinates": points}}
        for name, diameter, points in lines
    ]
    # Small coordinates aren't degrees: the file has a system of its own.
    system = {"type": "name", "properties": {"name": "of the source"}}
    with open(given.output, "w") as file:
        json.dump({"type": "FeatureCollection", "crs": system, "features": features}, file)
    print(f"{given.output}: {len(features)} lines of {sum(len(f['geometry']['coordinates']) for f in features)} points")


if __name__ == "__main__":
    main()

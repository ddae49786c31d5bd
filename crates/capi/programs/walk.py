"""The walk of walk.c by ctypes: walk.py LIBRARY FILE.pvs."""

import ctypes as c
import sys


class Vec3(c.Structure):
    _fields_ = [("x", c.c_float), ("y", c.c_float), ("z", c.c_float)]


class Line(c.Structure):
    _fields_ = [("start", Vec3), ("end", Vec3)]


class Camera(c.Structure):
    _fields_ = [("eye", Vec3), ("x", Vec3), ("y", Vec3), ("w", Vec3)]


class Box(c.Structure):
    _fields_ = [("min", Vec3), ("max", Vec3)]


class Mover(c.Structure):
    _fields_ = [("slot", c.c_uint32), ("life", c.c_uint32)]


class Run(c.Structure):
    _fields_ = [("first", c.c_uint32), ("end", c.c_uint32)]


class Info(c.Structure):
    _fields_ = [("objects", c.c_uint32), ("cells", c.c_uint32), ("portals", c.c_uint32), ("tolerance", c.c_double)] + [
        (axis, c.c_double) for axis in "xyz"
    ]


class Frame(c.Structure):
    _fields_ = [(name, c.c_uint64) for name in ("cells", "portals", "objects", "triangles", "small")]


class Path(c.Structure):
    _fields_ = [("metres", c.c_double), ("at_least", c.c_double)]


OK, NOTHING, BOTH = 0, 6, 4
library = c.CDLL(sys.argv[1])
for name in ("building_open", "view_new", "doors_as_found", "movers_new", "paths_new"):
    getattr(library, "enf_" + name).restype = c.c_void_p
for name in ("building_free", "view_free", "doors_free", "movers_free", "paths_free"):
    getattr(library, "enf_" + name).argtypes = [c.c_void_p]
library.enf_last_error.restype = c.c_char_p


def call(name, *arguments):
    """A call that must go well."""
    if getattr(library, "enf_" + name)(*arguments) != OK:
        sys.exit(f"{name}: {library.enf_last_error().decode()}")


def filled(name, kind, capacity, *arguments):
    """A list of the library's."""
    buffer, count = (kind * (capacity + 1))(), c.c_size_t()
    call(name, *arguments, buffer, c.c_size_t(capacity), c.byref(count))
    return buffer[: count.value]


def made(name, *arguments):
    """A handle."""
    handle = getattr(library, "enf_" + name)(*arguments)
    if not handle:
        sys.exit(f"{name}: {library.enf_last_error().decode()}")
    return c.c_void_p(handle)


def middle(portal):
    lines = filled("building_portal_lines", Line, 64, building, c.c_uint32(portal))
    total = Vec3()
    for line in lines:
        for axis in "xyz":
            # In single precision, as in C.
            part = c.c_float(getattr(line.start, axis) / len(lines)).value
            setattr(total, axis, getattr(total, axis) + part)
    return total


building = made("building_open", sys.argv[2].encode())
view, doors, movers = (made(name, building) for name in ("view_new", "doors_as_found", "movers_new"))
call("view_set_doors", view, doors)
paths = made("paths_new", building, None)
info = Info()
call("building_info", building, c.byref(info))
print(f"{info.objects} objects, {info.cells} cells, {info.portals} portals")
near = c.c_float(0.2).value
for portal in range(info.portals):
    at, mover = middle(portal), Mover()
    low, high = ([c.c_float(getattr(at, axis) + by).value for axis in "xyz"] for by in (-near, near))
    call("movers_insert", movers, Box(Vec3(*low), Vec3(*high)), c.byref(mover))
for portal in range(info.portals - 1):
    camera, frame = Camera(), Frame()
    call("camera_look_at", middle(portal), middle(portal + 1), c.c_float(1.2), c.c_float(1.5), c.byref(camera))
    call("view_cull", view, c.byref(camera), BOTH, c.byref(frame))
    objects = filled("view_objects", c.c_uint32, info.objects, view)
    runs = filled("view_runs", Run, info.objects, view)
    seen = filled("view_movers", Mover, info.portals, view, movers)
    path, points, count = Path(), (Vec3 * 256)(), c.c_size_t()
    ends = middle(portal), middle(portal + 1)
    found = library.enf_paths_find(paths, None, *ends, c.byref(path), points, c.c_size_t(256), c.byref(count))
    if found not in (OK, NOTHING):
        sys.exit(library.enf_last_error().decode())
    total = 0
    for item in objects:
        total = (total * 31 + item) & 0xFFFFFFFF
    print(
        f"{portal}: {frame.cells} cells, {frame.portals} portals, {len(objects)} objects in {len(runs)} runs,"
        f" {len(seen)} movers, {path.metres:.3f} m, {total:08x}"
    )
for name, handle in (("paths", paths), ("movers", movers), ("doors", doors), ("view", view), ("building", building)):
    getattr(library, f"enf_{name}_free")(handle)

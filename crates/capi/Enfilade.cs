// The signatures of enfilade.h for C#. Handles are IntPtr; what each function does is said there.
using System;
using System.Runtime.InteropServices;

namespace Enfilade
{
    public enum Status { Ok, Null, Argument, File, TooSmall, OtherBuilding, Nothing, Panic }
    public enum Mode : uint { None, Frustum, Portals, Pvs, Both }
    public enum Axes : uint { YUp, ZUp, MirroredX, MirroredZ, LeftHandedZUp }

    [StructLayout(LayoutKind.Sequential)] public struct Vec3 { public float X, Y, Z; }
    [StructLayout(LayoutKind.Sequential)] public struct DVec3 { public double X, Y, Z; }
    [StructLayout(LayoutKind.Sequential)] public struct Box { public Vec3 Min, Max; }
    [StructLayout(LayoutKind.Sequential)] public struct Plane { public float X, Y, Z, D; }
    [StructLayout(LayoutKind.Sequential)] public struct Line { public Vec3 From, To; }
    [StructLayout(LayoutKind.Sequential)] public struct Rect { public float MinX, MinY, MaxX, MaxY; }
    [StructLayout(LayoutKind.Sequential)] public struct Camera { public Vec3 Eye, X, Y, W; }
    [StructLayout(LayoutKind.Sequential)] public struct Run { public uint First, End; }
    [StructLayout(LayoutKind.Sequential)] public struct Mover { public uint Slot, Life; }
    [StructLayout(LayoutKind.Sequential)] public struct Module { public uint Slot, Life; }
    [StructLayout(LayoutKind.Sequential)]
    public struct Placement { [MarshalAs(UnmanagedType.ByValArray, SizeConst = 16)] public double[] Matrix; }
    [StructLayout(LayoutKind.Sequential)] public struct Crossed { public uint Portal, Side; public Rect Rect; }
    [StructLayout(LayoutKind.Sequential)] public struct Frame { public ulong Cells, Portals, Objects, Triangles, Small; }
    [StructLayout(LayoutKind.Sequential)] public struct Path { public double Metres, AtLeast; }
    [StructLayout(LayoutKind.Sequential)] public struct Step { public uint Kind, Object; public float Metres; }
    [StructLayout(LayoutKind.Sequential)]
    public struct BuildingInfo { public uint Objects, Cells, Portals; public double Tolerance; public DVec3 Origin; }
    [StructLayout(LayoutKind.Sequential)]
    public struct Reflection
    {
        public uint Mirror, Parent, Depth; public Camera Camera; public Rect Rect;
        public uint FirstObject, Objects, FirstMover, Movers;
    }
    [StructLayout(LayoutKind.Sequential)]
    public struct Reflections
    {
        public IntPtr Items; public UIntPtr Capacity, Count;
        public IntPtr Objects; public UIntPtr ObjectCapacity, ObjectCount;
        public IntPtr Movers; public UIntPtr MoverCapacity, MoverCount;
    }

    public static class Native
    {
        const string Library = "enfilade";

        [DllImport(Library)] public static extern IntPtr enf_building_open([MarshalAs(UnmanagedType.LPUTF8Str)] string path);
        [DllImport(Library)] public static extern IntPtr enf_building_read(byte[] bytes, UIntPtr length);
        [DllImport(Library)] public static extern void enf_building_free(IntPtr building);
        [DllImport(Library)] public static extern Status enf_building_info(IntPtr building, out BuildingInfo info);
        [DllImport(Library)] public static extern Status enf_building_cell_of(IntPtr building, Vec3 point, out uint cell);
        [DllImport(Library)] public static extern Status enf_building_indices(IntPtr building, uint obj, out Run run);
        [DllImport(Library)] public static extern Status enf_building_object_name(IntPtr building, uint obj, byte[] buffer, UIntPtr capacity, out UIntPtr count);
        [DllImport(Library)] public static extern Status enf_building_portal(IntPtr building, [MarshalAs(UnmanagedType.LPUTF8Str)] string key, out uint portal);
        [DllImport(Library)] public static extern Status enf_building_portal_key(IntPtr building, uint portal, byte[] buffer, UIntPtr capacity, out UIntPtr count);
        [DllImport(Library)] public static extern IntPtr enf_doors_new(IntPtr building);
        [DllImport(Library)] public static extern IntPtr enf_doors_as_found(IntPtr building);
        [DllImport(Library)] public static extern void enf_doors_free(IntPtr doors);
        [DllImport(Library)] public static extern Status enf_doors_set_open(IntPtr doors, uint portal, [MarshalAs(UnmanagedType.I1)] bool open);
        [DllImport(Library)] public static extern Status enf_doors_set_see_through(IntPtr doors, uint portal, uint side, [MarshalAs(UnmanagedType.I1)] bool open);
        [DllImport(Library)] public static extern Status enf_doors_is_open(IntPtr doors, uint portal, uint side, [MarshalAs(UnmanagedType.I1)] out bool open);
        [DllImport(Library)] public static extern uint enf_version();
        [DllImport(Library)] public static extern IntPtr enf_last_error();
        [DllImport(Library)] public static extern Status enf_building_portal_lines(IntPtr building, uint portal, Line[] buffer, UIntPtr capacity, out UIntPtr count);
        [DllImport(Library)] public static extern Status enf_building_cell_lines(IntPtr building, uint cell, Line[] buffer, UIntPtr capacity, out UIntPtr count);
        [DllImport(Library)] public static extern IntPtr enf_loader_new(IntPtr building, ulong[] bytes, UIntPtr objects, ulong budget);
        [DllImport(Library)] public static extern void enf_loader_free(IntPtr loader);
        [DllImport(Library)] public static extern Status enf_loader_set_doors(IntPtr loader, IntPtr doors);
        [DllImport(Library)] public static extern Status enf_loader_frame(IntPtr loader, in Camera camera, double seconds, uint[] visible, UIntPtr count, out UIntPtr missing);
        [DllImport(Library)] public static extern Status enf_loader_next(IntPtr loader, out Step step);
        [DllImport(Library)] public static extern Status enf_loader_loaded(IntPtr loader, uint obj);
        [DllImport(Library)] public static extern Status enf_loader_failed(IntPtr loader, uint obj);
        [DllImport(Library)] public static extern IntPtr enf_mirrors_new();
        [DllImport(Library)] public static extern void enf_mirrors_free(IntPtr mirrors);
        [DllImport(Library)] public static extern Status enf_mirrors_add(IntPtr mirrors, uint cell, Vec3[] corners, UIntPtr count);
        [DllImport(Library)] public static extern Status enf_view_mirrors(IntPtr view, IntPtr mirrors, uint depth, IntPtr movers, ref Reflections into);
        [DllImport(Library)] public static extern IntPtr enf_movers_new(IntPtr building);
        [DllImport(Library)] public static extern void enf_movers_free(IntPtr movers);
        [DllImport(Library)] public static extern Status enf_movers_insert(IntPtr movers, Box bounds, out Mover mover);
        [DllImport(Library)] public static extern Status enf_movers_set(IntPtr movers, Mover mover, Box bounds);
        [DllImport(Library)] public static extern Status enf_movers_remove(IntPtr movers, Mover mover);
        [DllImport(Library)] public static extern Status enf_movers_cells(IntPtr movers, Mover mover, uint[] buffer, UIntPtr capacity, out UIntPtr count);
        [DllImport(Library)] public static extern Status enf_camera_look_at(Vec3 eye, Vec3 target, float fovY, float aspect, out Camera camera);
        [DllImport(Library)] public static extern Status enf_camera_orthographic(Vec3 eye, Vec3 target, float width, float height, out Camera camera);
        [DllImport(Library)] public static extern Status enf_camera_from_matrix(Axes axes, Vec3 eye, float[] viewProjection, out Camera camera);
        [DllImport(Library)] public static extern IntPtr enf_view_new(IntPtr building);
        [DllImport(Library)] public static extern void enf_view_free(IntPtr view);
        [DllImport(Library)] public static extern Status enf_view_set_doors(IntPtr view, IntPtr doors);
        [DllImport(Library)] public static extern Status enf_view_set_min_pixels(IntPtr view, uint pixels, uint width, uint height);
        [DllImport(Library)] public static extern Status enf_view_cull(IntPtr view, in Camera camera, Mode mode, out Frame frame);
        [DllImport(Library)] public static extern Status enf_view_objects(IntPtr view, uint[] buffer, UIntPtr capacity, out UIntPtr count);
        [DllImport(Library)] public static extern Status enf_view_runs(IntPtr view, Run[] buffer, UIntPtr capacity, out UIntPtr count);
        [DllImport(Library)] public static extern Status enf_view_cells(IntPtr view, uint[] buffer, UIntPtr capacity, out UIntPtr count);
        [DllImport(Library)] public static extern Status enf_view_homes(IntPtr view, uint[] buffer, UIntPtr capacity, out UIntPtr count);
        [DllImport(Library)] public static extern Status enf_view_portals(IntPtr view, Crossed[] buffer, UIntPtr capacity, out UIntPtr count);
        [DllImport(Library)] public static extern Status enf_view_near_doors(IntPtr view, uint[] buffer, UIntPtr capacity, out UIntPtr count);
        [DllImport(Library)] public static extern Status enf_view_movers(IntPtr view, IntPtr movers, Mover[] buffer, UIntPtr capacity, out UIntPtr count);
        [DllImport(Library)] public static extern Status enf_view_around(IntPtr view, Vec3 eye, [MarshalAs(UnmanagedType.I1)] out bool isNew, uint[] buffer, UIntPtr capacity, out UIntPtr count);
        [DllImport(Library)] public static extern Status enf_view_in_volume(IntPtr view, Plane[] planes, UIntPtr planeCount, uint[] fromCells, UIntPtr fromCount, uint[] buffer, UIntPtr capacity, out UIntPtr count);
        [DllImport(Library)] public static extern Status enf_view_movers_in_volume(IntPtr view, IntPtr movers, Plane[] planes, UIntPtr planeCount, uint[] fromCells, UIntPtr fromCount, Mover[] buffer, UIntPtr capacity, out UIntPtr count);
        [DllImport(Library)] public static extern IntPtr enf_paths_new(IntPtr building, IntPtr passable);
        [DllImport(Library)] public static extern void enf_paths_free(IntPtr paths);
        [DllImport(Library)] public static extern Status enf_paths_find(IntPtr paths, IntPtr doors, Vec3 start, Vec3 end, out Path path, Vec3[] buffer, UIntPtr capacity, out UIntPtr count);
        [DllImport(Library)] public static extern IntPtr enf_relevance_new(IntPtr building, double metres, IntPtr passable);
        [DllImport(Library)] public static extern IntPtr enf_relevance_of_file(IntPtr building);
        [DllImport(Library)] public static extern void enf_relevance_free(IntPtr relevance);
        [DllImport(Library)] public static extern Status enf_relevance_may_see(IntPtr relevance, uint[] start, UIntPtr fromCount, uint[] end, UIntPtr toCount, [MarshalAs(UnmanagedType.I1)] out bool may);
        [DllImport(Library)] public static extern Status enf_building_may_see(IntPtr building, uint[] start, UIntPtr fromCount, uint[] end, UIntPtr toCount, [MarshalAs(UnmanagedType.I1)] out bool may);
        [DllImport(Library)] public static extern Status enf_view_within_metres(IntPtr view, Box bounds, double metres, uint[] buffer, UIntPtr capacity, out UIntPtr count);
        [DllImport(Library)] public static extern IntPtr enf_world_new();
        [DllImport(Library)] public static extern void enf_world_free(IntPtr world);
        [DllImport(Library)] public static extern Status enf_world_place(IntPtr world, IntPtr building, in Placement placement, out Module module);
        [DllImport(Library)] public static extern Status enf_world_remove(IntPtr world, Module module);
        [DllImport(Library)] public static extern Status enf_world_join(IntPtr world, Module module, uint portal, Module other, uint otherPortal);
        [DllImport(Library)] public static extern Status enf_world_part(IntPtr world, Module module, uint portal);
        [DllImport(Library)] public static extern Status enf_building_ways_in(IntPtr building, uint[] buffer, UIntPtr capacity, out UIntPtr count);
        [DllImport(Library)] public static extern IntPtr enf_world_view_new();
        [DllImport(Library)] public static extern void enf_world_view_free(IntPtr view);
        [DllImport(Library)] public static extern Status enf_world_view_set_doors(IntPtr view, IntPtr world, Module module, IntPtr doors);
        [DllImport(Library)] public static extern Status enf_world_view_cull(IntPtr view, IntPtr world, in Camera camera, Mode mode);
        [DllImport(Library)] public static extern Status enf_world_view_modules(IntPtr view, Module[] buffer, UIntPtr capacity, out UIntPtr count);
        [DllImport(Library)] public static extern Status enf_world_view_objects(IntPtr view, Module module, uint[] buffer, UIntPtr capacity, out UIntPtr count);
        [DllImport(Library)] public static extern Status enf_world_view_runs(IntPtr view, Module module, Run[] buffer, UIntPtr capacity, out UIntPtr count);
        [DllImport(Library)] public static extern Status enf_world_view_movers(IntPtr view, Module module, IntPtr movers, Mover[] buffer, UIntPtr capacity, out UIntPtr count);
    }
}

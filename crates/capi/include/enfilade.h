/* The run time of Enfilade for C. Made from crates/capi by its test `header`: read there what each function asks of its caller. */

#ifndef ENFILADE_H
#define ENFILADE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

// No mirror: what the eye sees directly.
#define ENF_NONE UINT32_MAX

// What became of a call.
typedef enum {
  // All went well.
  ENF_STATUS_OK = 0,
  // A handle or a pointer that is needed is null.
  ENF_STATUS_NULL = 1,
  // An argument is out of its range.
  ENF_STATUS_ARGUMENT = 2,
  // The file can't be read, or is damaged.
  ENF_STATUS_FILE = 3,
  // A buffer is too small: it is full, and the count is what there is.
  ENF_STATUS_TOO_SMALL = 4,
  // Two handles are of different buildings.
  ENF_STATUS_OTHER_BUILDING = 5,
  // There is nothing: no frame yet, no such key, no cell at a point, nothing to load.
  ENF_STATUS_NOTHING = 6,
  // A fault of the library. Free what the call was given.
  ENF_STATUS_PANIC = 7,
} EnfStatus;

// A building, shared by all that is made from it.
typedef struct EnfBuilding EnfBuilding;

// Which portals of a building are shut.
typedef struct EnfDoors EnfDoors;

// What is loaded of a building, and what to load next, for one eye.
typedef struct EnfLoader EnfLoader;

// Mirrors, numbered in the order in which they were added.
typedef struct EnfMirrors EnfMirrors;

// The movers of a world, for any number of views of its building.
typedef struct EnfMovers EnfMovers;

// Finds shortest ways in a building.
typedef struct EnfPaths EnfPaths;

// Rows of what may be seen from where a body may soon be.
typedef struct EnfRelevance EnfRelevance;

// One camera's culling. Views of one building are independent of each other.
typedef struct EnfView EnfView;

// Buildings in their places, and their joins, for any number of views.
typedef struct EnfWorld EnfWorld;

// One camera's culling of a world.
typedef struct EnfWorldView EnfWorldView;

// A point in the model's own coordinates, metres.
typedef struct {
  double x;
  double y;
  double z;
} EnfDVec3;

// Facts of a building.
typedef struct {
  // Numbers of objects, cells and portals; their ids are below these.
  uint32_t objects;
  uint32_t cells;
  uint32_t portals;
  // Metres by which portals, cells and rows may be off.
  double tolerance;
  // What all positions are relative to.
  EnfDVec3 origin;
} EnfBuildingInfo;

// A point or a direction, metres, relative to the building's origin.
typedef struct {
  float x;
  float y;
  float z;
} EnfVec3;

// Indices from `first` to before `end` of an index buffer that holds the objects' triangles in the order of their ids.
typedef struct {
  uint32_t first;
  uint32_t end;
} EnfRun;

// A line of a drawing.
typedef struct {
  EnfVec3 from;
  EnfVec3 to;
} EnfLine;

// A camera; `enf_camera_...` make one. A point is on the screen where the products of `x` and `y` with the way from the eye to it are at most
// that of `w`, but for their sign. `w` of an orthographic camera is 0.
typedef struct {
  EnfVec3 eye;
  EnfVec3 x;
  EnfVec3 y;
  EnfVec3 w;
} EnfCamera;

// What to do, one of `ENF_STEP_...`.
typedef uint32_t EnfStepKind;

// What to do next.
typedef struct {
  EnfStepKind kind;
  uint32_t object;
  // To load: the eye has at least so far to go before the object may be seen, metres.
  float metres;
} EnfStep;

// A rectangle of the screen, from -1 to 1.
typedef struct {
  float min_x;
  float min_y;
  float max_x;
  float max_y;
} EnfRect;

// What a mirror shows.
typedef struct {
  // The mirror's number.
  uint32_t mirror;
  // The reflection in which it is seen; ENF_NONE: directly.
  uint32_t parent;
  // Number of mirrors on the way.
  uint32_t depth;
  // The reflected camera. Draw what is in front of the mirror's plane, with reversed winding.
  EnfCamera camera;
  // The part of the screen.
  EnfRect rect;
  // Its objects: from `first_object` on, `objects` of them. Its movers likewise.
  uint32_t first_object;
  uint32_t objects;
  uint32_t first_mover;
  uint32_t movers;
} EnfReflection;

// A mover. Slots are small numbers and used again, with another life.
typedef struct {
  uint32_t slot;
  uint32_t life;
} EnfMover;

// The caller's buffers for reflections, with room for so many each, and then what there is.
typedef struct {
  EnfReflection *reflections;
  size_t reflection_capacity;
  size_t reflection_count;
  // Objects of all reflections.
  uint32_t *objects;
  size_t object_capacity;
  size_t object_count;
  // Movers of all reflections.
  EnfMover *movers;
  size_t mover_capacity;
  size_t mover_count;
} EnfReflections;

// A box.
typedef struct {
  EnfVec3 min;
  EnfVec3 max;
} EnfBox;

// A way.
typedef struct {
  // Its length, metres.
  double metres;
  // No way is shorter than this, metres: less than `metres` where the search is cut short.
  double at_least;
} EnfPath;

// The axes of an engine's coordinates, one of `ENF_AXES_...`.
typedef uint32_t EnfAxes;

// What is culled by, one of `ENF_MODE_...`.
typedef uint32_t EnfMode;

// Counters of a frame.
typedef struct {
  uint64_t cells;
  uint64_t portals;
  uint64_t objects;
  uint64_t triangles;
  // Small objects that were left out.
  uint64_t small;
} EnfFrame;

// A portal that a frame sees through.
typedef struct {
  uint32_t portal;
  // The direction, 0 or 1.
  uint32_t side;
  // Covers every pixel that shows something beyond.
  EnfRect rect;
} EnfCrossed;

// A half-space: `x * px + y * py + z * pz <= d` inside, with a normal of any length but 0.
typedef struct {
  float x;
  float y;
  float z;
  float d;
} EnfPlane;

// Where a module stands: a matrix by columns, from its coordinates to the world's, that turns and moves, and nothing else.
typedef struct {
  double matrix[16];
} EnfPlacement;

// A module. Slots are small numbers and used again, with another life.
typedef struct {
  uint32_t slot;
  uint32_t life;
} EnfModule;

// Load the object, then call `enf_loader_loaded` or `enf_loader_failed`.
#define ENF_STEP_LOAD 0

// Let the object go: its bytes count as free.
#define ENF_STEP_EVICT 1

// Right-handed, +Y up: glTF, Godot, OpenGL. A building has these.
#define ENF_AXES_Y_UP 0

// Right-handed, +Z up: Blender, Quake.
#define ENF_AXES_Z_UP 1

// Left-handed, +Y up, with X turned round: Unity.
#define ENF_AXES_MIRRORED_X 2

// Left-handed, +Y up, with Z turned round: Direct3D.
#define ENF_AXES_MIRRORED_Z 3

// Left-handed, +Z up, with Y and Z exchanged: Unreal.
#define ENF_AXES_LEFT_HANDED_Z_UP 4

// Everything.
#define ENF_MODE_NONE 0

// Objects in the frustum.
#define ENF_MODE_FRUSTUM 1

// Through portals.
#define ENF_MODE_PORTALS 2

// The row of the eye's cell.
#define ENF_MODE_PVS 3

// Through portals, into cells of the row, objects of the row: the best of these.
#define ENF_MODE_BOTH 4

#ifdef __cplusplus
extern "C" {
#endif // __cplusplus

// Reads a `.pvs` file. Null if that fails: `enf_last_error` says why.
//
// # Safety
//
// `path` is null or UTF-8 that ends with a zero.
EnfBuilding *enf_building_open(const char *path);

// Reads the bytes of a `.pvs` file, which are not needed later. Null if that fails: `enf_last_error` says why.
//
// # Safety
//
// `bytes` is null or has `length` bytes.
EnfBuilding *enf_building_read(const uint8_t *bytes, size_t length);

// Frees a building, or nothing. What was made from it goes on.
void enf_building_free(EnfBuilding *building);

// Facts of a building.
EnfStatus enf_building_info(const EnfBuilding *building, EnfBuildingInfo *info);

// The cell of a point; on a border, the one with the point deepest inside. ENF_STATUS_NOTHING if it is in none.
EnfStatus enf_building_cell_of(const EnfBuilding *building, EnfVec3 point, uint32_t *cell);

// The indices of an object.
EnfStatus enf_building_indices(const EnfBuilding *building, uint32_t object, EnfRun *run);

// The node of the model that an object is a part of, with a zero, which counts.
//
// # Safety
//
// `buffer` has room for `capacity` bytes.
EnfStatus enf_building_object_name(const EnfBuilding *building, uint32_t object, char *buffer, size_t capacity, size_t *count);

// The portal with a key: the same in any bake of the model. ENF_STATUS_NOTHING if there is none.
//
// # Safety
//
// `key` is null or UTF-8 that ends with a zero.
EnfStatus enf_building_portal(const EnfBuilding *building, const char *key, uint32_t *portal);

// The key of a portal, with a zero, which counts.
//
// # Safety
//
// `buffer` has room for `capacity` bytes.
EnfStatus enf_building_portal_key(const EnfBuilding *building, uint32_t portal, char *buffer, size_t capacity, size_t *count);

// All portals open. Null if the building is.
EnfDoors *enf_doors_new(const EnfBuilding *building);

// Portals shut where the model has a shut leaf. Null if the building is.
EnfDoors *enf_doors_as_found(const EnfBuilding *building);

// Frees doors, or nothing.
void enf_doors_free(EnfDoors *doors);

// Opens or shuts a portal in both directions.
EnfStatus enf_doors_set_open(EnfDoors *doors, uint32_t portal, bool open);

// Opens or shuts a portal in one direction, 0 or 1: a mirrored window, a screen.
EnfStatus enf_doors_set_see_through(EnfDoors *doors, uint32_t portal, uint32_t side, bool open);

// Whether a portal is open in a direction, 0 or 1.
EnfStatus enf_doors_is_open(const EnfDoors *doors, uint32_t portal, uint32_t side, bool *open);

// The version of the library: major, minor and patch, a byte each from the third on.
uint32_t enf_version(void);

// What was wrong with the last call of this thread that failed, in a line; empty before. Valid until another one fails.
const char *enf_last_error(void);

// The edges of a portal.
//
// # Safety
//
// `buffer` has room for `capacity` lines.
EnfStatus enf_building_portal_lines(const EnfBuilding *building, uint32_t portal, EnfLine *buffer, size_t capacity, size_t *count);

// The edges of a cell's convex pieces, as far as the building reaches.
//
// # Safety
//
// `buffer` has room for `capacity` lines.
EnfStatus enf_building_cell_lines(const EnfBuilding *building, uint32_t cell, EnfLine *buffer, size_t capacity, size_t *count);

// Nothing loaded yet. `bytes`: what each of the `objects` takes when it is loaded; `budget`: bytes for all. Null if that fails.
//
// # Safety
//
// `bytes` has `objects` numbers.
EnfLoader *enf_loader_new(const EnfBuilding *building, const uint64_t *bytes, size_t objects, uint64_t budget);

// Frees a loader, or nothing.
void enf_loader_free(EnfLoader *loader);

// Takes the states of the doors.
EnfStatus enf_loader_set_doors(EnfLoader *loader, const EnfDoors *doors);

// Begins a frame: its camera, its time in seconds from any start, and its visible objects. `missing`: how many of these are not loaded.
//
// # Safety
//
// `visible` has `count` objects.
EnfStatus enf_loader_frame(EnfLoader *loader,
                           const EnfCamera *camera,
                           double seconds,
                           const uint32_t *visible,
                           size_t count,
                           size_t *missing);

// What to do next. ENF_STATUS_NOTHING: nothing in this frame.
EnfStatus enf_loader_next(EnfLoader *loader, EnfStep *step);

// An object is loaded.
EnfStatus enf_loader_loaded(EnfLoader *loader, uint32_t object);

// An object could not be loaded; it is not asked for again.
EnfStatus enf_loader_failed(EnfLoader *loader, uint32_t object);

// No mirrors yet.
EnfMirrors *enf_mirrors_new(void);

// Frees mirrors, or nothing.
void enf_mirrors_free(EnfMirrors *mirrors);

// Adds a mirror in a cell: a convex polygon of `count` corners, counter-clockwise seen from the room.
//
// # Safety
//
// `corners` has `count` points.
EnfStatus enf_mirrors_add(EnfMirrors *mirrors, uint32_t cell, const EnfVec3 *corners, size_t count);

// The mirrors that the view's last frame shows, and what to draw in them, up to `depth` reflections: those that the eye sees directly come
// first. `movers` may be null. With ENF_STATUS_TOO_SMALL, the counts say what is needed.
//
// # Safety
//
// The buffers of `into` have the room that it says.
EnfStatus enf_view_mirrors(EnfView *view, const EnfMirrors *mirrors, uint32_t depth, const EnfMovers *movers, EnfReflections *into);

// No movers yet. Null if the building is.
EnfMovers *enf_movers_new(const EnfBuilding *building);

// Frees movers, or nothing.
void enf_movers_free(EnfMovers *movers);

// Adds a mover with a box. Allocates where there were never as many.
EnfStatus enf_movers_insert(EnfMovers *movers, EnfBox bounds, EnfMover *mover);

// Moves a mover.
EnfStatus enf_movers_set(EnfMovers *movers, EnfMover mover, EnfBox bounds);

// Removes a mover.
EnfStatus enf_movers_remove(EnfMovers *movers, EnfMover mover);

// The cells that a mover's box meets; none if it is in no cell, or in too many to say.
//
// # Safety
//
// `buffer` has room for `capacity` cells.
EnfStatus enf_movers_cells(const EnfMovers *movers, EnfMover mover, uint32_t *buffer, size_t capacity, size_t *count);

// Prepares for ways through what is open in `passable`; null: all but windows. That takes a while in a large building. Null if it fails.
EnfPaths *enf_paths_new(const EnfBuilding *building, const EnfDoors *passable);

// Frees what finds ways, or nothing.
void enf_paths_free(EnfPaths *paths);

// The shortest way between two points through portals that are open in `doors`, too; null: all are. The buffer takes where it starts, where it
// passes each portal, and where it ends. ENF_STATUS_NOTHING: a point is in no cell, or there is no way.
//
// # Safety
//
// `buffer` has room for `capacity` points.
EnfStatus enf_paths_find(EnfPaths *paths,
                         const EnfDoors *doors,
                         EnfVec3 from,
                         EnfVec3 to,
                         EnfPath *path,
                         EnfVec3 *buffer,
                         size_t capacity,
                         size_t *count);

// The rows of bodies that go so many metres at most through what is open in `passable`; null: all but windows. Null if that fails.
EnfRelevance *enf_relevance_new(const EnfBuilding *building, double metres, const EnfDoors *passable);

// The rows that are in the building's file. Null if there are none.
EnfRelevance *enf_relevance_of_file(const EnfBuilding *building);

// Frees rows, or nothing.
void enf_relevance_free(EnfRelevance *relevance);

// Whether a body in some cells, or as far from them as bodies go, may see something in others (`enf_movers_cells`). No cells: anywhere, so it
// may.
//
// # Safety
//
// The lists have as many items as the counts say.
EnfStatus enf_relevance_may_see(const EnfRelevance *relevance,
                                const uint32_t *from,
                                size_t from_count,
                                const uint32_t *to,
                                size_t to_count,
                                bool *may);

// Whether something in some cells may be seen from others now. With the cells of `enf_view_within_metres`, for servers.
//
// # Safety
//
// The lists have as many items as the counts say.
EnfStatus enf_building_may_see(const EnfBuilding *building,
                               const uint32_t *from,
                               size_t from_count,
                               const uint32_t *to,
                               size_t to_count,
                               bool *may);

// The cells that a body may get into from its box within so many metres, through open portals; those that the box meets come first.
//
// # Safety
//
// `buffer` has room for `capacity` cells.
EnfStatus enf_view_within_metres(EnfView *view, EnfBox bounds, double metres, uint32_t *buffer, size_t capacity, size_t *count);

// A camera at `eye` that looks at `target`, upright while it can be. `fov_y` is the vertical angle in radians, in (0, pi); `aspect` is width
// over height.
EnfStatus enf_camera_look_at(EnfVec3 eye,
                             EnfVec3 target,
                             float fov_y,
                             float aspect,
                             EnfCamera *camera);

// An orthographic camera that looks from `eye` to `target` and shows `width` by `height` metres.
EnfStatus enf_camera_orthographic(EnfVec3 eye, EnfVec3 target, float width, float height, EnfCamera *camera);

// The camera of an engine's matrix: view, then projection, 16 numbers, column by column, for columns of points. Depth is as the engine wants
// it. `eye` is where the camera is; it and the matrix are in the engine's axes, relative to the building's origin.
//
// # Safety
//
// `view_projection` is null or has 16 numbers.
EnfStatus enf_camera_from_matrix(EnfAxes axes,
                                 EnfVec3 eye,
                                 const float *view_projection,
                                 EnfCamera *camera);

// A view with all doors open. Null if the building is.
EnfView *enf_view_new(const EnfBuilding *building);

// Frees a view, or nothing.
void enf_view_free(EnfView *view);

// Takes the states of the doors, for later frames.
EnfStatus enf_view_set_doors(EnfView *view, const EnfDoors *doors);

// Leaves out what covers fewer than `pixels` in pictures of `width` by `height`; 0: nothing.
EnfStatus enf_view_set_min_pixels(EnfView *view, uint32_t pixels, uint32_t width, uint32_t height);

// Culls a frame. `frame` takes its counters, and may be null. Ask for the lists afterwards.
EnfStatus enf_view_cull(EnfView *view, const EnfCamera *camera, EnfMode mode, EnfFrame *frame);

// The objects of the last frame, each once.
//
// # Safety
//
// `buffer` has room for `capacity` objects.
EnfStatus enf_view_objects(EnfView *view, uint32_t *buffer, size_t capacity, size_t *count);

// The objects of the last frame as ranges of an index buffer, ascending, neighbours joined: one draw each.
//
// # Safety
//
// `buffer` has room for `capacity` runs.
EnfStatus enf_view_runs(EnfView *view, EnfRun *buffer, size_t capacity, size_t *count);

// The cells that the last frame reached, the eye's first.
//
// # Safety
//
// `buffer` has room for `capacity` cells.
EnfStatus enf_view_cells(EnfView *view, uint32_t *buffer, size_t capacity, size_t *count);

// The cells that the eye of the last frame was in: several on a border, none outside of all.
//
// # Safety
//
// `buffer` has room for `capacity` cells.
EnfStatus enf_view_homes(EnfView *view, uint32_t *buffer, size_t capacity, size_t *count);

// The portals that the last frame saw through, nearest first.
//
// # Safety
//
// `buffer` has room for `capacity` portals.
EnfStatus enf_view_portals(EnfView *view, EnfCrossed *buffer, size_t capacity, size_t *count);

// The shut doors that counted as open in the last frame, since the eye is in their doorway.
//
// # Safety
//
// `buffer` has room for `capacity` portals.
EnfStatus enf_view_near_doors(EnfView *view, uint32_t *buffer, size_t capacity, size_t *count);

// The movers that the last frame may show, each once.
//
// # Safety
//
// `buffer` has room for `capacity` movers.
EnfStatus enf_view_movers(EnfView *view, const EnfMovers *movers, EnfMover *buffer, size_t capacity, size_t *count);

// The objects that may be seen from a point in any direction: for engines with a frustum test of their own. `is_new` may be null; false: the
// same as last time.
//
// # Safety
//
// `buffer` has room for `capacity` objects.
EnfStatus enf_view_around(EnfView *view,
                          EnfVec3 eye,
                          bool *is_new,
                          uint32_t *buffer,
                          size_t capacity,
                          size_t *count);

// The objects in a convex volume, with cells in `from` only those of these cells' rows: for shadows. Ascending.
//
// # Safety
//
// The lists have as many items as the counts say, and `buffer` has room for `capacity` objects.
EnfStatus enf_view_in_volume(EnfView *view,
                             const EnfPlane *planes,
                             size_t plane_count,
                             const uint32_t *from,
                             size_t from_count,
                             uint32_t *buffer,
                             size_t capacity,
                             size_t *count);

// The movers in a convex volume, likewise.
//
// # Safety
//
// The lists have as many items as the counts say, and `buffer` has room for `capacity` movers.
EnfStatus enf_view_movers_in_volume(EnfView *view,
                                    const EnfMovers *movers,
                                    const EnfPlane *planes,
                                    size_t plane_count,
                                    const uint32_t *from,
                                    size_t from_count,
                                    EnfMover *buffer,
                                    size_t capacity,
                                    size_t *count);

// A world without modules.
EnfWorld *enf_world_new(void);

// Frees a world, or nothing.
void enf_world_free(EnfWorld *world);

// Adds a building as a module, joined to none; a building may stand several times.
EnfStatus enf_world_place(EnfWorld *world, const EnfBuilding *building, const EnfPlacement *placement, EnfModule *module);

// Parts all joins of a module, and removes it.
EnfStatus enf_world_remove(EnfWorld *world, EnfModule module);

// Joins two portals that lead outside and lie on each other (`enf_building_ways_in`): a view goes on in the other module.
EnfStatus enf_world_join(EnfWorld *world, EnfModule module, uint32_t portal, EnfModule other, uint32_t other_portal);

// Parts a portal that is joined: both lead outdoors again.
EnfStatus enf_world_part(EnfWorld *world, EnfModule module, uint32_t portal);

// The portals of a building that lead outside, ascending: those by which modules are joined.
//
// # Safety
//
// `buffer` has room for `capacity` portals.
EnfStatus enf_building_ways_in(const EnfBuilding *building, uint32_t *buffer, size_t capacity, size_t *count);

// A view of worlds, with all doors open.
EnfWorldView *enf_world_view_new(void);

// Frees a view, or nothing.
void enf_world_view_free(EnfWorldView *view);

// Takes the states of a module's doors, for later frames.
EnfStatus enf_world_view_set_doors(EnfWorldView *view, const EnfWorld *world, EnfModule module, const EnfDoors *doors);

// Culls a frame. The camera is in the world's coordinates. Ask for the lists afterwards.
EnfStatus enf_world_view_cull(EnfWorldView *view, const EnfWorld *world, const EnfCamera *camera, EnfMode mode);

// The modules that the last frame may show, those of the eye first.
//
// # Safety
//
// `buffer` has room for `capacity` modules.
EnfStatus enf_world_view_modules(const EnfWorldView *view, EnfModule *buffer, size_t capacity, size_t *count);

// The objects of a module that the last frame may show, each once.
//
// # Safety
//
// `buffer` has room for `capacity` objects.
EnfStatus enf_world_view_objects(EnfWorldView *view, EnfModule module, uint32_t *buffer, size_t capacity, size_t *count);

// The same as ranges of the module's index buffer, ascending, neighbours joined: one draw each.
//
// # Safety
//
// `buffer` has room for `capacity` runs.
EnfStatus enf_world_view_runs(EnfWorldView *view, EnfModule module, EnfRun *buffer, size_t capacity, size_t *count);

// The movers of a module that the last frame may show, each once.
//
// # Safety
//
// `buffer` has room for `capacity` movers.
EnfStatus enf_world_view_movers(EnfWorldView *view,
                                EnfModule module,
                                const EnfMovers *movers,
                                EnfMover *buffer,
                                size_t capacity,
                                size_t *count);

#ifdef __cplusplus
}  // extern "C"
#endif  // __cplusplus

#endif  /* ENFILADE_H */

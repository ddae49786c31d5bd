/* Counts what frames allocate after the first of each kind: allocations FILE.pvs. Linked with --wrap, so that calls of the library count. */
#include "enfilade.h"
#include <stdio.h>
#include <stdlib.h>

static size_t count;
void *__real_malloc(size_t);
void *__real_calloc(size_t, size_t);
void *__real_realloc(void *, size_t);
int __real_posix_memalign(void **, size_t, size_t);
void *__wrap_malloc(size_t bytes) { return count++, __real_malloc(bytes); }
void *__wrap_calloc(size_t items, size_t bytes) { return count++, __real_calloc(items, bytes); }
void *__wrap_realloc(void *old, size_t bytes) { return count++, __real_realloc(old, bytes); }
int __wrap_posix_memalign(void **at, size_t align, size_t bytes) { return count++, __real_posix_memalign(at, align, bytes); }

enum { MOST = 1 << 16, MOVERS = 64 };
static uint32_t list[MOST];
static EnfRun runs[MOST];
static EnfCrossed crossed[MOST];
static EnfMover seen[MOVERS], ids[MOVERS];

static void need(EnfStatus status) {
  if (status != ENF_STATUS_OK) fprintf(stderr, "%s\n", enf_last_error()), exit(1);
}

int main(int argc, char **argv) {
  EnfBuilding *building = enf_building_open(argc > 1 ? argv[1] : "");
  if (!building || count == 0) return fprintf(stderr, "%s\n", enf_last_error()), 2;
  EnfView *view = enf_view_new(building);
  EnfMovers *movers = enf_movers_new(building);
  EnfDoors *doors = enf_doors_as_found(building);
  for (int i = 0; i < MOVERS; i++) need(enf_movers_insert(movers, (EnfBox){{0, 0, 0}, {1, 1, 1}}, &ids[i]));
  /* The same building in a world, twice. */
  EnfWorld *world = enf_world_new();
  EnfWorldView *world_view = enf_world_view_new();
  EnfModule modules[2], shown[2];
  for (int i = 0; i < 2; i++) {
    EnfPlacement placement = {{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 1000.0 * i, 0, 0, 1}};
    need(enf_world_place(world, building, &placement, &modules[i]));
  }
  size_t before = 0, n;
  /* Each module has its first frame. */
  EnfCamera any;
  need(enf_camera_look_at((EnfVec3){0, 1, 0}, (EnfVec3){1, 1, 0}, 1, 1.5f, &any));
  need(enf_world_view_cull(world_view, world, &any, ENF_MODE_NONE));
  for (int i = 0; i < 2; i++) need(enf_world_view_movers(world_view, modules[i], movers, seen, MOVERS, &n));
  for (int frame = 0; frame < 2000; frame++) {
    if (frame == 1) before = count;
    float x = (float)(frame % 50) * 0.4f, z = (float)(frame / 50) * 0.4f - 4;
    EnfVec3 eye = {x, 1.5f, z};
    EnfCamera camera;
    need(enf_camera_look_at(eye, (EnfVec3){x + 1, 1.4f, z + (float)(frame % 3) - 1}, 1, 1.5f, &camera));
    for (int i = 0; i < MOVERS; i++) {
      EnfVec3 at = {x + (float)i * 0.3f, 1, z};
      need(enf_movers_set(movers, ids[i], (EnfBox){at, {at.x + 0.5f, 2, at.z + 0.5f}}));
    }
    need(enf_view_set_doors(view, doors));
    need(enf_view_cull(view, &camera, ENF_MODE_BOTH, NULL));
    need(enf_view_objects(view, list, MOST, &n));
    need(enf_view_runs(view, runs, MOST, &n));
    need(enf_view_cells(view, list, MOST, &n));
    need(enf_view_homes(view, list, MOST, &n));
    need(enf_view_portals(view, crossed, MOST, &n));
    need(enf_view_near_doors(view, list, MOST, &n));
    need(enf_view_movers(view, movers, seen, MOVERS, &n));
    need(enf_view_around(view, eye, NULL, list, MOST, &n));
    need(enf_view_in_volume(view, (EnfPlane[]){{1, 0, 0, x}, {0, 0, 1, z}}, 2, NULL, 0, list, MOST, &n));
    need(enf_world_view_set_doors(world_view, world, modules[0], doors));
    need(enf_world_view_cull(world_view, world, &camera, ENF_MODE_BOTH));
    size_t seen_modules;
    need(enf_world_view_modules(world_view, shown, 2, &seen_modules));
    for (size_t i = 0; i < seen_modules; i++) {
      need(enf_world_view_runs(world_view, shown[i], runs, MOST, &n));
      need(enf_world_view_movers(world_view, shown[i], movers, seen, MOVERS, &n));
    }
  }
  printf("%zu allocations before frames, %zu in them\n", before, count - before);
  enf_world_view_free(world_view), enf_world_free(world);
  enf_movers_free(movers), enf_doors_free(doors), enf_view_free(view), enf_building_free(building);
  return count == before ? 0 : 1;
}

/* What a careless caller does: abuse FILE.pvs. Each call must answer with a status and a text, and nothing else may happen. */
#include "enfilade.h"
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static int calls;

static void expect(EnfStatus status, EnfStatus expected, const char *what) {
  calls++;
  if (status != expected || (status != ENF_STATUS_OK && enf_last_error()[0] == 0)) {
    fprintf(stderr, "%s: status %d, not %d: %s\n", what, status, expected, enf_last_error());
    exit(1);
  }
}
#define EXPECT(expected, call) expect(call, ENF_STATUS_##expected, #call)

static void use(EnfBuilding *building) {
  EnfView *view = enf_view_new(building);
  EnfBuildingInfo info;
  EXPECT(OK, enf_building_info(building, &info));
  EnfVec3 eye = {0.5f, 1.5f, 0.5f}, target = {3, 1, 2};
  EnfCamera camera;
  EXPECT(OK, enf_camera_look_at(eye, target, 1, 1, &camera));
  EXPECT(OK, enf_view_cull(view, &camera, ENF_MODE_BOTH, NULL));
  enf_view_free(view);
}

static void damaged(const uint8_t *bytes, size_t length) {
  uint8_t *copy = malloc(length);
  int read = 0, refused = 0;
  for (size_t i = 0; i < 400; i++) {
    size_t at = (i * 7919 + i * i * 31) % length;
    memcpy(copy, bytes, length);
    copy[at] ^= (uint8_t)(1 + i % 255);
    EnfBuilding *building = enf_building_read(copy, i % 3 == 0 ? at : length);
    if (building) {
      use(building);
      read++;
    } else {
      if (enf_last_error()[0] == 0) exit(1);
      refused++;
    }
    enf_building_free(building);
  }
  free(copy);
  printf("%d damaged files read, %d refused\n", read, refused);
  if (refused == 0) exit(1);
}

int main(int argc, char **argv) {
  if (argc < 2 || enf_version() == 0 || enf_last_error()[0] != 0) return 2;
  FILE *file = fopen(argv[1], "rb");
  if (!file) return 2;
  fseek(file, 0, SEEK_END);
  size_t length = (size_t)ftell(file);
  rewind(file);
  uint8_t *bytes = malloc(length);
  if (fread(bytes, 1, length, file) != length) return 2;
  fclose(file);

  /* Nothing at all. */
  size_t count = 1;
  uint32_t number;
  EnfBuildingInfo info;
  EnfCamera camera;
  EnfMover mover = {7, 7};
  EnfVec3 zero = {0, 0, 0};
  EnfBox flat = {{1, 0, 0}, {0, 0, 0}}, box = {{0, 0, 0}, {1, 1, 1}};
  if (enf_building_open(NULL) || enf_building_open("no such file") || enf_building_read(NULL, 5) || enf_building_read(bytes, 0)) return 1;
  if (enf_view_new(NULL) || enf_doors_new(NULL) || enf_movers_new(NULL) || enf_loader_new(NULL, NULL, 0, 0)) return 1;
  enf_building_free(NULL), enf_view_free(NULL), enf_doors_free(NULL), enf_movers_free(NULL), enf_mirrors_free(NULL), enf_loader_free(NULL);
  EXPECT(NULL, enf_building_info(NULL, &info));
  EXPECT(NULL, enf_view_cull(NULL, &camera, ENF_MODE_BOTH, NULL));
  EXPECT(NULL, enf_view_objects(NULL, NULL, 0, &count));
  EXPECT(NULL, enf_doors_set_open(NULL, 0, true));
  EXPECT(NULL, enf_movers_set(NULL, mover, box));
  EXPECT(ARGUMENT, enf_camera_look_at(zero, zero, NAN, 1, &camera));
  EXPECT(NULL, enf_camera_from_matrix(ENF_AXES_Y_UP, zero, NULL, &camera));
  float matrix[16] = {0};
  EXPECT(ARGUMENT, enf_camera_from_matrix(ENF_AXES_Y_UP, zero, matrix, &camera));
  EXPECT(ARGUMENT, enf_camera_from_matrix(99, zero, matrix, &camera));

  /* Two buildings. */
  EnfBuilding *building = enf_building_read(bytes, length), *other = enf_building_open(argv[1]);
  if (!building || !other) return 1;
  EXPECT(NULL, enf_building_info(building, NULL));
  EXPECT(OK, enf_building_info(building, &info));
  EXPECT(ARGUMENT, enf_building_indices(building, info.objects, &(EnfRun){0, 0}));
  EXPECT(ARGUMENT, enf_building_cell_lines(building, info.cells, NULL, 0, &count));
  EXPECT(NOTHING, enf_building_portal(building, "no such key", &number));
  EXPECT(NOTHING, enf_building_cell_of(building, (EnfVec3){NAN, NAN, NAN}, &number));
  EnfView *view = enf_view_new(building);
  EnfDoors *doors = enf_doors_new(other);
  EnfMovers *movers = enf_movers_new(building), *others = enf_movers_new(other);
  EnfMirrors *mirrors = enf_mirrors_new();
  EXPECT(OTHER_BUILDING, enf_view_set_doors(view, doors));
  EXPECT(ARGUMENT, enf_doors_set_open(doors, info.portals, true));
  EXPECT(ARGUMENT, enf_doors_set_see_through(doors, 0, 2, true));
  EXPECT(NOTHING, enf_view_objects(view, NULL, 0, &count));
  EXPECT(ARGUMENT, enf_view_cull(view, &(EnfCamera){0}, 5, NULL));
  EXPECT(OK, enf_camera_look_at((EnfVec3){0.5f, 1.5f, 0.5f}, (EnfVec3){3, 1, 2}, 1, 1, &camera));
  EXPECT(OK, enf_view_cull(view, &camera, ENF_MODE_NONE, NULL));
  EXPECT(TOO_SMALL, enf_view_objects(view, &number, 1, &count));
  if (count != info.objects) return 1;
  EXPECT(NULL, enf_view_objects(view, NULL, 9, &count));
  EXPECT(NULL, enf_view_objects(view, &number, (size_t)-1, &count));
  EXPECT(NULL, enf_view_objects(view, &number, 1, NULL));
  EXPECT(OTHER_BUILDING, enf_view_movers(view, others, NULL, 0, &count));
  EXPECT(ARGUMENT, enf_movers_insert(movers, flat, &mover));
  EXPECT(OK, enf_movers_insert(movers, box, &mover));
  EXPECT(OK, enf_movers_remove(movers, mover));
  EXPECT(ARGUMENT, enf_movers_remove(movers, mover));
  EXPECT(ARGUMENT, enf_movers_set(movers, mover, box));
  EXPECT(ARGUMENT, enf_movers_cells(movers, mover, NULL, 0, &count));
  EXPECT(ARGUMENT, enf_mirrors_add(mirrors, 0, &zero, 1));
  EnfVec3 corners[] = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}};
  EXPECT(OK, enf_mirrors_add(mirrors, info.cells, corners, 3));
  EnfReflections into = {0};
  EXPECT(ARGUMENT, enf_view_mirrors(view, mirrors, 2, NULL, &into));
  EnfPlane planes[1000] = {{0}};
  EXPECT(ARGUMENT, enf_view_in_volume(view, planes, 1000, NULL, 0, NULL, 0, &count));
  EXPECT(ARGUMENT, enf_view_in_volume(view, planes, 1, &info.cells, 1, NULL, 0, &count));
  /* Cameras of nonsense show something or nothing, and go on. */
  for (int mode = 0; mode < 5; mode++)
    for (int i = 0; i < 6; i++) {
      float odd[] = {NAN, INFINITY, -INFINITY, 0, 1e38f, -1e-38f};
      EnfVec3 v = {odd[i], odd[(i + mode) % 6], odd[i]};
      EXPECT(OK, enf_view_cull(view, &(EnfCamera){v, v, v, v}, (EnfMode)mode, NULL));
    }
  uint64_t *sizes = calloc(info.objects, sizeof *sizes);
  if (enf_loader_new(building, sizes, info.objects + 1, 100)) return 1;
  EnfLoader *loader = enf_loader_new(building, sizes, info.objects, 100);
  EXPECT(ARGUMENT, enf_loader_frame(loader, &camera, 0, &info.objects, 1, &count));
  EXPECT(OK, enf_loader_frame(loader, &camera, NAN, NULL, 0, &count));
  EnfStep step;
  while (enf_loader_next(loader, &step) == ENF_STATUS_OK)
    if (step.kind == ENF_STEP_LOAD) EXPECT(OK, enf_loader_loaded(loader, step.object));
  EXPECT(ARGUMENT, enf_loader_loaded(loader, info.objects));

  if (enf_paths_new(building, doors) || enf_relevance_new(building, NAN, NULL) || enf_relevance_of_file(NULL)) return 1;
  EnfPaths *paths = enf_paths_new(building, NULL);
  EnfRelevance *relevance = enf_relevance_new(building, 2, NULL);
  EnfPath path;
  bool may = false;
  EXPECT(NOTHING, enf_paths_find(paths, NULL, (EnfVec3){NAN, 0, 0}, zero, &path, NULL, 0, &count));
  EXPECT(OTHER_BUILDING, enf_paths_find(paths, doors, zero, zero, &path, NULL, 0, &count));
  EXPECT(ARGUMENT, enf_relevance_may_see(relevance, &info.cells, 1, &info.cells, 1, &may));
  EXPECT(NULL, enf_building_may_see(building, NULL, 1, NULL, 0, &may));
  EXPECT(OK, enf_relevance_may_see(relevance, NULL, 0, NULL, 0, &may));
  if (!may) return 1;
  enf_paths_free(paths), enf_relevance_free(relevance);

  EnfWorld *world = enf_world_new();
  EnfWorldView *world_view = enf_world_view_new();
  EnfPlacement placement = {{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1}}, sheared = {{1}};
  EnfModule module = {3, 3}, second = {0, 0};
  EXPECT(NULL, enf_world_place(world, NULL, &placement, &module));
  EXPECT(ARGUMENT, enf_world_place(world, building, &sheared, &module));
  EXPECT(ARGUMENT, enf_world_remove(world, module));
  EXPECT(OK, enf_world_place(world, building, &placement, &module));
  placement.matrix[12] = 500;
  EXPECT(OK, enf_world_place(world, building, &placement, &second));
  EXPECT(NULL, enf_building_ways_in(building, NULL, 9, &count));
  EXPECT(ARGUMENT, enf_world_join(world, module, info.portals, second, 0));
  EXPECT(ARGUMENT, enf_world_join(world, module, 0, second, 0));
  EXPECT(ARGUMENT, enf_world_part(world, module, 0));
  EXPECT(OTHER_BUILDING, enf_world_view_set_doors(world_view, world, module, doors));
  EXPECT(NOTHING, enf_world_view_objects(world_view, module, NULL, 0, &count));
  EXPECT(NULL, enf_world_view_cull(world_view, NULL, &camera, ENF_MODE_BOTH));
  EXPECT(ARGUMENT, enf_world_view_cull(world_view, world, &camera, 9));
  EXPECT(OK, enf_world_view_cull(world_view, world, &camera, ENF_MODE_NONE));
  EXPECT(TOO_SMALL, enf_world_view_objects(world_view, second, &number, 1, &count));
  EXPECT(OTHER_BUILDING, enf_world_view_movers(world_view, module, others, NULL, 0, &count));
  EXPECT(OK, enf_world_remove(world, module));
  EXPECT(ARGUMENT, enf_world_join(world, module, 0, second, 0));
  EXPECT(OK, enf_world_view_cull(world_view, world, &camera, ENF_MODE_BOTH));
  EXPECT(NOTHING, enf_world_view_runs(world_view, module, NULL, 0, &count));
  enf_world_free(world), enf_world_view_free(world_view);

  damaged(bytes, length);
  enf_loader_free(loader), enf_mirrors_free(mirrors), enf_movers_free(movers), enf_movers_free(others);
  enf_building_free(building), enf_doors_free(doors), enf_view_free(view), enf_building_free(other);
  free(sizes), free(bytes);
  printf("%d calls as they should be\n", calls);
  return 0;
}

/* Walks from portal to portal of a building and says in a line what each frame draws: walk FILE.pvs [ROUNDS]. With rounds, all frames are
   culled so often, and the mean is printed to stderr in nanoseconds. */
#include "enfilade.h"
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

static void need(bool is_well, const char *what) {
  if (!is_well) {
    fprintf(stderr, "%s: %s\n", what, enf_last_error());
    exit(2);
  }
}

static EnfVec3 middle(const EnfBuilding *building, uint32_t portal) {
  EnfLine lines[64];
  size_t count;
  EnfStatus status = enf_building_portal_lines(building, portal, lines, 64, &count);
  need(status == ENF_STATUS_OK || status == ENF_STATUS_TOO_SMALL, "lines");
  if (count > 64) count = 64;
  EnfVec3 sum = {0, 0, 0};
  for (size_t i = 0; i < count; i++) {
    sum.x += lines[i].from.x / (float)count;
    sum.y += lines[i].from.y / (float)count;
    sum.z += lines[i].from.z / (float)count;
  }
  return sum;
}

int main(int argc, char **argv) {
  need(argc > 1, "usage: walk FILE.pvs [ROUNDS]");
  int rounds = argc > 2 ? atoi(argv[2]) : 0;
  EnfBuilding *building = enf_building_open(argv[1]);
  need(building, "open");
  EnfView *view = enf_view_new(building);
  EnfDoors *doors = enf_doors_as_found(building);
  EnfMovers *movers = enf_movers_new(building);
  EnfPaths *paths = enf_paths_new(building, NULL);
  need(view && doors && movers && paths && enf_view_set_doors(view, doors) == ENF_STATUS_OK, "view");
  EnfBuildingInfo info;
  need(enf_building_info(building, &info) == ENF_STATUS_OK, "info");
  printf("%u objects, %u cells, %u portals\n", info.objects, info.cells, info.portals);
  uint32_t *objects = malloc(sizeof *objects * (info.objects + 1));
  EnfRun *runs = malloc(sizeof *runs * (info.objects + 1));
  EnfMover *seen = malloc(sizeof *seen * (info.portals + 1));
  EnfCamera *cameras = malloc(sizeof *cameras * (info.portals + 1));
  for (uint32_t p = 0; p < info.portals; p++) {
    EnfVec3 at = middle(building, p);
    EnfBox body = {{at.x - 0.2f, at.y - 0.2f, at.z - 0.2f}, {at.x + 0.2f, at.y + 0.2f, at.z + 0.2f}};
    EnfMover mover;
    need(enf_movers_insert(movers, body, &mover) == ENF_STATUS_OK, "insert");
  }
  EnfVec3 points[256];
  uint32_t frames = 0;
  for (uint32_t p = 0; p + 1 < info.portals; p++) {
    EnfVec3 eye = middle(building, p), target = middle(building, p + 1);
    if (enf_camera_look_at(eye, target, 1.2f, 1.5f, &cameras[frames]) != ENF_STATUS_OK) continue;
    EnfFrame frame;
    need(enf_view_cull(view, &cameras[frames], ENF_MODE_BOTH, &frame) == ENF_STATUS_OK, "cull");
    size_t count, run_count, mover_count, point_count;
    need(enf_view_objects(view, objects, info.objects, &count) == ENF_STATUS_OK, "objects");
    need(enf_view_runs(view, runs, info.objects, &run_count) == ENF_STATUS_OK, "runs");
    need(enf_view_movers(view, movers, seen, info.portals, &mover_count) == ENF_STATUS_OK, "movers");
    EnfPath path = {0, 0};
    EnfStatus found = enf_paths_find(paths, NULL, eye, target, &path, points, 256, &point_count);
    need(found == ENF_STATUS_OK || found == ENF_STATUS_NOTHING, "path");
    uint32_t sum = 0;
    for (size_t i = 0; i < count; i++) sum = sum * 31 + objects[i];
    printf("%u: %u cells, %u portals, %zu objects in %zu runs, %zu movers, %.3f m, %08x\n", p, (unsigned)frame.cells,
           (unsigned)frame.portals, count, run_count, mover_count, path.metres, sum);
    frames++;
  }
  struct timespec start, end;
  timespec_get(&start, TIME_UTC);
  for (int round = 0; round < rounds; round++)
    for (uint32_t i = 0; i < frames; i++) {
      size_t count;
      need(enf_view_cull(view, &cameras[i], ENF_MODE_BOTH, NULL) == ENF_STATUS_OK, "cull");
      need(enf_view_objects(view, objects, info.objects, &count) == ENF_STATUS_OK, "objects");
    }
  timespec_get(&end, TIME_UTC);
  double spent = (double)(end.tv_sec - start.tv_sec) * 1e9 + (double)(end.tv_nsec - start.tv_nsec);
  if (rounds > 0 && frames > 0) fprintf(stderr, "%.1f ns\n", spent / rounds / frames);
  free(objects), free(runs), free(seen), free(cameras);
  enf_paths_free(paths);
  enf_movers_free(movers);
  enf_doors_free(doors);
  enf_building_free(building);
  enf_view_free(view);
  return 0;
}

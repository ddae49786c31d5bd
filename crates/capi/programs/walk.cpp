// The walk of walk.c in C++17: walk FILE.pvs.
#include "enfilade.hpp"
#include <cstdio>

static EnfVec3 middle(const enfilade::Building &building, uint32_t portal) {
  auto lines = building.portal_lines(portal);
  if (lines.size() > 64) lines.resize(64);
  EnfVec3 sum = {0, 0, 0};
  for (const EnfLine &line : lines) {
    sum.x += line.from.x / float(lines.size());
    sum.y += line.from.y / float(lines.size());
    sum.z += line.from.z / float(lines.size());
  }
  return sum;
}

int main(int argc, char **argv) try {
  enfilade::Building building(argc > 1 ? argv[1] : "");
  enfilade::View view(building);
  enfilade::Movers movers(building);
  enfilade::Paths paths(building);
  auto info = building.info();
  std::printf("%u objects, %u cells, %u portals\n", info.objects, info.cells, info.portals);
  for (uint32_t p = 0; p < info.portals; p++) {
    EnfVec3 at = middle(building, p);
    movers.insert({{at.x - 0.2f, at.y - 0.2f, at.z - 0.2f}, {at.x + 0.2f, at.y + 0.2f, at.z + 0.2f}});
    if (building.portal(building.portal_key(p)) != p) throw std::runtime_error("a portal has another's key");
  }
  enfilade::Doors doors(building);
  if (info.portals > 0) doors.set_open(0, false);
  if (info.portals > 0 && doors.is_open(0, 1)) throw std::runtime_error("a shut door is open");
  view.set_doors(enfilade::Doors::as_found(building));
  for (uint32_t p = 0; p + 1 < info.portals; p++) {
    auto frame = view.cull(enfilade::look_at(middle(building, p), middle(building, p + 1), 1.2f, 1.5f), ENF_MODE_BOTH);
    uint32_t sum = 0;
    for (uint32_t object : view.objects()) sum = sum * 31 + object;
    std::printf("%u: %u cells, %u portals, %zu objects in %zu runs, %zu movers, %.3f m, %08x\n", p, unsigned(frame.cells),
                unsigned(frame.portals), view.objects().size(), view.runs().size(), view.movers(movers).size(),
                paths.metres(middle(building, p), middle(building, p + 1)), sum);
  }
} catch (const std::exception &error) {
  std::fprintf(stderr, "%s\n", error.what());
  return 2;
}

// The run time of Enfilade for C++17, over enfilade.h: handles that free themselves, lists as vectors that are used again, and faults as
// exceptions. Header only.
#ifndef ENFILADE_HPP
#define ENFILADE_HPP

#include "enfilade.h"
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace enfilade {

// What enf_last_error says of a call that failed.
struct Error : std::runtime_error {
  EnfStatus status;
  explicit Error(EnfStatus status) : std::runtime_error(enf_last_error()), status(status) {}
};

inline void check(EnfStatus status) {
  if (status != ENF_STATUS_OK) throw Error(status);
}

template <class T, void (*Free)(T *)> struct Handle {
  struct Deleter {
    void operator()(T *handle) const { Free(handle); }
  };
  std::unique_ptr<T, Deleter> handle;
  explicit Handle(T *made) : handle(made) {
    if (!made) throw Error(ENF_STATUS_NULL);
  }
  T *get() const { return handle.get(); }
};

// Fills a list by a call that takes a buffer, its capacity and a count; grows it where it is too small.
template <class T, class Call> void fill(std::vector<T> &list, Call call) {
  list.resize(list.capacity());
  size_t count = 0;
  EnfStatus status = call(list.data(), list.size(), &count);
  if (status == ENF_STATUS_TOO_SMALL) {
    list.resize(count);
    status = call(list.data(), list.size(), &count);
  }
  check(status);
  list.resize(count);
}

struct Building : Handle<EnfBuilding, enf_building_free> {
  explicit Building(const std::string &path) : Handle(enf_building_open(path.c_str())) {}
  Building(const uint8_t *bytes, size_t length) : Handle(enf_building_read(bytes, length)) {}

  EnfBuildingInfo info() const {
    EnfBuildingInfo info;
    check(enf_building_info(get(), &info));
    return info;
  }
  // True if the point is in a cell.
  bool cell_of(EnfVec3 point, uint32_t &cell) const {
    EnfStatus status = enf_building_cell_of(get(), point, &cell);
    if (status != ENF_STATUS_NOTHING) check(status);
    return status == ENF_STATUS_OK;
  }
  EnfRun indices(uint32_t object) const {
    EnfRun run;
    check(enf_building_indices(get(), object, &run));
    return run;
  }
  uint32_t portal(const std::string &key) const {
    uint32_t portal;
    check(enf_building_portal(get(), key.c_str(), &portal));
    return portal;
  }
  std::string portal_key(uint32_t portal) const {
    return text([=](char *b, size_t n, size_t *c) { return enf_building_portal_key(get(), portal, b, n, c); });
  }
  std::string object_name(uint32_t object) const {
    return text([=](char *b, size_t n, size_t *c) { return enf_building_object_name(get(), object, b, n, c); });
  }
  std::vector<EnfLine> portal_lines(uint32_t portal) const {
    std::vector<EnfLine> lines;
    fill(lines, [=](EnfLine *b, size_t n, size_t *c) { return enf_building_portal_lines(get(), portal, b, n, c); });
    return lines;
  }
  std::vector<EnfLine> cell_lines(uint32_t cell) const {
    std::vector<EnfLine> lines;
    fill(lines, [=](EnfLine *b, size_t n, size_t *c) { return enf_building_cell_lines(get(), cell, b, n, c); });
    return lines;
  }

private:
  template <class Call> static std::string text(Call call) {
    std::vector<char> bytes;
    fill(bytes, call);
    return std::string(bytes.data());
  }
};

struct Doors : Handle<EnfDoors, enf_doors_free> {
  // All open.
  explicit Doors(const Building &building) : Handle(enf_doors_new(building.get())) {}
  // Shut where the model has a shut leaf.
  static Doors as_found(const Building &building) { return Doors(enf_doors_as_found(building.get())); }
  void set_open(uint32_t portal, bool open) { check(enf_doors_set_open(get(), portal, open)); }
  bool is_open(uint32_t portal, uint32_t side) const {
    bool open;
    check(enf_doors_is_open(get(), portal, side, &open));
    return open;
  }

private:
  explicit Doors(EnfDoors *made) : Handle(made) {}
};

struct Movers : Handle<EnfMovers, enf_movers_free> {
  explicit Movers(const Building &building) : Handle(enf_movers_new(building.get())) {}
  EnfMover insert(EnfBox bounds) {
    EnfMover mover;
    check(enf_movers_insert(get(), bounds, &mover));
    return mover;
  }
  void set(EnfMover mover, EnfBox bounds) { check(enf_movers_set(get(), mover, bounds)); }
  void remove(EnfMover mover) { check(enf_movers_remove(get(), mover)); }
};

class Paths : public Handle<EnfPaths, enf_paths_free> {
  std::vector<EnfVec3> points_;

public:
  explicit Paths(const Building &building) : Handle(enf_paths_new(building.get(), nullptr)) {}
  // The length of the shortest way; 0 if there is none. Its points stay until the next call.
  double metres(EnfVec3 from, EnfVec3 to) {
    EnfPath path = {0, 0};
    EnfStatus status = ENF_STATUS_NOTHING;
    fill(points_, [&](EnfVec3 *b, size_t n, size_t *c) {
      status = enf_paths_find(get(), nullptr, from, to, &path, b, n, c);
      return status == ENF_STATUS_NOTHING ? ENF_STATUS_OK : status;
    });
    return status == ENF_STATUS_OK ? path.metres : 0;
  }
  const std::vector<EnfVec3> &points() const { return points_; }
};

inline EnfCamera look_at(EnfVec3 eye, EnfVec3 target, float fov_y, float aspect) {
  EnfCamera camera;
  check(enf_camera_look_at(eye, target, fov_y, aspect, &camera));
  return camera;
}

class View : public Handle<EnfView, enf_view_free> {
  std::vector<uint32_t> objects_, cells_, near_doors_;
  std::vector<EnfRun> runs_;
  std::vector<EnfMover> movers_;

public:
  explicit View(const Building &building) : Handle(enf_view_new(building.get())) {}
  void set_doors(const Doors &doors) { check(enf_view_set_doors(get(), doors.get())); }
  EnfFrame cull(const EnfCamera &camera, EnfMode mode) {
    EnfFrame frame;
    check(enf_view_cull(get(), &camera, mode, &frame));
    return frame;
  }
  // Lists of the last frame, until the next call of the same.
  const std::vector<uint32_t> &objects() {
    fill(objects_, [=](uint32_t *b, size_t n, size_t *c) { return enf_view_objects(get(), b, n, c); });
    return objects_;
  }
  const std::vector<EnfRun> &runs() {
    fill(runs_, [=](EnfRun *b, size_t n, size_t *c) { return enf_view_runs(get(), b, n, c); });
    return runs_;
  }
  const std::vector<uint32_t> &cells() {
    fill(cells_, [=](uint32_t *b, size_t n, size_t *c) { return enf_view_cells(get(), b, n, c); });
    return cells_;
  }
  const std::vector<uint32_t> &near_doors() {
    fill(near_doors_, [=](uint32_t *b, size_t n, size_t *c) { return enf_view_near_doors(get(), b, n, c); });
    return near_doors_;
  }
  const std::vector<EnfMover> &movers(const Movers &movers) {
    fill(movers_, [&](EnfMover *b, size_t n, size_t *c) { return enf_view_movers(get(), movers.get(), b, n, c); });
    return movers_;
  }
};

class World : public Handle<EnfWorld, enf_world_free> {
public:
  World() : Handle(enf_world_new()) {}
  // By columns: turned and moved.
  EnfModule place(const Building &building, const EnfPlacement &placement) {
    EnfModule module;
    check(enf_world_place(get(), building.get(), &placement, &module));
    return module;
  }
  void remove(EnfModule module) { check(enf_world_remove(get(), module)); }
  void join(EnfModule a, uint32_t portal, EnfModule b, uint32_t other) { check(enf_world_join(get(), a, portal, b, other)); }
  void part(EnfModule module, uint32_t portal) { check(enf_world_part(get(), module, portal)); }
};

class WorldView : public Handle<EnfWorldView, enf_world_view_free> {
  std::vector<EnfModule> modules_;
  std::vector<uint32_t> objects_;
  std::vector<EnfRun> runs_;
  std::vector<EnfMover> movers_;

public:
  WorldView() : Handle(enf_world_view_new()) {}
  void set_doors(const World &world, EnfModule module, const Doors &doors) {
    check(enf_world_view_set_doors(get(), world.get(), module, doors.get()));
  }
  // The modules that may be seen, those of the eye first.
  const std::vector<EnfModule> &cull(const World &world, const EnfCamera &camera, EnfMode mode) {
    check(enf_world_view_cull(get(), world.get(), &camera, mode));
    fill(modules_, [=](EnfModule *b, size_t n, size_t *c) { return enf_world_view_modules(get(), b, n, c); });
    return modules_;
  }
  // Lists of a module of the last frame, until the next call of the same.
  const std::vector<uint32_t> &objects(EnfModule module) {
    fill(objects_, [=](uint32_t *b, size_t n, size_t *c) { return enf_world_view_objects(get(), module, b, n, c); });
    return objects_;
  }
  const std::vector<EnfRun> &runs(EnfModule module) {
    fill(runs_, [=](EnfRun *b, size_t n, size_t *c) { return enf_world_view_runs(get(), module, b, n, c); });
    return runs_;
  }
  const std::vector<EnfMover> &movers(EnfModule module, const Movers &movers) {
    fill(movers_, [&](EnfMover *b, size_t n, size_t *c) { return enf_world_view_movers(get(), module, movers.get(), b, n, c); });
    return movers_;
  }
};

} // namespace enfilade

#endif // ENFILADE_HPP

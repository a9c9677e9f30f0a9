// SPDX-License-Identifier: Apache-2.0
// Built with AddressSanitizer and UndefinedBehaviorSanitizer, whatever the rest is built with.
#include <gtest/gtest.h>

#include "hexmesh/core/error.h"
#include "hexmesh/file/lattice_file.h"
#include "hexmesh/file/result_file.h"
#include "support/files.h"
#include "support/forms.h"
#include "support/small_lattice.h"

using namespace hexmesh;
using namespace testing_support;

/// HDF5 itself leaks where it refuses a file.
extern "C" const char* __asan_default_options() { return "detect_leaks=0"; }

namespace {

/// All that a reader gives, as one text.
std::string content(const Lattice& l) {
  std::string text;
  const auto add = [&](const auto& values) {
    if (!values.empty()) text.append(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(values[0]));
    text += '|';
  };
  const auto add_vector = [&](const Vec3& v) { text.append(reinterpret_cast<const char*>(v.data()), sizeof(Vec3)); };
  add_vector(l.voxels.origin());
  add_vector(l.voxels.spacing());
  for (int d = 0; d < 3; ++d) add_vector(l.voxels.direction().col(d));
  add(l.labels);
  for (const LatticeSegment& s : l.segments) {
    text += s.segment.name + '|' + s.source + '|' + std::to_string(s.segment.label) + std::to_string(s.num_voxels);
    add(s.segment.color);
    if (s.material) text += std::to_string(s.material->young) + std::to_string(s.material->poisson);
  }
  for (const VoxelMaterial& m : l.materials) add(std::vector{m.material.young, m.material.poisson, m.material.density});
  for (const Level& level : l.levels) {
    add(level.cells);
    add(level.element);
    add(level.segment);
    add(level.parts);
    add(level.children);
    add(std::vector{level.merge, level.voxels_per_cell});
  }
  if (l.faces)
    for (const ExposedFace& face : l.faces->all()) {
      add(face.voxel);
      text += std::to_string(face.side) + '|' + std::to_string(face.neighbour);
    }
  for (const Vec3& p : l.surface.points) add_vector(p);
  add(l.surface.triangles);
  add(l.surface.segment);
  for (const std::string& line : l.history) text += line + '|';
  return text;
}

std::string content(const std::vector<Vec3>& points) {
  std::string text;
  for (const Vec3& p : points) text.append(reinterpret_cast<const char*>(p.data()), sizeof(Vec3));
  return text;
}

std::string content(const Result& r) {
  Lattice l{r.voxels, r.labels, r.segments, {}, {}, r.surface, r.history};
  Level level;
  level.cells = r.cells;
  level.segment = r.segment;
  level.voxels_per_cell = r.voxels_per_cell;
  l.levels = {level};
  std::string text = content(l) + r.report + std::to_string(r.level);
  for (const CellNodes& n : r.cell_nodes) text.append(reinterpret_cast<const char*>(n.data()), sizeof(n));
  for (const auto& points : {r.nodes, r.displacement, r.velocity, r.contact_force, r.surface_displacement})
    text += content(points);
  for (const auto& [name, values] : r.cell_fields) {
    text += name;
    for (const double v : values) text += std::to_string(v);
  }
  for (const ConditionPoints& c : r.conditions) text += c.name + std::to_string(c.points.size());
  return text;
}

/// Every byte flipped (in the full form) and the file cut everywhere: refused by name, or read as it was.
template <class Read>
void damage(const std::string& name, const TemporaryFolder& folder, Read&& read) {
  const std::string bytes = read_text(folder / name);
  const std::string expected = read(folder / name);
  std::size_t refused = 0, harmless = 0;
  const auto try_one = [&](const std::string& damaged, const std::string& what) {
    write_text(folder / "damaged", damaged);
    try {
      EXPECT_EQ(read(folder / "damaged"), expected) << what;
      ++harmless;
    } catch (const Error& e) {
      EXPECT_NE(std::string(e.what()).find("damaged"), std::string::npos) << what << ": " << e.what();
      ++refused;
    }
  };
  for (std::size_t size = 0; size < bytes.size(); size += 1 + bytes.size() / 150)
    try_one(bytes.substr(0, size), "cut to " + std::to_string(size));
  EXPECT_EQ(harmless, 0U) << "cut files";
  // In the short form one in twenty-nine, which meets every place of a word.
  for (std::size_t at = 0; at < bytes.size(); at += whole_or<std::size_t>(1, 29)) {
    std::string damaged = bytes;
    damaged[at] = static_cast<char>(damaged[at] ^ 0x55);
    try_one(damaged, "byte " + std::to_string(at));
  }
  printf("%zu bytes: %zu damaged files refused, %zu read as they were (bytes that hold nothing)\n", bytes.size(),
         refused, harmless);
}

}  // namespace

TEST(DamagedFiles, LatticesAreRefusedOrReadRight) {
  const TemporaryFolder folder;
  write_lattice(small_lattice(), folder / "lattice", MatrixStorage::none);
  damage("lattice", folder, [](const auto& path) { return content(read_lattice(path)); });
}

TEST(DamagedFiles, ResultsAreRefusedOrReadRight) {
  const TemporaryFolder folder;
  write_small_result(folder / "result");
  damage("result", folder, [](const auto& path) {
    const Result read = read_result(path);
    const MotionStep step = read_step(path, read, 0);
    return content(read) + content(step.displacement) + content(step.velocity) + content(step.contact_force) +
           std::to_string(step.cell_fields.at("fill").back()) + std::to_string(read.times.at(0));
  });
}

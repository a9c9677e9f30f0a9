// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include "hexmesh/core/error.h"
#include "hexmesh/core/memory.h"
#include "hexsolver/plan/plan.h"

namespace hexsolver {

int fit_into_memory(const hexmesh::Lattice& lattice, int finest, Scene& scene, std::string& note) {
  const double allowed = 1e-6 * hexmesh::memory_left();
  const auto expected = [&](int level) {
    return static_cast<double>(expected_bytes(lattice, scene, level)) / (1 << 20);
  };
  const double fastest = expected(finest);
  if (fastest <= allowed) return finest;
  scene.saves_memory = true;
  int level = finest;
  const int most = scene.is_open_ended() ? lattice.num_levels() - 1 : finest;
  while (level < most && expected(level) > allowed) ++level;
  const std::string what = fmt::format("level {} ({} cells) would take about {:.3g} MB", finest,
                                       lattice.level(finest).cells.size(), fastest);
  if (expected(level) > allowed)
    throw hexmesh::Error(
        hexmesh::ErrorKind::input,
        fmt::format("{}, {:.3g} MB at the least, expected at most {:.3g} MB that are left ({}): solve a coarser level",
                    what, expected(level), allowed, hexmesh::name_of_memory_limit()));
  note = fmt::format("{}: to save memory it takes longer{}", what,
                     level > finest ? fmt::format(", and level {} is the finest", level) : "");
  return level;
}

}  // namespace hexsolver

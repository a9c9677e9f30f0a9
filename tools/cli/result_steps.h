// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <set>

#include "hexmesh/file/result_file.h"
#include "hexmesh/lattice/embedded_points.h"

namespace hextools {

/// The result of a motion as it was at each of its steps; of the cell fields those that steps have, or do not change.
class ResultSteps {
public:
  /// @param path, result  the file and what was read from it; both must outlive this
  /// @param magnified     what displacements are multiplied by
  ResultSteps(const std::filesystem::path& path, const hexmesh::Result& result, double magnified = 1)
      : path_(path),
        result_(result),
        magnified_(magnified),
        now_(result),
        surface_(hexmesh::locator_of(result), result.cell_nodes, result.surface, result.parting, result.labels) {
    const std::set<std::string> constant = {"fill", "parts", "young_modulus", "poisson_ratio", "island", "cell_level"};
    std::erase_if(now_.cell_fields, [&](const auto& field) { return !constant.contains(field.first); });
  }

  /// Valid until the next call.
  const hexmesh::Result& at(std::size_t number) {
    hexmesh::MotionStep step = hexmesh::read_step(path_, result_, number);
    now_.displacement = std::move(step.displacement);
    for (hexmesh::Vec3& u : now_.displacement) u *= magnified_;
    now_.velocity = std::move(step.velocity);
    now_.contact_force = std::move(step.contact_force);
    for (auto& [name, values] : step.cell_fields) now_.cell_fields[name] = std::move(values);
    surface_.interpolate({now_.displacement.front().data(), 3 * now_.displacement.size()}, now_.surface_displacement);
    return now_;
  }

private:
  const std::filesystem::path& path_;
  const hexmesh::Result& result_;
  double magnified_;
  hexmesh::Result now_;
  hexmesh::EmbeddedPoints surface_;
};

}  // namespace hextools

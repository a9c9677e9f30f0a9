// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <fmt/format.h>

#include <cmath>
#include <span>
#include <string>

#include "hdf5.h"
#include "hexmesh/core/grid.h"

/// How large numbers of a file may be: far beyond any organ, and far from where arithmetic ends.
namespace hexmesh::hdf5 {

inline constexpr double most_displacement = 1e9;  ///< [mm]
inline constexpr double most_velocity = 1e12;     ///< [mm/s]
inline constexpr double most_load = 1e12;         ///< [N]
inline constexpr double most_field = 1e30;        ///< of cell fields, in their units
inline constexpr double most_time = 1e12;         ///< [s]

/// @throws Error{input} naming the first value that is not finite or beyond +-`most`
template <class Value>
void check_values(const Reader& file, const std::string& name, std::span<const Value> values, double most) {
  const auto is_good = [most](double v) { return std::abs(v) <= most; };  // NaN is not
  bool all_good = true;
  for (const Value& v : values) all_good &= is_good(v);  // without a branch: the compiler takes several at once
  if (all_good) return;
  for (std::size_t n = 0; n < values.size(); ++n)
    if (!is_good(values[n]))
      file.fail(fmt::format("has {} in '{}', value {}, expected within +-{:g}", values[n], name, n, most));
}

inline void check_values(const Reader& file, const std::string& name, const std::vector<Vec3>& values, double most) {
  if (!values.empty())
    check_values(file, name, std::span<const double>(values.front().data(), 3 * values.size()), most);
}

/// Points that belong to a body: within its box, or as far from it as this is across and 10 mm more.
void check_places(const Reader& file, const std::string& name, const std::vector<Vec3>& points, const Grid& voxels);

}  // namespace hexmesh::hdf5

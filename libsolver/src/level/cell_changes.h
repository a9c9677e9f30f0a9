// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <limits>

#include "hexmesh/file/result_file.h"
#include "hexsolver/report/report.h"

namespace hexsolver {

/// Where the law or the state have no meaning. Volumes are in cells, each by how much of it is filled.
struct CellChanges {
  std::size_t cells = 0;     ///< that these are counted of
  std::size_t strained = 0;  ///< beyond what Hooke's law is meant for
  std::size_t turned = 0;    ///< beyond what small strain is meant for
  std::size_t inverted = 0;
  std::size_t inverted_voxels = 0;
  double volume = 0, gained = 0;  ///< at rest, and since
  /// Of nearly incompressible material: gained in all, and without that Hooke's law resists it, whose tr strain is not
  /// the change of volume; the part of it where that is much.
  double kept_volume = 0, kept_gained = 0, unresisted = 0, much_unresisted = 0;
  double least_jacobian = std::numeric_limits<double>::infinity();
  double least_ratio = std::numeric_limits<double>::infinity(), largest_ratio = 0;  ///< of a cell's volumes

  /// Members that are sums, and those that are least or largest: for those who count apart.
  template <class Sum, class Least, class Largest>
  CellChanges combined(const Sum& sum, const Least& least, const Largest& largest) const {
    CellChanges all = *this;
    for (std::size_t CellChanges::*count : {&CellChanges::cells, &CellChanges::strained, &CellChanges::turned,
                                            &CellChanges::inverted, &CellChanges::inverted_voxels})
      all.*count = sum(this->*count);
    for (double CellChanges::*part :
         {&CellChanges::volume, &CellChanges::gained, &CellChanges::kept_volume, &CellChanges::kept_gained,
          &CellChanges::unresisted, &CellChanges::much_unresisted})
      all.*part = sum(this->*part);
    all.least_jacobian = least(least_jacobian);
    all.least_ratio = least(least_ratio);
    all.largest_ratio = largest(largest_ratio);
    return all;
  }
};

/// @param result       a state with measures
/// @param first, count  cells that count
CellChanges count_changes(const hexmesh::Result& result, std::size_t first, std::size_t count);

/// Into the report, with warnings.
void report_changes(const CellChanges& changes, SolveReport& report);

}  // namespace hexsolver

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "terms/corotational.h"

namespace hexsolver {

/// Which cells of a motion are co-rotated, and with which R: "Automatic strain" and "Cells that turn inside out" of
/// THEORY.md. Of cells that have no R nothing is done.
class CellRotations {
public:
  /// @param finds  cells are straight until one has to rotate
  CellRotations(ElasticCells& cells, bool finds)
      : cells_(dynamic_cast<CorotationalCells*>(&cells)), finds_(finds && cells_), are_straight_(finds_) {}

  bool have_to_begin(const NodeVector& u) const;  ///< whether a cell is to rotate at u and does not
  void begin(double time);                        ///< all cells rotate, for good

  /// Cells that are nearly flat or inside out at u keep their R.
  /// @param tried  what a step from u came to that could not be solved: those there as well; null: u was reached
  /// @returns whether more do than before
  bool hold(const NodeVector& u, const NodeVector* tried);
  void let_go();  ///< of every R that a cell kept
  std::size_t num_held() const noexcept { return cells_ ? cells_->num_held() : 0; }

  bool finds() const noexcept { return finds_; }
  std::optional<double> since() const { return since_; }  ///< of cells that were straight before [s]

private:
  CorotationalCells* cells_;
  bool finds_, are_straight_;
  std::optional<double> since_;
};

}  // namespace hexsolver

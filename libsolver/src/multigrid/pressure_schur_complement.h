// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "kernels/pressure_step.h"
#include "multigrid/cell_rows.h"

namespace hexsolver {

/// The pressure Schur complement S = B D^-1 B^T, row c of B a vector of cell c at its nodes, D in blocks (3, 3) per
/// node: between cells that share a node. What it is multiplied with stands in a box around the mesh, each cell at its
/// place, so that eight cells in a row and all around them are read as they stand. Places without a cell hold 0.
template <class Real>
class PressureSchurComplement {
public:
  using Block = Eigen::Matrix<Real, 3, 3>;
  using Vector = Eigen::Matrix<Real, Eigen::Dynamic, 1>;

  /// @param mesh  must outlive this
  explicit PressureSchurComplement(const Mesh& mesh);

  std::size_t num_places() const noexcept { return cell_at_.size(); }
  std::size_t place(std::size_t cell) const { return static_cast<std::size_t>(place_[cell]); }

  /// @param b         rows of B; where batches have one, D too is one around cells that have only such around them
  /// @param inverse   D^-1 per node
  /// @param left_out  nodes taken for missing
  void set(const CellRows<Real>& b, const std::vector<Block>& inverse, const std::vector<bool>& left_out);

  /// next <- p + keep (p - next) - add (p + of_gained gained + S p), each of shape (num_places)
  void step(const PressureStep<Real>& step, const Vector& gained, const Vector& p, Vector& next) const;

  std::size_t bytes() const;  ///< of memory

private:
  static constexpr std::size_t num_around = 27;  ///< cells around one, itself included
  static constexpr std::size_t lanes = PlaceSegment::lanes;
  static constexpr std::int32_t none = -1;
  class CellsOfNodes;

  void lay_out();
  std::vector<bool> find_plain_cells() const;
  void set_graded(const CellRows<Real>& b, const std::vector<Block>& inverse, const std::vector<bool>& left_out);
  void cut_into_segments();
  std::int32_t cell_around(std::size_t place, std::size_t o) const {
    return cell_at_[place + static_cast<std::size_t>(around_[o])];
  }
  std::int32_t number_of_all_around(std::size_t place, const CellRows<Real>& b,
                                    const std::vector<bool>& left_out) const;

  const Mesh& mesh_;
  std::vector<std::int32_t> place_;                          ///< of each cell
  std::vector<std::int32_t> cell_at_;                        ///< place -> cell or none
  bool has_box_ = false;                                     ///< otherwise places are those of the cells one by one
  std::array<std::ptrdiff_t, num_around> around_{};          ///< places of the cells around, less the own one
  std::array<std::ptrdiff_t, num_around / 3> row_around_{};  ///< likewise, of the first of each row of three
  std::vector<bool> is_plain_;                               ///< cells around which places tell what is there
  std::vector<PlaceSegment> segments_;
  std::vector<std::size_t> computed_;  ///< segments whose values are not another's
  std::vector<Real> values_;           ///< of each, shape (27, 8), or (27) where they are alike

  /// Cells that are not plain: entries [begin, next begin) of those that follow.
  struct OtherCell {
    std::int32_t cell;
    std::size_t begin;
  };
  std::vector<OtherCell> other_cells_;       ///< and one behind the last
  std::vector<std::int32_t> other_columns_;  ///< cells
  std::vector<Real> other_values_;
};

}  // namespace hexsolver

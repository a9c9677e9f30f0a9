// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <string>
#include <vector>

#include "hexmesh/lattice/element.h"

namespace hexmesh {

/// int mu dV [N mm] of an element, from the energy of a strain without change of volume.
/// @param deviatoric  its A [N/mm], see ElementMatrices
/// @param edges       columns = the cell's edge vectors [mm]
double shear_of(const CellMatrix& deviatoric, const Mat3& edges);

/// Precomputed matrices of the elements of one level, as the lattice file holds them. Each is a sum over the voxels of
/// its element, so that a parent's follows from its children's: K_parent = sum_c L_c^T K_c L_c (the paper,
/// section 3.2).
class StoredMatrices {
public:
  static constexpr std::size_t packed_size = 24 * 25 / 2;  ///< values of an upper triangle

  static constexpr std::size_t num_sets = 7;

  /// One kind of value of all elements.
  struct Set {
    const char* name;            ///< of its dataset
    std::size_t width;           ///< values per element
    std::vector<double> values;  ///< shape (size(), width)
  };
  static constexpr std::size_t bytes_per_element = (2 * packed_size + 24 + 1 + 1 + 8 + 8) * sizeof(double);

  std::array<Set, num_sets>& sets() noexcept { return sets_; }
  const std::array<Set, num_sets>& sets() const noexcept { return sets_; }

  std::size_t size() const noexcept { return sets_[3].values.size(); }  ///< number of elements
  bool empty() const noexcept { return size() == 0; }

  /// Add an element's.
  void append(const ElementMatrices& matrices, const Element& element);

  CellMatrix stiffness(std::size_t element) const { return matrix(0, element); }      ///< K [N/mm]
  CellMatrix deviatoric(std::size_t element) const { return matrix(1, element); }     ///< A [N/mm], see ElementMatrices
  CellMatrix mean_dilatation_stiffness(std::size_t element) const;                    ///< [N/mm]
  CellVector divergence(std::size_t element) const;                                   ///< b [mm^2]
  double volume(std::size_t element) const { return sets_[3].values[element]; }       ///< filled volume [mm^3]
  double bulk(std::size_t element) const { return sets_[4].values[element]; }         ///< int kappa dV [N mm]
  NodeWeights lumped_mass(std::size_t element) const { return weights(5, element); }  ///< [tonne]
  NodeWeights shape(std::size_t element) const { return weights(6, element); }        ///< int N_a dV [mm^3]

  /// int mu dV [N mm]. @param edges  columns = the cell's edge vectors [mm]
  double shear(std::size_t element, const Mat3& edges) const { return shear_of(deviatoric(element), edges); }

  /// The first element whose values contradict each other, as two strains show: K resists shear as A does and change of
  /// volume as `bulk` says, `divergence` and `shape` have the volume. -1 if there is none.
  std::ptrdiff_t find_contradiction(const Mat3& edges) const;

private:
  CellMatrix matrix(std::size_t set, std::size_t element) const;
  NodeWeights weights(std::size_t set, std::size_t element) const;

  std::array<Set, num_sets> sets_ = {{{"stiffness", packed_size, {}},
                                      {"deviatoric", packed_size, {}},
                                      {"divergence", 24, {}},
                                      {"volume", 1, {}},
                                      {"bulk", 1, {}},
                                      {"lumped_mass", 8, {}},
                                      {"shape", 8, {}}}};
};

/// Memory that they take.
std::size_t bytes_of(const StoredMatrices& matrices);

}  // namespace hexmesh

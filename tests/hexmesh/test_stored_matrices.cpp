// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>

#include "hexmesh/file/lattice_file.h"
#include "hexmesh/file/lattice_reader.h"
#include "hexmesh/lattice/element_tree.h"
#include "support/bodies.h"
#include "support/files.h"
#include "support/plain_hdf5.h"

namespace test_stored_matrices {

using namespace hexmesh;
using namespace testing_support;

using Dense = Eigen::Matrix<double, 24, 24>;

Dense unpack(const double* packed) {
  Dense k;
  for (int column = 0; column < 24; ++column)
    for (int row = 0; row <= column; ++row) k(row, column) = k(column, row) = *packed++;
  return k;
}

/// L: values at the corners of the child in a slot, from those at the parent's corners.
Dense child_from_parent(int slot, const Index3& merge) {
  Dense l = Dense::Zero();
  for (int corner = 0; corner < 8; ++corner)
    for (int node = 0; node < 8; ++node) {
      double weight = 1;
      for (int d = 0; d < 3; ++d) {
        const double at = ((slot >> d & 1) + (corner >> d & 1)) / static_cast<double>(merge[d]);
        weight *= (node >> d & 1) != 0 ? at : 1 - at;
      }
      for (int axis = 0; axis < 3; ++axis) l(3 * corner + axis, 3 * node + axis) = weight;
    }
  return l;
}

Lattice bitten() { return bitten_ball({0.8, 0.8, 2.5}, {1, 0, 0}, random_rotation(4)); }

std::string set_name(int level, const std::string& name) {
  return "/levels/" + std::to_string(level) + "/elements/" + name;
}

TEST(StoredMatrices, AreThoseOfTheIntegrals) {
  const TemporaryFolder folder;
  const Lattice lattice = box({8, 8, 8}, {1, 1, 2});
  write_lattice(lattice, folder / "a");
  const auto packed = read_plain<double>(folder / "a", set_name(1, "stiffness"), H5T_NATIVE_DOUBLE);
  ASSERT_EQ(packed.size(), 300U * lattice.levels[1].filled.size());
  const CellMatrix k = ElementMatrices(lattice.cell_edges(1)).stiffness(form_elements(lattice, 1)[0]);
  EXPECT_DOUBLE_EQ(packed[0], k(0, 0));
  EXPECT_DOUBLE_EQ(packed[1], k(0, 1));
  EXPECT_DOUBLE_EQ(packed[2], k(1, 1));
  EXPECT_DOUBLE_EQ(packed[299], k(23, 23));
  EXPECT_EQ(*stored_matrix_error(folder / "a", lattice, 1), 0);
  Lattice other = lattice;
  other.materials[0].material.young *= 1 + 1e-6;
  EXPECT_NEAR(*stored_matrix_error(folder / "a", other, 1), 1e-6, 1e-8);
}

TEST(StoredMatrices, OfAParentAreTheSumOfItsChildren) {
  const TemporaryFolder folder;
  for (const Lattice& lattice : {bitten(), grey_ball({1, 1.2, 2}, {0, 1, 1})}) {
    write_lattice(lattice, folder / "a", MatrixStorage::all);
    for (int n = 2; n < lattice.num_levels(); ++n) {
      const auto children = read_plain<std::int32_t>(folder / "a", set_name(n, "children"), H5T_NATIVE_INT32);
      for (const char* name : {"stiffness", "deviatoric"}) {
        const auto finer = read_plain<double>(folder / "a", set_name(n - 1, name), H5T_NATIVE_DOUBLE);
        const auto coarser = read_plain<double>(folder / "a", set_name(n, name), H5T_NATIVE_DOUBLE);
        ASSERT_EQ(coarser.size() / 300, children.size() / 8);
        for (std::size_t e = 0; e < children.size() / 8; ++e) {
          Dense sum = Dense::Zero();
          for (int slot = 0; slot < 8; ++slot) {
            const std::int32_t child = children[8 * e + static_cast<std::size_t>(slot)];
            if (child < 0) continue;
            const Dense l = child_from_parent(slot, lattice.level(n).merge);
            sum += l.transpose() * unpack(&finer[300 * static_cast<std::size_t>(child)]) * l;
          }
          const Dense k = unpack(&coarser[300 * e]);
          ASSERT_LE((k - sum).cwiseAbs().maxCoeff(), 1e-12 * k.cwiseAbs().maxCoeff()) << name << " at level " << n;
        }
      }
    }
  }
}

TEST(StoredMatrices, AreWhatALevelIsReadWithInsteadOfChildren) {
  const TemporaryFolder folder;
  const Lattice lattice = bitten();
  write_lattice(lattice, folder / "all", MatrixStorage::all);
  write_lattice(lattice, folder / "none", MatrixStorage::none);
  EXPECT_EQ(levels_with_matrices(folder / "none"), std::vector<bool>(lattice.levels.size()));
  EXPECT_FALSE(stored_matrix_error(folder / "none", lattice, 1).has_value());
  for (int n = 1; n < lattice.num_levels(); ++n) {
    const Lattice read = read_lattice(folder / "all", {n}, Elements::stored);
    const Level &level = read.level(n), &whole = lattice.level(n);
    EXPECT_TRUE(level.children.empty());
    EXPECT_EQ(level.filled, whole.filled);
    const std::vector<Element> formed = form_elements(lattice, n);
    const ElementMatrices matrices(lattice.cell_edges(n));
    ASSERT_EQ(level.matrices.size(), formed.size());
    for (std::size_t e = 0; e < formed.size(); ++e) {
      const CellMatrix k = matrices.mean_dilatation_stiffness(formed[e]);
      EXPECT_EQ(level.matrices.mean_dilatation_stiffness(e), k);
      EXPECT_EQ(level.matrices.stiffness(e), matrices.stiffness(formed[e]));
      EXPECT_EQ(level.matrices.shear(e, read.cell_edges(n)),
                shear_of(matrices.deviatoric(formed[e]), lattice.cell_edges(n)));
      EXPECT_EQ(level.matrices.shape(e), matrices.shape(formed[e]));
      EXPECT_EQ(level.matrices.lumped_mass(e), matrices.lumped_mass(formed[e]));
      EXPECT_NEAR(level.matrices.shear(e, read.cell_edges(n)), formed[e].total_shear(),
                  1e-13 * formed[e].total_shear());
    }
    EXPECT_FALSE(read_lattice(folder / "none", {n}, Elements::stored).level(n).children.empty());
  }
}

TEST(StoredMatrices, OfAPieceAreThoseOfTheWhole) {
  const TemporaryFolder folder;
  const Lattice lattice = grey_ball({1, 1.2, 2}, {0, 1, 1});
  write_lattice(lattice, folder / "a", MatrixStorage::all);
  const LatticeReader reader(folder / "a", Elements::stored);
  const Level& whole = lattice.levels[1];
  const ElementMatrices matrices(lattice.cell_edges(1));
  const std::vector<Element> formed = form_elements(lattice, 1);
  Lattice part = reader.outline();
  for (std::size_t c = 1; c < whole.cells.size(); c += 2) part.levels[1].element.push_back(whole.element[c]);
  reader.read_elements(part, 1, part.levels[1].element);
  EXPECT_LE(part.levels[1].matrices.size(), part.levels[1].element.size());
  for (std::size_t n = 0; n < part.levels[1].element.size(); ++n) {
    const auto own = static_cast<std::size_t>(part.levels[1].element[n]);
    const auto of_whole = static_cast<std::size_t>(whole.element[2 * n + 1]);
    EXPECT_EQ(part.levels[1].filled[own], whole.filled[of_whole]);
    EXPECT_EQ(part.levels[1].matrices.divergence(own), matrices.divergence(formed[of_whole]));
  }
}

TEST(StoredMatrices, ThatContradictEachOtherAreRefused) {
  const TemporaryFolder folder;
  const Lattice lattice = bitten();
  for (const char* set : {"stiffness", "deviatoric", "divergence", "volume", "bulk", "shape"}) {
    write_lattice(lattice, folder / "a", MatrixStorage::all);
    scale_dataset(folder / "a", set_name(1, set), 1 + 1e-6);
    const std::string message =
        message_of(ErrorKind::input, [&] { read_lattice(folder / "a", {1}, Elements::stored); });
    EXPECT_NE(message.find("of element 0 of level 1"), std::string::npos) << set << ": " << message;
    EXPECT_GT(*stored_matrix_error(folder / "a", lattice, 1), 1e-7) << set;
  }
  write_lattice(lattice, folder / "a", MatrixStorage::all);
  for (const char* set : {"stiffness", "deviatoric", "bulk"}) scale_dataset(folder / "a", set_name(1, set), 2);
  EXPECT_NO_THROW(read_lattice(folder / "a", {1}, Elements::stored));
  EXPECT_NEAR(*stored_matrix_error(folder / "a", lattice, 1), 1, 1e-12);
}

}  // namespace test_stored_matrices

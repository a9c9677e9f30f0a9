// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "kernels/rotated_cells.h"
#include "mesh/mesh.h"

namespace hexsolver {

/// A co-rotational cell in its frame at one state; the letters are those of THEORY.md.
struct CorotationalFrame {
  Mat3 r, s, inverse_m;
  Mat3 a = Mat3::Zero();  ///< of the stress term, where it is asked for
  CellVector y, f;        ///< R^T (x - mean x); K (y - X)
  Vec3 h;                 ///< M^-1 sum y_a x f_a
};

/// The stress term E = T^T A T + T^T L + L^T T, with w = T v the rotation that v causes.
struct StressTerm {
  Eigen::Matrix<double, 3, 24> t, l;
  Mat3 a;
};

/// Z^T Z is the positive part of E, Z = b^T T + c^T L.
struct PositivePart {
  Mat3 b = Mat3::Zero(), c = Mat3::Zero();
};

Mat3 stress_matrix(const CorotationalFrame& f);  ///< A
/// @param gradient  mean gradients of the nodes
StressTerm stress_term(const CorotationalFrame& f, const NodeGradients& gradient);
PositivePart positive_part(const StressTerm& e);

/// Into and out of a lane of a batch; s is not kept.
void pack(const CorotationalFrame& f, RotatedCells<double>& cells, std::size_t lane);
CorotationalFrame unpacked(const RotatedCells<double>& cells, std::size_t lane);
void pack(const PositivePart& part, PositiveParts& parts, std::size_t lane);
PositivePart unpacked(const PositiveParts& parts, std::size_t lane);

}  // namespace hexsolver

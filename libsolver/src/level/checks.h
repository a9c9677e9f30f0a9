// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "level/level_problem.h"

namespace hexsolver {

/// What to tell about conditions on single points, whose displacement has no continuum limit.
/// @throws Error{input} if an accuracy is asked of them
std::vector<std::string> check_single_points(const Scene& scene);

/// @throws Error{input} for stiffnesses that are too far apart for the digits of numbers
void check_contrast(const hexmesh::Lattice& lattice);

/// Where forces are so small that residuals of their size pass for rounding.
/// @param rounding  what residuals may be by rounding [N]
/// @param forces    norm of those that cells exert on their nodes [N]
/// @param loads     on the body; where there are none it may be moved by its supports as it is
void warn_of_rounding(double rounding, double forces, const std::vector<BalanceReport::Row>& loads,
                      std::vector<std::string>& warnings);

/// @param num_cells  of each level of the lattice
/// @throws Error{input} for what cannot go with an accuracy or a budget
void check_open_ended(const Scene& scene, const std::vector<std::size_t>& num_cells, int finest);

/// The parts of check_level(): of conditions as they are prescribed now, of obstacles as they are now.
std::vector<std::string> check_conflicts(const Constraints& constraints, int level, const Scene& scene);
std::vector<std::string> check_contacts_at(const LevelProblem& problem, const NodeVector& u);

/// @returns warnings: of incompatible conditions that are to be met by least squares, of surface points
/// that
///          are inside obstacles at rest
/// @throws Error{geometry} of incompatible conditions if they are not, of points that are far inside
std::vector<std::string> check_level(const LevelProblem& problem, const Scene& scene);

}  // namespace hexsolver

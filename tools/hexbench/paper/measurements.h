// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "cli/tool.h"
#include "hexbench/methods.h"
#include "hexbench/rows.h"

/// The paper's tables and figures, measured: rows with what was measured, "paper", "ours", "reference" (an independent
/// or converged solution) and a one-line "reading".
namespace hextools::paper {

std::vector<Row> table1(const Console& console);   ///< radii of a cylinder pressed between plates
std::vector<Row> fig4(const Console& console);     ///< stiffness of a cell that is filled in one corner
std::vector<Row> fig5(const Console& console);     ///< a C within one cell under its weight
std::vector<Row> fig7(const Console& console);     ///< a beam under its weight, fitted, shifted and rotated
std::vector<Row> table2(const Console& console);   ///< the liver's cells against tetrahedra
std::vector<Row> table3(const Console& console);   ///< steps per second of a moving liver; figure 14's too
std::vector<Row> uniform(const Console& console);  ///< the central claim: cells that know where they are empty

/// A level under a scene, whose law and stiffness count.
Outcome solve(const hexmesh::Lattice& lattice, const hexsolver::Scene& scene, int level);

/// The liver experiment on the phantom: three patches held, a fourth moved by 40 mm.
Experiment liver_experiment(double poisson);

/// The cylinder of table 1, as high as wide.
constexpr double cylinder_radius = 50;  ///< [mm]
hexmesh::LabelVolume cylinder_phantom();

/// Plates that hold its ends come nearer by a part of its height.
std::vector<hexsolver::Condition> pressed(double compression);

}  // namespace hextools::paper

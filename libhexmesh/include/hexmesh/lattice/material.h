// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

namespace hexmesh {

/// Isotropic linear elastic material (Hooke's law) in the units mm, N, MPa, tonne, s.
struct Material {
  double young = 0;    ///< Young's modulus E [MPa]
  double poisson = 0;  ///< Poisson's ratio nu
  double density = 0;  ///< rho [tonne/mm^3]

  double shear_modulus() const { return young / (2 * (1 + poisson)); }     ///< mu [MPa]
  double bulk_modulus() const { return young / (3 * (1 - 2 * poisson)); }  ///< kappa [MPa]
};

/// @param young_kpa      E [kPa]
/// @param density_kg_m3  rho [kg/m^3]
Material material_from_units(double young_kpa, double poisson, double density_kg_m3);

/// What is out of bounds, "young_kpa is 0, expected 1e-06 to 1e+10"; empty if nothing is.
std::string material_problem(const Material& material);

/// @param segment  named in the message
/// @throws Error{input} if E, nu or rho breaks its bound
void check_material(const Material& material, const std::string& segment);

/// A tissue whose stiffness was measured.
struct Tissue {
  std::string name;
  std::vector<std::string> words;  ///< lower-case parts of segment names that mean this tissue
  Material material;
  std::string source;  ///< of the stiffness; soft tissue is taken as nearly incompressible, nu = 0.45
};

/// Source of the densities of all tissues.
inline constexpr const char* density_source = "ICRU Report 44 (1989)";

/// Named defaults, most specific words first.
const std::vector<Tissue>& known_tissues();

/// The tissue that a segment name speaks of, e.g. "Portal vein" -> vessel; nullptr if none.
const Tissue* tissue_of(const std::string& segment_name);

}  // namespace hexmesh

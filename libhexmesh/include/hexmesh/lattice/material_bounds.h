// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace hexmesh {

/// Bounds of materials, far beyond tissue and implants: gels have 1e-3 kPa, diamond 1.2e9 kPa, osmium 22,600 kg/m^3. Of
/// water the bulk modulus is some 1e6 times the shear modulus of soft tissue; at nu = 0.49999, 5e4 times, the volume is
/// kept as well for all that is seen, and equations can still be solved.
inline constexpr double least_young_kpa = 1e-6, most_young_kpa = 1e10;
inline constexpr double least_poisson = -0.99, most_poisson = 0.49999;
inline constexpr double most_density_kg_m3 = 1e5;

}  // namespace hexmesh

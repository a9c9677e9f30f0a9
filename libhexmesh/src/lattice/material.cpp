// SPDX-License-Identifier: Apache-2.0
#include "hexmesh/lattice/material.h"

#include <fmt/format.h>

#include <cmath>

#include "../core/text.h"
#include "hexmesh/core/error.h"
#include "hexmesh/lattice/material_bounds.h"

namespace hexmesh {

Material material_from_units(double young_kpa, double poisson, double density_kg_m3) {
  return {young_kpa * 1e-3, poisson, density_kg_m3 * 1e-12};
}

std::string material_problem(const Material& material) {
  // Values have come through units: the bounds are met but for rounding.
  const auto is_within = [](double value, double least, double most) {
    return value >= least * (1 - 1e-9) && value <= most * (1 + 1e-9);
  };
  if (!is_within(material.young, least_young_kpa * 1e-3, most_young_kpa * 1e-3))
    return fmt::format("young_kpa is {:.12g}, expected {:g} to {:g}", material.young * 1e3, least_young_kpa,
                       most_young_kpa);
  if (!(material.poisson >= least_poisson && material.poisson <= most_poisson))
    return fmt::format("poisson is {:.12g}, expected {:g} to {:g}", material.poisson, least_poisson, most_poisson);
  if (!is_within(material.density, 0, most_density_kg_m3 * 1e-12))
    return fmt::format("density_kg_m3 is {:.12g}, expected 0 to {:g}", material.density * 1e12, most_density_kg_m3);
  return {};
}

void check_material(const Material& material, const std::string& segment) {
  if (const std::string problem = material_problem(material); !problem.empty())
    throw Error(ErrorKind::input, fmt::format("material of segment '{}': {}", segment, problem));
}

const std::vector<Tissue>& known_tissues() {
  static const std::vector<Tissue> tissues = {
      {"tumour",
       {"tumor", "tumour", "nodule", "lesion", "metastas", "carcinoma"},
       material_from_units(30, 0.45, 1060),
       "Venkatesh et al., AJR 190 (2008) 1534: malignant liver tumours, shear stiffness 10.1 kPa, E = 3 mu"},
      {"vessel",
       {"vessel", "vein", "vena", "artery", "aorta"},
       material_from_units(300, 0.45, 1060),
       "Fung, Biomechanics: Mechanical Properties of Living Tissues (1993), ch. 8: order of wall moduli"},
      {"bone",
       {"bone", "vertebra", "rib", "sacrum", "femur", "skull"},
       material_from_units(17e6, 0.3, 1920),
       "Rho, Ashman, Turner, J. Biomech. 26 (1993) 111: cortical bone"},
      {"muscle",
       {"muscle", "gluteus", "iliopsoas", "autochthon"},
       material_from_units(12, 0.45, 1050),
       "Bensamoun et al., JMRI 23 (2006) 708: relaxed thigh muscle, shear stiffness 3.7 kPa along the fibres"},
      {"fat",
       {"fat", "adipose"},
       material_from_units(3.25, 0.45, 950),
       "Samani, Zubovits, Plewes, Phys. Med. Biol. 52 (2007) 1565: breast adipose tissue"},
      {"liver",
       {"liver", "hepar"},
       material_from_units(6.6, 0.45, 1060),
       "Yin et al., Clin. Gastroenterol. Hepatol. 5 (2007) 1207: healthy liver, shear stiffness 2.2 kPa, E = 3 mu"},
  };
  return tissues;
}

const Tissue* tissue_of(const std::string& segment_name) {
  const std::string name = lower(segment_name);
  for (const Tissue& tissue : known_tissues())
    for (const std::string& word : tissue.words)
      if (name.find(word) != std::string::npos) return &tissue;
  return nullptr;
}

}  // namespace hexmesh

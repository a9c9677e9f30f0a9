// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <limits>

#include "hexmesh/lattice/material.h"
#include "support/files.h"

namespace test_material {

using namespace hexmesh;
using testing_support::message_of;

TEST(Material, ModuliFollowFromYoungAndPoisson) {
  const Material m = material_from_units(100, 0.25, 1060);
  EXPECT_DOUBLE_EQ(m.young, 0.1);
  EXPECT_DOUBLE_EQ(m.density, 1.06e-9);
  EXPECT_DOUBLE_EQ(m.shear_modulus(), 0.04);
  EXPECT_NEAR(m.bulk_modulus(), 0.1 / 1.5, 1e-15);
}

TEST(Material, EachBoundIsCheckedAndTheSegmentNamed) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const auto& [material, key] :
       {std::pair{material_from_units(0, 0.3, 1000), "young_kpa is 0"},
        {material_from_units(nan, 0.3, 1000), "young_kpa is nan"},
        {material_from_units(1, 0.5, 1000), "poisson is 0.5"},
        {material_from_units(1, -1, 1000), "poisson is -1"},
        {material_from_units(1, 0.3, -1), "density_kg_m3 is -1"},
        // Beyond any tissue, and what equations bear:
        {material_from_units(1e300, 0.3, 1000), "young_kpa is 1e+300"},
        {material_from_units(1e12, 0.3, 1000), "young_kpa is 1e+12, expected 1e-06 to 1e+10"},
        {material_from_units(1e-9, 0.3, 1000), "young_kpa is 1e-09"},
        {material_from_units(1, 0.49999999, 1000), "poisson is 0.49999999, expected -0.99 to 0.49999"},
        {material_from_units(1, 0.3, 1e9), "density_kg_m3 is 1000000000"}}) {
    const std::string message = message_of(ErrorKind::input, [&, &m = material] { check_material(m, "spleen"); });
    EXPECT_NE(message.find("'spleen'"), std::string::npos) << message;
    EXPECT_NE(message.find(key), std::string::npos) << message;
  }
}

TEST(Material, BoundsAreMetInAnyUnits) {
  for (const Material& m : {material_from_units(1e10, 0.49999, 1e5), material_from_units(1e-6, -0.99, 0)})
    EXPECT_EQ(material_problem(m), "");
}

TEST(Material, TissuesAreFoundByTheWordsOfASegmentName) {
  ASSERT_NE(tissue_of("Portal Vein and splenic vein"), nullptr);
  EXPECT_EQ(tissue_of("Portal Vein and splenic vein")->name, "vessel");
  EXPECT_EQ(tissue_of("liver tumour")->name, "tumour");
  EXPECT_EQ(tissue_of("Liver")->name, "liver");
  EXPECT_EQ(tissue_of("gallbladder"), nullptr);
}

}  // namespace test_material

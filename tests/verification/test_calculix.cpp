// SPDX-License-Identifier: Apache-2.0
// The tools against CalculiX on the same voxels: every voxel one trilinear brick, the same law, loads and supports, so
// that only the solvers can differ. tests/data has the bodies, scenes and fields, and makes them.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "hexmesh/file/result_file.h"
#include "support/experiments.h"
#include "support/files.h"

namespace test_calculix {

using namespace testing_support;
using nlohmann::json;

const std::filesystem::path data = HEXTOOLS_SOURCE "/tests/data";

std::vector<json> cases() { return json::parse(read_text(data / "cases.json")).get<std::vector<json>>(); }

class Calculix : public testing::TestWithParam<json> {};

TEST_P(Calculix, FindsTheSameFieldAndReactions) {
  const json& c = GetParam();
  const std::string name = c["name"];
  const TemporaryFolder folder;
  std::string materials, settings;
  for (const json& m : c["materials"]) materials += fmt::format(" --material '{}'", m.get<std::string>());
  for (const auto& [key, value] : c["solve"].items())
    settings += fmt::format(" --set solve.{}={}", key, value.get<std::string>());
  const CommandResult r = shell(fmt::format(
      "cd '{0}' && hexmesh -q build '{1}/bodies/{2}.nrrd'{3}{6} -o a.hexmesh && hexsolve -q a.hexmesh "
      "'{1}/scenes/{4}.toml'{5} --level 0 --set solve.error_estimate=off --report report.json -o a.hexresult",
      folder.path(""), data.string(), c["body"].get<std::string>(), materials, c["scene"].get<std::string>(), settings,
      c.contains("slide") ? " --slide " + c["slide"].get<std::string>() : ""));
  ASSERT_EQ(r.exit_code, 0) << r.errors;

  const std::vector<NodeRow> reference = read_reference(data / "fields" / (name + ".csv.gz"));
  EXPECT_GT(reference.size(), 600U);
  const Distance d = distance(hexmesh::read_result(folder / "a.hexresult"), reference);
  const json reactions = json::parse(read_text(data / "fields/reactions.json"))[name];
  json report = json::parse(read_text(folder / "report.json"));
  if (report.contains("loaded")) report = json(report["loaded"]);  // of a shape without load, which nothing acts on
  EXPECT_EQ(report["conditions"].size(), reactions.size());
  double off = 0, largest = 0;
  for (const json& condition : report["conditions"])
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double expected = reactions.at(condition["name"].get<std::string>())[axis];
      off = std::max(off, std::abs(condition["reaction_n"][axis].get<double>() - expected));
      largest = std::max(largest, std::abs(expected));
    }
  if (!c.contains("within")) {
    std::printf("%-28s %5zu nodes: mean %.1e, largest %.1e mm; reactions %.1e of the largest\n", name.c_str(),
                reference.size(), d.mean, d.largest, off / largest);
    EXPECT_LT(d.largest, 1e-5);
    EXPECT_LT(off, 1e-6 * largest);
    return;
  }
  // Contact is not discretised alike: points with a normal here, faces that give way a little there.
  double mean = 0;
  for (const NodeRow& row : reference) mean += row.displacement.norm() / static_cast<double>(reference.size());
  std::printf("%s: reactions off by %.2f %%, displacement by %.2f %% in the mean\n", name.c_str(), 100 * off / largest,
              100 * d.mean / mean);
  EXPECT_LT(d.mean, c["within"].get<double>() * mean);
  EXPECT_LT(off, c["within"].get<double>() * largest);
}

INSTANTIATE_TEST_SUITE_P(All, Calculix, testing::ValuesIn(cases()), [](const auto& c) {
  std::string name = c.param["name"];
  for (char& letter : name)
    if (!std::isalnum(static_cast<unsigned char>(letter))) letter = '_';
  return name;
});

}  // namespace test_calculix

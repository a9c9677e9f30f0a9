// SPDX-License-Identifier: Apache-2.0
#include "record.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <fstream>
#include <set>

namespace stability {
namespace {

std::string variable(const char* name) {
  const char* value = std::getenv(name);
  return value ? value : "";
}

/// JSON has no NaN or infinity.
nlohmann::ordered_json number(double value) {
  if (std::isfinite(value)) return value;
  return fmt::format("{}", value);
}

/// Those that are finite, others as null: gaps of the curve.
nlohmann::ordered_json numbers(const std::vector<double>& values) {
  nlohmann::ordered_json out = nlohmann::ordered_json::array();
  for (const double v : values) out.push_back(std::isfinite(v) ? nlohmann::ordered_json(v) : nlohmann::ordered_json());
  return out;
}

int num_failures() { return testing::UnitTest::GetInstance()->current_test_info()->result()->total_part_count(); }

}  // namespace

Case::Case(std::string family, std::string name)
    : record_({{"family", std::move(family)},
               {"case", std::move(name)},
               {"figures", nlohmann::ordered_json::array()},
               {"curves", nlohmann::ordered_json::array()},
               {"bodies", nlohmann::ordered_json::array()}}),
      failures_before_(num_failures()) {}

Case::~Case() {
  const std::string path = variable("HEXTOOLS_STABILITY_RECORDS");
  if (path.empty()) return;
  record_["failed"] = num_failures() > failures_before_ + missed_figures_;
  std::ofstream out(path, std::ios::app);
  out << record_.dump() << "\n";
}

void Case::add(const std::string& what, double measured, const char* relation, double limit, bool holds) {
  record_["figures"].push_back(
      {{"what", what}, {"measured", number(measured)}, {"relation", relation}, {"limit", limit}, {"holds", holds}});
  printf("%s: %s %.4g (%s %.4g)\n", record_["case"].get<std::string>().c_str(), what.c_str(), measured, relation,
         limit);
  missed_figures_ += !holds;
  EXPECT_TRUE(holds) << record_["case"] << ": " << what << " is " << measured << ", expected " << relation << " "
                     << limit;
}

void Case::at_most(const std::string& what, double measured, double limit) {
  add(what, measured, "<=", limit, measured <= limit);
}

void Case::at_least(const std::string& what, double measured, double limit) {
  add(what, measured, ">=", limit, measured >= limit);
}

void Case::note(const std::string& what, double measured) {
  record_["figures"].push_back({{"what", what}, {"measured", number(measured)}});
  printf("%s: %s %.4g\n", record_["case"].get<std::string>().c_str(), what.c_str(), measured);
}

void Case::note(const std::string& what, const std::string& how) {
  record_["figures"].push_back({{"what", what}, {"measured", how}});
  printf("%s: %s %s\n", record_["case"].get<std::string>().c_str(), what.c_str(), how.c_str());
}

void Case::curve(const Axes& axes, const std::string& label, const std::vector<double>& x,
                 const std::vector<double>& y) {
  record_["curves"].push_back({{"title", axes.title},
                               {"x_label", axes.x},
                               {"y_label", axes.y},
                               {"log_x", axes.log_x},
                               {"log_y", axes.log_y},
                               {"label", label},
                               {"x", numbers(x)},
                               {"y", numbers(y)}});
}

void Case::body(const std::string& label, const hexsolver::Mesh& mesh, const hexsolver::NodeVector& u) {
  std::set<std::pair<std::int32_t, std::int32_t>> edges;
  for (const hexsolver::CellNodes& nodes : mesh.cell_nodes())
    for (std::size_t a = 0; a < 8; ++a)
      for (std::size_t bit = 1; bit < 8; bit *= 2)
        if (!(a & bit)) edges.emplace(nodes[a], nodes[a | bit]);
  nlohmann::ordered_json lines = nlohmann::ordered_json::array();
  const auto place = [&](std::int32_t node) {
    const hexsolver::Vec3 p =
        mesh.position(static_cast<std::size_t>(node)) + u.segment<3>(3 * static_cast<Eigen::Index>(node));
    return std::array{p[0], p[1], p[2]};
  };
  for (const auto& [a, b] : edges) lines.push_back({place(a), place(b)});
  record_["bodies"].push_back({{"label", label}, {"edges", std::move(lines)}});
}

}  // namespace stability

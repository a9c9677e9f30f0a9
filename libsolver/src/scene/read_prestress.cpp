// SPDX-License-Identifier: Apache-2.0
#include <Eigen/Eigenvalues>

#include "scene/read_tables.h"

namespace hexsolver {
namespace {

constexpr double least_stretch = 0.2, most_stretch = 5;

/// One number for all directions, or for that of `along` alone; three for the axes, six for a tensor.
/// @param neutral  what directions without a number have
Mat3 to_tensor(const std::vector<double>& given, double neutral, const std::optional<Vec3>& along) {
  const Mat3 one = Mat3::Identity();
  if (along) return neutral * one + (given[0] - neutral) * *along * along->transpose();
  if (given.size() == 1) return given[0] * one;
  Mat3 out = Vec3(given[0], given[1], given[2]).asDiagonal();
  if (given.size() == 6) {
    out(0, 1) = out(1, 0) = given[3];
    out(1, 2) = out(2, 1) = given[4];
    out(0, 2) = out(2, 0) = given[5];
  }
  return out;
}

void check_stretch(const TomlReader& table, const Mat3& stretch) {
  const Vec3 stretches = Eigen::SelfAdjointEigenSolver<Mat3>(stretch, Eigen::EigenvaluesOnly).eigenvalues();
  for (const double s : {stretches[0], stretches[2]})
    if (s < least_stretch || s > most_stretch)
      table.fail_at("stretch",
                    fmt::format("prestress.stretch is {:g}, expected {:g} to {:g}", s, least_stretch, most_stretch));
}

}  // namespace

Prestress read_prestress(TomlReader table) {
  Prestress p;
  p.where = table.where();
  p.segment = table.text("segment", "the name of a segment").value_or("");
  auto along = table.vector("along", "three numbers [x, y, z], LPS, a direction");
  const std::string one = "one number beside along";
  const auto read = [&](const char* key, std::vector<std::size_t> counts, const char* expected) {
    return table.number_or_numbers(key, along ? std::vector<std::size_t>() : std::move(counts), along ? one : expected);
  };
  const std::vector<double> stretch = read("stretch", {3}, "a number, or three along x, y, z");
  const std::vector<double> stress =
      read("stress_kpa", {3, 6}, "a number, three along x, y, z, or six: xx, yy, zz, xy, yz, zx");
  table.finish();
  if (p.segment.empty()) table.fail_here("[[prestress]] has no segment, expected the name of one");
  if (stretch.empty() == stress.empty()) table.fail_here("[[prestress]] expects one of stretch and stress_kpa");
  if (along) along->stableNormalize();
  if (along && !(along->norm() > 0.5)) table.fail_at("along", "prestress.along is 0, expected a direction");
  if (!stretch.empty()) {
    p.stretch = to_tensor(stretch, 1, along);
    check_stretch(table, *p.stretch);
  } else {
    p.stress = 1e-3 * to_tensor(stress, 0, along);
  }
  return p;
}

}  // namespace hexsolver

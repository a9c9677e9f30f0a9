// SPDX-License-Identifier: Apache-2.0
#include "dynamics/backward_difference.h"

#include <numbers>

namespace hexsolver {
namespace {

constexpr double stage = 1 - 1 / std::numbers::sqrt2;

}  // namespace

void BackwardDifference::remember(const NodeVector& u, const NodeVector& v, double h) {
  u_before_ = u;
  v_before_ = v;
  length_before_ = h;
}

double BackwardDifference::first_stage(double h) { return stage * h; }

void BackwardDifference::begin_euler(double h) {
  is_euler_ = true;
  length_ = h;
}

void BackwardDifference::begin_bdf2(const NodeVector& u, const NodeVector& v, double h) {
  is_euler_ = false;
  const double r = h / length_before_, share = r * r / (1 + 2 * r);
  length_ = h * (1 + r) / (1 + 2 * r);
  u_ = u + share * (u - u_before_);
  v_ = v + share * (v - v_before_);
  ahead_ = u + r * (u - u_before_);
}

void BackwardDifference::begin_second_stage(const NodeVector& u, const NodeVector& v, const NodeVector& stage_u,
                                            const NodeVector& stage_v, double h) {
  is_euler_ = false;
  length_ = stage * h;
  u_ = u + (1 - stage) / stage * (stage_u - u);
  v_ = v + (1 - stage) / stage * (stage_v - v);
  ahead_ = u + 1 / stage * (stage_u - u);
}

}  // namespace hexsolver

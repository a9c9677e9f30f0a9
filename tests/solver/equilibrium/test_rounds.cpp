// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "equilibrium/rounds.h"

namespace test_rounds {

using namespace hexsolver;

/// A body of stiffness K that is pressed into a wall by d, held off it by a force h and a spring k: x = (K d - h) / (K
/// + k), h += k x. Rounds leave K / (K + k) of the depth each.
struct PressedIn {
  double body, wall, by, held_off = 0;

  double depth(double stiffer) const { return (body * by - held_off) / (body + stiffer * wall); }
};

TEST(Rounds, ThatGoOnSlowlyRestByStifferSprings) {
  for (const double body : {0.1, 1.0, 20.0, 100.0}) {
    PressedIn pressed{body, 1, 1};
    Rounds rounds({1e-6, 1e-4, 200}, LetsGo::never);
    double before = pressed.by;
    int count = 0;
    for (; count < 200 && !rounds.at_rest(); ++count) {
      const double stiffer = rounds.mode().stiffer, depth = pressed.depth(stiffer);
      pressed.held_off += rounds.mode().learns * stiffer * pressed.wall * depth;
      rounds.add(std::abs(before - depth) / pressed.by, false, true);
      before = depth;
    }
    // Springs stay as they are where each round leaves less than 0.7; or 16 times stiffer it leaves K / (K + 16 k).
    const double leaves = std::max(0.7, body / (body + 16));
    EXPECT_LE(count, 8 + std::log(1e-6) / std::log(leaves)) << body;
    EXPECT_LT(pressed.depth(rounds.mode().stiffer), 1e-6 * std::max(1.0, leaves / (1 - leaves)) * pressed.by) << body;
  }
}

TEST(Rounds, WithoutASolutionSoftenSprings) {
  Rounds rounds({1e-6, 1e-4, 200}, LetsGo::never);
  for (int round = 0; round < 10; ++round) rounds.add(0.1, false, true);
  EXPECT_EQ(rounds.mode().stiffer, 16);
  rounds.add(0.1, false, false);
  EXPECT_EQ(rounds.mode().stiffer, 8);
  for (int round = 0; round < 10; ++round) rounds.add(0, false, false);
  EXPECT_EQ(rounds.mode().stiffer, 1);
  EXPECT_FALSE(rounds.at_rest());
}

/// A body that comes nine tenths nearer to 1 in each solution, where none is found as long as places are free: its
/// forces jump.
struct Jumping {
  using Vector = NodeVector;
  struct Size {
    double mean;
  };
  bool is_held = false;
  int in_vain = 0;

  bool attach(const NodeVector& /*u*/, const PullMode& /*mode*/) {
    is_held = false;
    return true;
  }
  bool settle(const NodeVector& /*u*/) { return is_held = true; }
  void unsettle() { is_held = false; }
  RoundLimits round_limits(Aim /*aim*/) const { return {1e-6, 1e-4, 200}; }
  NodeVector make_start() const { return NodeVector::Zero(1); }
  NodeVector make_zero() const { return NodeVector::Zero(1); }
  double diameter() const { return 1; }
  Size size_in_material(const NodeVector& field, bool /*with_islands*/) const { return {std::abs(field[0])}; }
  NewtonOutcome minimize(const NewtonOptions& /*options*/, NodeVector& u, const NewtonProgress& /*progress*/) {
    NewtonOutcome out;
    out.iterations = 1;
    out.converged = is_held;
    out.end = is_held ? NewtonEnd::converged : NewtonEnd::no_descent;
    if (is_held) u[0] += 0.9 * (1 - u[0]);
    in_vain += !is_held;
    return out;
  }
};

TEST(Rounds, GoOnWithPlacesHeldWhereForcesJump) {
  Jumping body;
  NodeVector u = NodeVector::Zero(1);
  const NewtonOutcome outcome = minimize_in_rounds(body, {}, u, {}, Aim::result, LetsGo::never);
  EXPECT_TRUE(outcome.converged);
  EXPECT_EQ(outcome.moving, 0);  // at rest
  EXPECT_NEAR(u[0], 1, 1e-6);
  EXPECT_LE(body.in_vain, 10);
}

}  // namespace test_rounds

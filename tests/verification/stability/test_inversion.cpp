// SPDX-License-Identifier: Apache-2.0
// Cells collapsed, mirrored and scrambled. The paper: "the inversion of an element is easily detected, and modeled as a
// high compression. Stability is maintained and the elements can recover their initial shape".
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include "core/rotation.h"
#include "motions.h"
#include "record.h"
#include "statics.h"

namespace test_inversion {

using namespace hexsolver;
using namespace testing_support;
using stability::Case;

constexpr const char* family = "01 inversion";
constexpr double edge = 4;  // of a voxel [mm]
constexpr int across = 6;   // voxels of the block
constexpr int levels = 3;
const Vec3 middle = Vec3::Constant((across - 1) / 2.0 * edge);

Lattice block() { return box({across, across, across}, Vec3::Constant(edge), 10, 0.3); }

/// Every node moved into a plane, onto a line or to a point.
struct Collapse {
  const char* name;
  Vec3 keep;
  double enough;  ///< of the seeds; see `messes` for what the others come to
};
const Collapse collapses[] = {{"plane", {1, 1, 0}, 0.95}, {"line", {1, 0, 0}, 0.75}, {"point", {0, 0, 0}, 0.6}};

NodeVector collapsed(const Mesh& mesh, const Collapse& c) {
  return sample(mesh, [&](const Vec3& p) { return Vec3(c.keep.cwiseProduct(p) - p); });
}

/// A smooth field that no mirror leaves the same [1].
NodeVector waves(const Mesh& mesh, unsigned seed) {
  return sample(mesh, [&](const Vec3& p) {
    return Vec3(std::sin(seed + 13 * p[0] + 7 * p[1] + 3 * p[2]), std::sin(5 * p[0] + 11 * p[1] + p[2]),
                std::cos(3 * p[0] - 7 * p[1] + 4 * p[2]));
  });
}

Vec3 mirrored(const Vec3& p, unsigned seed) {
  const Vec3 normal = random_rotation(seed).col(0);
  return -2 * normal.dot(p - middle) * normal;
}

/// Every cell turned inside out.
struct Mess {
  const char* name;
  bool is_mirror;
  double stirred;  ///< [edges]
  double enough;   ///< of the seeds
};
// A mirrored block that is stirred may come to rest with one of its edges rolled in, a minimum of its energy in which
// no cell is inverted as a whole.
const Mess messes[] = {{"mirrored in a random plane", true, 0, 0.95},
                       {"mirrored and stirred by 1/100 edge", true, 0.01, 0.85},
                       {"scrambled by 3 edges", false, 3, 0.95}};

NodeVector made(const Mess& mess, const Mesh& mesh, unsigned seed) {
  NodeVector u = NodeVector::Zero(static_cast<Eigen::Index>(mesh.num_dofs()));
  if (mess.is_mirror) u = sample(mesh, [&](const Vec3& p) { return mirrored(p, seed); });
  if (mess.stirred > 0) u += noise(mesh.num_dofs(), mess.stirred * edge, seed);
  return u;
}

/// Cells whose volume is negative.
int num_inverted(const Body& body, const NodeVector& u) {
  int count = 0;
  for (std::size_t c = 0; c < body.mesh.num_cells(); ++c) count += !(body.elastic->jacobians(c, u).mean > 0);
  return count;
}

unsigned num_seeds(int level) { return stability::whole_or(200U, level == 0 ? 8U : 20U); }

void tell_recovered(Case& c, int level, int recovered, double enough) {
  c.at_least(fmt::format("level {}: part of {} seeds recovered", level, num_seeds(level)),
             static_cast<double>(recovered) / num_seeds(level), enough);
}

/// The face x = least held where it is at rest.
std::vector<ConstraintPoint> held_face(const Mesh& mesh) {
  return hold_nodes(
      mesh, [](const Vec3& p) { return p[0] < -0.4 * edge; }, [](const Vec3&) { return Vec3::Zero(); });
}

/// Three corners held where a mirror puts them: it keeps their distances, so a block at rest fits.
std::vector<ConstraintPoint> held_corners(const Mesh& mesh, unsigned seed) {
  const auto is_corner = [](const Vec3& p) {
    const Vec3 q = (p + Vec3::Constant(edge / 2)) / (across * edge);
    for (const Vec3& corner : {Vec3(0, 0, 0), Vec3(1, 0, 0), Vec3(0, 1, 0)})
      if ((q - corner).norm() < 0.01) return true;
    return false;
  };
  return hold_nodes(mesh, is_corner, [&](const Vec3& p) { return mirrored(p, seed); });
}

constexpr double nothing = 1e-8;          // of the energy at the start, in equilibrium
constexpr double next_to_nothing = 1e-3;  // likewise, after the motion
constexpr int motion_steps = 500, motion_steps_of_seeds = 300;

class InversionInMotion : public testing::TestWithParam<Rotation> {};

TEST(Inversion, EquilibriaRecoverFromCollapse) {
  Case c(family, "equilibrium from a collapsed block, polar");
  const Lattice lattice = block();
  double rise = 0, left = 0;
  int steps = 0;
  for (int level = 0; level < levels; ++level)
    for (const Collapse& collapse : collapses) {
      Body body(lattice, level, Elasticity::corotational);
      const stability::Descent d =
          stability::descend(lattice, body, held_face(body.mesh), collapsed(body.mesh, collapse));
      EXPECT_TRUE(d.report.converged) << collapse.name << " level " << level << ": " << d.report.reason;
      rise = stability::worst(rise, d.largest_rise);
      left = stability::worst(left, d.end_energy / d.start_energy);
      steps = std::max(steps, d.report.iterations);
    }
  c.at_most("largest rise of the energy in a step", rise, 1e-12);
  c.at_most("energy left of plane, line and point, levels 0 to 2", left, nothing);
  c.note("most Newton steps", steps);
}

TEST(Inversion, EquilibriaRecoverFromMirrorsAndScrambles) {
  const Lattice lattice = block();
  for (const Mess& mess : messes) {
    const bool is_exact = mess.is_mirror && mess.stirred == 0;
    Case c(family, fmt::format("equilibrium from a block {}, held at {}, polar", mess.name,
                               is_exact ? "three corners" : "a face"));
    for (int level = 0; level < levels - 1; ++level) {
      int recovered = 0, folded = 0, inverted = 0;
      double rise = 0;
      for (unsigned seed = 1; seed <= num_seeds(level); ++seed) {
        Body body(lattice, level, Elasticity::corotational);
        const NodeVector start = made(mess, body.mesh, seed);
        const stability::Descent d =
            stability::descend(lattice, body, is_exact ? held_corners(body.mesh, seed) : held_face(body.mesh), start);
        EXPECT_TRUE(d.u.allFinite()) << "seed " << seed;
        EXPECT_FALSE(d.report.reason.empty()) << "seed " << seed;
        rise = stability::worst(rise, d.largest_rise);
        const bool is_free = d.end_energy < nothing * d.start_energy;
        recovered += d.report.converged && is_free;
        folded += !is_free;
        inverted += num_inverted(body, d.u);
        if (seed == 1 && level == 0) {
          c.body(fmt::format("{}: start", mess.name), body.mesh, start);
          c.body(fmt::format("{}: equilibrium", mess.name), body.mesh, d.u);
        }
      }
      tell_recovered(c, level, recovered, mess.enough);
      c.note(fmt::format("level {}: seeds that end folded, an edge of the block rolled in", level), folded);
      c.at_most(fmt::format("level {}: cells left inverted, all seeds", level), inverted, 0);
      c.at_most(fmt::format("level {}: largest rise of the energy in a step", level), rise, 1e-12);
    }
  }
}

/// Stirred by next to nothing: which way a body that is the same mirrored goes is up to rounding, and it may end in a
/// tangle that is the same mirrored too. How many do is told of many seeds.
TEST_P(InversionInMotion, MotionsRecoverFromCollapse) {
  constexpr double stirred = 1e-6 * edge;
  const char* rotation = stability::name_of(GetParam());
  const Lattice lattice = block();
  for (const Collapse& collapse : collapses) {
    Case c(family, fmt::format("motion from a block in a {}, 10 iterations a step, {}", collapse.name, rotation));
    double gain = 0;
    for (int level = 0; level < levels; ++level) {
      int recovered = 0;
      for (unsigned seed = 1; seed <= num_seeds(level); ++seed) {
        Motion motion(lattice, stability::starved(GetParam()), level);
        motion.set_state(collapsed(motion.mesh(), collapse) + stirred * waves(motion.mesh(), seed),
                         stability::still(motion));
        const stability::Run r = stability::run(motion, motion_steps);
        EXPECT_TRUE(r.finished) << "level " << level << " seed " << seed << ": " << r.reason;
        gain = stability::worst(gain, r.largest_gain);
        recovered += motion.energies().strain < next_to_nothing * r.energy[0];  // it may fly and turn
        if (level == 0 && seed == 1)
          c.curve({"energy after a collapse", "time [s]", "energy [N mm]", false, true},
                  fmt::format("{}, {}", collapse.name, rotation), r.time, r.energy);
      }
      tell_recovered(c, level, recovered, collapse.enough);
    }
    c.at_most("energy gained in a step", gain, stability::allowed_gain(GetParam()));
  }
}

TEST_P(InversionInMotion, MotionsRecoverFromMirrorsAndScrambles) {
  const char* rotation = stability::name_of(GetParam());
  const Lattice lattice = block();
  for (const Mess& mess : messes) {
    Case c(family, fmt::format("motion from a block {}, 10 iterations a step, {}", mess.name, rotation));
    for (int level = 0; level < levels - 1; ++level) {
      const Body body(lattice, level, Elasticity::corotational);
      int recovered = 0, inverted = 0;
      double gain = 0;
      for (unsigned seed = 1; seed <= num_seeds(level); ++seed) {
        Motion motion(lattice, stability::starved(GetParam()), level);
        motion.set_state(made(mess, motion.mesh(), seed), stability::still(motion));
        const stability::Run r = stability::run(motion, motion_steps_of_seeds);
        EXPECT_TRUE(r.finished) << "seed " << seed << ": " << r.reason;
        gain = stability::worst(gain, r.largest_gain);
        recovered += motion.energies().strain < next_to_nothing * r.energy[0];
        inverted += num_inverted(body, motion.displacement()) > 0;
      }
      tell_recovered(c, level, recovered, mess.enough);
      c.at_most(fmt::format("level {}: part of the seeds that leave a cell inverted", level),
                static_cast<double>(inverted) / num_seeds(level), 0.05);
      c.at_most(fmt::format("level {}: energy gained in a step", level), gain, stability::allowed_gain(GetParam()));
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Rotations, InversionInMotion, testing::Values(Rotation::polar, Rotation::edges),
                         [](const auto& p) { return stability::name_of(p.param); });

TEST(Inversion, AveragedEdgesOfAnyLengthHaveARotation) {
  Case c(family, "averaged edges that vanish, or are parallel");
  double off = 0;
  const Vec3 a(1, 2, -1), b(0, 1, 1);
  for (const auto& [first, second, third] :
       {std::array{Vec3(Vec3::Zero()), Vec3(Vec3::Zero()), Vec3(Vec3::Zero())}, std::array{a, a, a},
        std::array{a, Vec3(-3 * a), b}, std::array{Vec3(Vec3::Zero()), a, b}, std::array{a, Vec3(Vec3::Zero()), a},
        std::array{Vec3(1e-300 * a), Vec3(1e-300 * b), Vec3(Vec3::Zero())}, std::array{Vec3(1e100 * a), b, a}}) {
    Mat3 f;
    f << first, second, third;
    const Mat3 r = orthonormalized(f);
    off =
        stability::worst(off, std::max({(r.transpose() * r - Mat3::Identity()).norm(), std::abs(r.determinant() - 1)}));
    const Polar polar = polar_decomposition(f);
    off = stability::worst(off, std::max({(polar.rotation.transpose() * polar.rotation - Mat3::Identity()).norm(),
                                          std::abs(polar.rotation.determinant() - 1)}));
  }
  c.at_most("of either rotation: R^T R off 1, det R off 1", off, 1e-12);
}

}  // namespace test_inversion

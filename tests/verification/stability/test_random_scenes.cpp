// SPDX-License-Identifier: Apache-2.0
// Scenes at random: each ends converged or with a named reason, whatever they ask for.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <chrono>
#include <cstdlib>

#include "hexmesh/core/error.h"
#include "mesh/points.h"
#include "motions.h"
#include "record.h"
#include "support/experiments.h"
#include "support/plain_equilibrium.h"
#include "support/solve.h"

namespace test_random_scenes {

using namespace hexsolver;
using namespace testing_support;
using stability::Case;

constexpr const char* family = "14 random scenes";

/// Of forces by differences in extended precision, which are good to 1e-10 and more where cells hardly turn.
constexpr double most_anew = 1e-6;

/// Numbers that are the same for the same seed; who gets which may differ between compilers, which choose the order of
/// arguments.
class Dice {
public:
  explicit Dice(unsigned seed) : random_(seed) {}
  double uniform(double low, double high) { return low + (high - low) * (random_() / 4294967296.0); }
  double magnitude(double low, double high) { return std::exp(uniform(std::log(low), std::log(high))); }
  int whole(int low, int high) { return low + static_cast<int>(random_() % static_cast<unsigned>(high - low + 1)); }
  bool one_in(int n) { return whole(1, n) == 1; }
  Vec3 direction() {
    Vec3 v;
    do v = Vec3(uniform(-1, 1), uniform(-1, 1), uniform(-1, 1));
    while (!(v.norm() > 0.1 && v.norm() < 1));
    return v.normalized();
  }
  template <class T>
  T among(std::initializer_list<T> all) {
    return all.begin()[whole(0, static_cast<int>(all.size()) - 1)];
  }

private:
  std::mt19937 random_;
};

/// Balls, blocks, sheets and threads, some of another material, some cut away.
hexmesh::LabelVolume random_body(Dice& dice) {
  const Index3 extent = {dice.whole(1, 10), dice.whole(1, 10), dice.whole(1, 10)};
  struct Piece {
    Vec3 center, size;
    bool is_ball;
    int label;
  };
  const Vec3 whole(extent[0], extent[1], extent[2]);
  std::vector<Piece> pieces = {{whole / 2, whole * dice.uniform(0.2, 0.6), dice.one_in(2), 1}};
  for (int n = dice.whole(0, 5); n > 0; --n)
    pieces.push_back(
        {whole.cwiseProduct(Vec3(dice.uniform(0, 1), dice.uniform(0, 1), dice.uniform(0, 1))),
         whole.cwiseProduct(Vec3(dice.uniform(0.02, 0.4), dice.uniform(0.02, 0.4), dice.uniform(0.02, 0.4))),
         dice.one_in(2), dice.among({1, 1, 2, 2, 0})});
  const Vec3 spacing = dice.one_in(3) ? Vec3(dice.magnitude(0.5, 4), dice.magnitude(0.5, 4), dice.magnitude(0.5, 4))
                                      : Vec3(Vec3::Constant(dice.magnitude(0.1, 10)));
  const Mat3 direction =
      dice.one_in(3) ? random_rotation(static_cast<unsigned>(dice.whole(1, 1000))) : Mat3(Mat3::Identity());
  const Vec3 origin = dice.one_in(4) ? Vec3(dice.direction() * 1e4) : Vec3(Vec3::Zero());
  return make_volume(
      extent, spacing,
      [&](const Index3& i) {
        int label = 0;
        for (const Piece& p : pieces) {
          const Vec3 d = (Vec3(i[0], i[1], i[2]) + Vec3::Constant(0.5) - p.center).cwiseQuotient(p.size);
          if (p.is_ball ? d.norm() < 1 : d.cwiseAbs().maxCoeff() < 1) label = p.label;
        }
        return label;
      },
      direction, origin);
}

Lattice random_lattice(Dice& dice) {
  const hexmesh::LabelVolume volume = random_body(dice);
  std::vector<hexmesh::LatticeSegment> segments;
  for (const hexmesh::Segment& s : volume.segments)
    segments.push_back(
        {s,
         hexmesh::material_from_units(dice.magnitude(0.01, 1e7), dice.among({0.0, 0.3, 0.45, 0.49, 0.499}),
                                      dice.magnitude(10, 1e4)),
         0, ""});
  return hexmesh::build_lattice(volume, segments, {0, {dice.whole(0, 3), dice.whole(0, 3), dice.whole(0, 3)}});
}

Selection random_selection(Dice& dice, const std::vector<Vec3>& points, double size) {
  Selection s;
  const auto any = [&] { return points[static_cast<std::size_t>(dice.whole(0, static_cast<int>(points.size()) - 1))]; };
  switch (dice.whole(0, 2)) {
    case 0:
      s.balls = {{any(), dice.one_in(4) ? 0 : size * dice.uniform(0.02, 0.5)}};
      break;
    case 1:
      s.halfspace = HalfSpace{any(), dice.direction()};
      break;
    default:
      const Vec3 center = any(),
                 half = size * Vec3(dice.uniform(0.05, 0.5), dice.uniform(0.05, 0.5), dice.uniform(0.05, 0.5));
      s.box = hexmesh::box_between(center - half, center + half);
  }
  s.on = dice.among({SurfacePoints::faces, SurfacePoints::faces, SurfacePoints::voxels, SurfacePoints::nodes});
  s.max_distance = size;
  return s;
}

Scene random_scene(Dice& dice, const Lattice& lattice, int& level) {
  const std::vector<Vec3> points = material_points(lattice);
  Vec3 low = points[0], high = low;
  for (const Vec3& p : points) {
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  const double size = (high - low).norm() + lattice.voxels.spacing().norm();
  double softest = 1e300;
  for (const auto& m : lattice.materials) softest = std::min(softest, m.material.young);

  Scene scene;
  scene.elasticity =
      dice.among({Elasticity::cauchy, Elasticity::corotational, Elasticity::corotational, Elasticity::corotational,
                  Elasticity::green_lagrange, Elasticity::neo_hookean, Elasticity::stable_neo_hookean});
  if (scene.elasticity == Elasticity::green_lagrange) scene.volumetric = Volumetric::full;
  if (scene.elasticity == Elasticity::corotational && dice.one_in(6)) scene.rotation = Rotation::edges;
  scene.islands = dice.among({Islands::error, Islands::drop, Islands::hold});
  scene.compromise = !dice.one_in(4);
  level = dice.whole(0, static_cast<int>(lattice.levels.size()) - 1);
  for (int n = dice.whole(0, 4); n > 0; --n) {
    Condition c;
    c.name = fmt::format("condition {}", n);
    c.where = "random";
    c.selection = random_selection(dice, points, size);
    if (dice.one_in(2)) c.by = dice.direction() * size * dice.magnitude(1e-6, 2);
    if (dice.one_in(8)) c.turn = Turn{dice.direction(), dice.uniform(-4, 4), points[0]};
    if (dice.one_in(5)) c.axes = {dice.one_in(2), dice.one_in(2), true};
    scene.conditions.push_back(c);
  }
  for (int n = dice.whole(0, 2); n > 0; --n) {
    Force f;
    f.name = fmt::format("force {}", n);
    f.where = "random";
    f.selection = random_selection(dice, points, size);
    if (dice.one_in(2))
      f.total = dice.direction() * softest * size * size * dice.magnitude(1e-6, 1);
    else
      f.pressure = softest * dice.magnitude(1e-6, 1);
    scene.forces.push_back(f);
  }
  if (dice.one_in(3)) scene.gravity = 9810 * dice.direction();
  if (dice.one_in(5)) {
    Contact c;
    c.name = "obstacle";
    c.where = "random";
    const Vec3 normal = dice.direction();
    const Vec3 at = (low + high) / 2 - normal * size * dice.uniform(0.3, 0.8);
    if (dice.one_in(2))
      c.obstacle = HalfSpace{at, normal};
    else
      c.obstacle = Ball{at - normal * size * 0.3, size * 0.3};
    c.by = normal * size * dice.uniform(0, 0.2);
    c.stiffness = softest * size * dice.magnitude(1e-3, 1e2);
    scene.contacts.push_back(c);
  }
  if (dice.one_in(3)) {
    Dynamics d;
    d.step = dice.magnitude(1e-4, 1);
    d.duration = 10 * d.step;
    d.solver = dice.among({StepSolver::cg, StepSolver::jacobi, StepSolver::multigrid});
    d.solver_iterations = dice.among({0, 1, 10});
    d.newton_iterations = d.solver_iterations > 0 ? dice.whole(1, 2) : 0;
    d.velocity = dice.one_in(2) ? Vec3(dice.direction() * size * dice.magnitude(1e-2, 1e2)) : Vec3(Vec3::Zero());
    scene.dynamics = d;
    scene.damping = {dice.one_in(2) ? dice.magnitude(0.01, 10) : 0, dice.one_in(2) ? dice.magnitude(1e-4, 0.1) : 0};
  }
  return scene;
}

struct Ending {
  enum class Kind { converged, stopped, refused } kind = Kind::refused;
  std::string reason;
  bool finite = true;
  double residual = 0;
  std::optional<double> anew = {};  ///< of a converged one: the residual of its equations assembled anew
};

/// How far a motion's state is from a step after the one before it.
struct LastStep {
  hexmesh::MotionStep before, after;
  void take(const Motion& m) {
    std::swap(before, after);
    after = {to_points(m.displacement()), to_points(m.velocity())};
  }
};

Ending end_of(const Lattice& lattice, const Scene& scene, int level) {
  try {
    LastStep last;
    const Outcome outcome = scene.dynamics
                                ? solve_dynamics(lattice, scene, level, [&](const Motion& m) { last.take(m); })
                                : solve_equilibrium(lattice, scene, level);
    const SolveReport& report = outcome.report;
    const hexmesh::Result& r = outcome.result;
    Ending e{report.converged ? Ending::Kind::converged : Ending::Kind::stopped, report.reason, true,
             report.relative_residual};
    for (const auto* field : {&r.displacement, &r.velocity})
      for (const Vec3& v : *field) e.finite = e.finite && v.allFinite();
    const bool is_whole_step =
        scene.dynamics && scene.dynamics->newton_iterations == 0 && report.motion->substeps == report.motion->steps;
    if (report.converged && report.held_cells == 0 && (is_whole_step || !scene.dynamics))
      if (const auto anew = plain_equilibrium(lattice, scene, r, scene.dynamics ? &last.before : nullptr)) {
        e.anew = anew->relative_residual;
        for (std::size_t c = 0; c < report.conditions.size() && !scene.dynamics; ++c)
          EXPECT_NEAR(anew->misfits_mm[c], report.conditions[c].misfit_mm, 1e-9 * (1 + anew->misfits_mm[c]));
      }
    return e;
  } catch (const hexmesh::Error& e) {
    return {Ending::Kind::refused, e.what(), true, 0};
  }
}

TEST(RandomScenes, EndConvergedOrWithAReason) {
  const char* only = std::getenv("HEXTOOLS_STABILITY_SEED");
  const unsigned first = only ? static_cast<unsigned>(std::atoi(only)) : 1;
  const unsigned last = only ? first : stability::whole_or(2000U, 50U);
  Case c(family, "bodies, materials, conditions, loads, obstacles, levels, motions");
  std::array<int, 3> count{};
  int nameless = 0, not_finite = 0, not_solved = 0, empty = 0, recomputed = 0;
  double largest_anew = 0;
  double slowest = 0;
  unsigned slowest_seed = 0;
  for (unsigned seed = first; seed <= last; ++seed) {
    SCOPED_TRACE(fmt::format("HEXTOOLS_STABILITY_SEED={}", seed));
    printf("seed %u: ", seed);  // before anything can go wrong
    fflush(stdout);
    Dice dice(seed);
    const auto start = std::chrono::steady_clock::now();
    Ending e;
    try {
      const Lattice lattice = random_lattice(dice);
      int level = 0;
      const Scene scene = random_scene(dice, lattice, level);
      if (only)
        printf("level %d of %zu, %zu cells, %s%s\n", level, lattice.levels.size(),
               lattice.levels[static_cast<std::size_t>(level)].cells.size(), stability::law_name(scene.elasticity),
               scene.dynamics ? ", motion" : "");
      e = end_of(lattice, scene, level);
      if (e.anew) {
        ++recomputed;
        largest_anew = std::max(largest_anew, *e.anew);
        EXPECT_LE(*e.anew, most_anew);
      }
      const bool to_tolerance = !scene.dynamics || scene.dynamics->newton_iterations == 0;
      if (e.kind == Ending::Kind::converged && to_tolerance && !(e.residual <= scene.tolerance)) {
        ++not_solved;
        ADD_FAILURE() << "converged with a residual of " << e.residual;
      }
    } catch (const hexmesh::Error& error) {
      e = {Ending::Kind::refused, error.what(), true, 0};  // no voxel is left
      ++empty;
    } catch (const std::exception& error) {
      ADD_FAILURE() << error.what();
    }
    const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    if (seconds > slowest) {
      slowest = seconds;
      slowest_seed = seed;
    }
    ++count[static_cast<std::size_t>(e.kind)];
    if (e.reason.empty()) {
      ++nameless;
      ADD_FAILURE() << "no reason is named";
    }
    if (!e.finite) {
      ++not_finite;
      ADD_FAILURE() << "not finite: " << e.reason;
    }
    printf("%.1f s, %s%s\n", seconds, e.reason.c_str(), e.anew ? fmt::format("; anew {:.1e}", *e.anew).c_str() : "");
  }
  c.note("scenes", last - first + 1.0);
  c.at_least("part of them that converged", double(count[0]) / (last - first + 1), only ? 0 : 0.5);
  c.note("stopped with a reason, the last good state kept (exit 5)", count[1]);
  c.note("refused with a reason (exit 3 or 4)", count[2]);
  c.note("of these without any material", empty);
  c.at_least("part of these recomputed by another assembly", double(recomputed) / std::max(count[0], 1),
             only ? 0 : 0.5);
  c.at_most("largest residual of these there", largest_anew, most_anew);
  c.at_most("without a reason", nameless, 0);
  c.at_most("not finite", not_finite, 0);
  c.at_most("called converged above the tolerance", not_solved, 0);
  printf("slowest: seed %u, %.1f s\n", slowest_seed, slowest);
}

}  // namespace test_random_scenes

// SPDX-License-Identifier: Apache-2.0
// Counts what is asked of the heap, in an executable of its own: it replaces malloc.
#include <gtest/gtest.h>

#include <atomic>
#include <cstdlib>

#include "hexsolver/dynamics/motion.h"
#include "support/bodies.h"

using namespace hexsolver;
using namespace testing_support;

#if defined(__GLIBC__) && !defined(__SANITIZE_ADDRESS__)

namespace {

std::atomic<bool> counting{false};
std::atomic<int> allocations{0};

void count() {
  if (counting.load(std::memory_order_relaxed)) ++allocations;
}

}  // namespace

extern "C" {
void* __libc_malloc(std::size_t size);
void* __libc_calloc(std::size_t count, std::size_t size);
void* __libc_realloc(void* old, std::size_t size);
void* __libc_memalign(std::size_t alignment, std::size_t size);

void* malloc(std::size_t size) {
  count();
  return __libc_malloc(size);
}
void* calloc(std::size_t number, std::size_t size) {
  count();
  return __libc_calloc(number, size);
}
void* realloc(void* old, std::size_t size) {
  count();
  return __libc_realloc(old, size);
}
void* aligned_alloc(std::size_t alignment, std::size_t size) {
  count();
  return __libc_memalign(alignment, size);
}
}

namespace {

struct Case {
  const char* name;
  StepSolver solver;
  int iterations;
  Elasticity elasticity;
  bool is_nearly_incompressible = false;
};

class Allocation : public testing::TestWithParam<Case> {};

}  // namespace

TEST_P(Allocation, NoneAfterTheFirstStep) {
  const Lattice lattice = GetParam().is_nearly_incompressible
                              ? one_material(
                                    {16, 16, 16}, {1, 1, 1}, [](const Index3&) { return true; }, 100, 0.49)
                              : bitten_ball({1, 1, 1});
  Scene scene;
  scene.elasticity = GetParam().elasticity;
  Dynamics d;
  d.step = 0.005;
  d.duration = 1;
  d.solver = GetParam().solver;
  d.solver_iterations = GetParam().iterations;
  d.newton_iterations = GetParam().iterations > 0 ? 1 : 0;
  scene.dynamics = d;
  scene.gravity = Vec3(0, 0, -9810);
  scene.damping = {1, 0.001};
  // A part held and moved, an obstacle touched on the way.
  Condition held;
  held.name = "held";
  held.where = "test";
  held.selection.halfspace = HalfSpace{{5, 0, 0}, {1, 0, 0}};
  held.history = History{{{0, Vec3::Zero()}, {1, Vec3(0, 0, -20)}}};
  held.selection.halfspace->point = lattice.voxels.position({15, 8, 8});
  scene.conditions = {held};
  Contact floor;
  floor.name = "floor";
  floor.obstacle = HalfSpace{lattice.voxels.position({0, 0, -1.5}), {0, 0, 1}};
  floor.stiffness = 0.05;
  scene.contacts = {floor};
  Motion motion(lattice, scene, 1);
  ASSERT_TRUE(motion.step()) << motion.reason();
  const int made = motion.counts().preconditioners;
  allocations = 0;
  counting = true;
  bool solved = true;
  for (int n = 0; n < 40 && solved; ++n) solved = motion.step();
  counting = false;
  ASSERT_TRUE(solved) << motion.reason();
  EXPECT_GT(motion.energies().contact, 0);
  EXPECT_EQ(allocations, 0) << "with " << motion.counts().preconditioners - made << " preconditioners made anew";
  RecordProperty("made", motion.counts().preconditioners - made);
}

INSTANTIATE_TEST_SUITE_P(Ways, Allocation,
                         testing::Values(Case{"cg", StepSolver::cg, 10, Elasticity::corotational},
                                         Case{"cauchy", StepSolver::cg, 10, Elasticity::cauchy},
                                         Case{"jacobi", StepSolver::jacobi, 10, Elasticity::corotational},
                                         Case{"converged", StepSolver::jacobi, 0, Elasticity::corotational},
                                         Case{"neo_hookean", StepSolver::jacobi, 10, Elasticity::neo_hookean},
                                         Case{"multigrid", StepSolver::multigrid, 2, Elasticity::corotational},
                                         Case{"multigrid_converged", StepSolver::multigrid, 0,
                                              Elasticity::corotational},
                                         Case{"pressures", StepSolver::multigrid, 0, Elasticity::corotational, true}),
                         [](const auto& p) { return p.param.name; });

#endif

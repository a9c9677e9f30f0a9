// SPDX-License-Identifier: Apache-2.0
#include "level_problem.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "hexmesh/core/error.h"
#include "hexmesh/lattice/element_tree.h"
#include "hexsolver/ground_springs.h"
#include "hexsolver/loads.h"
#include "hexsolver/selection.h"
#include "hexsolver/supports.h"

namespace hexsolver {
namespace {

using hexmesh::Error;
using hexmesh::ErrorKind;
using hexmesh::Lattice;

/// Where points cannot come closer than this part of the largest prescribed displacement, conditions contradict.
constexpr double conflict_fraction = 0.05;
/// What is left of the stiffness of islands that are dropped: they are held, so it only keeps the matrices regular.
constexpr double dropped_stiffness = 1e-9;
/// Stiffness of the springs that hold islands, over that of their cells' nodes: parts that hang on others by an edge
/// or a corner follow these.
constexpr double island_spring = 1e-4;

[[noreturn]] void fail_unsupported(const std::vector<FreePart>& free, int level) {
  std::vector<std::string> motions;
  bool only_islands = true;
  for (const FreePart& part : free) {
    motions.insert(motions.end(), part.motions.begin(), part.motions.end());
    only_islands = only_islands && part.is_island;
  }
  const std::size_t shown = std::min<std::size_t>(motions.size(), 3);
  throw Error(ErrorKind::geometry,
              fmt::format("missing supports at level {}: {}{}, expected every part held{}", level,
                          fmt::join(motions.begin(), motions.begin() + static_cast<std::ptrdiff_t>(shown), "; "),
                          motions.size() > shown ? fmt::format("; and {} more", motions.size() - shown) : "",
                          only_islands ? ", or solve.islands = \"drop\" or \"hold\"" : ""));
}

double largest_prescribed(const Scene& scene) {
  double largest = 0;
  for (const Condition& c : scene.conditions) largest = std::max(largest, c.by.norm());
  return largest;
}

}  // namespace

LevelProblem::LevelProblem(const Lattice& lattice, const Scene& scene, int level)
    : lattice_(lattice),
      scene_(scene),
      level_(level),
      hierarchy_(
          Mesh(lattice.levels[static_cast<std::size_t>(level)].cells, lattice.cell_edges(level), lattice.corner()),
          lattice.corner()),
      conditions_(scene.conditions) {
  Selector selector(lattice, level, mesh());
  std::vector<ConstraintPoint> points = select_points(scene, selector);
  find_islands(points);
  constraints_ = std::make_unique<const Constraints>(mesh(), std::move(points));
  loads_ = make_loads(scene, lattice, level, mesh(), selector,
                      scene.islands == Islands::drop ? islands_ : std::vector<bool>{});
  for (const auto& load : loads_) load_totals_.push_back({load->name(), load->total()});
}

void LevelProblem::find_islands(std::vector<ConstraintPoint>& points) {
  const std::vector<FreePart> free = free_parts(mesh(), points);
  if (free.empty()) return;
  if (scene_.islands == Islands::error ||
      !std::all_of(free.begin(), free.end(), [](const FreePart& p) { return p.is_island; }))
    fail_unsupported(free, level_);

  islands_.resize(mesh().num_cells());
  for (const FreePart& part : free)
    for (const std::int32_t c : part.cells) islands_[static_cast<std::size_t>(c)] = true;
  if (scene_.islands == Islands::drop) hold_island_nodes(points);
}

/// All nodes that islands do not share with other parts.
void LevelProblem::hold_island_nodes(std::vector<ConstraintPoint>& points) {
  std::vector<bool> done(mesh().num_nodes());
  for (std::size_t c = 0; c < mesh().num_cells(); ++c)
    if (!islands_[c])
      for (const std::int32_t n : mesh().cell_nodes()[c]) done[static_cast<std::size_t>(n)] = true;
  const auto condition = static_cast<std::int32_t>(conditions_.size());
  conditions_.emplace_back().name = "islands";
  for (std::size_t c = 0; c < mesh().num_cells(); ++c)
    for (int a = 0; a < 8 && islands_[c]; ++a) {
      const auto node = static_cast<std::size_t>(mesh().cell_nodes()[c][static_cast<std::size_t>(a)]);
      if (done[node]) continue;
      done[node] = true;
      points.push_back(
          {condition, static_cast<std::int32_t>(c), NodeWeights::Unit(a), Vec3::Zero(), {true, true, true}});
    }
}

std::size_t LevelProblem::num_island_cells() const {
  return static_cast<std::size_t>(std::count(islands_.begin(), islands_.end(), true));
}

std::vector<std::string> LevelProblem::conflicts() const {
  std::vector<double> miss(conditions_.size());
  const std::vector<double> of_point = constraints_->contradiction();
  for (std::size_t p = 0; p < of_point.size(); ++p) {
    double& worst = miss[static_cast<std::size_t>(constraints_->held()[p].condition)];
    worst = std::max(worst, of_point[p]);
  }
  std::vector<std::string> words;
  for (std::size_t c = 0; c < miss.size(); ++c)
    if (miss[c] > conflict_fraction * largest_prescribed(scene_))
      words.push_back(
          fmt::format("'{}' ({}, misses by {:.3g} mm)", conditions_[c].name, conditions_[c].where, miss[c]));
  return words;
}

void LevelProblem::build_potential() {
  const hexmesh::ElementMatrices matrices(lattice_.cell_edges(level_));
  std::vector<hexmesh::Element> elements = hexmesh::form_elements(lattice_, level_);
  if (scene_.stiffness == Stiffness::uniform)
    for (hexmesh::Element& e : elements) e = hexmesh::spread_evenly(e);
  std::vector<ElementModel> models(elements.size());
#pragma omp parallel for schedule(static)
  for (std::size_t e = 0; e < models.size(); ++e)
    models[e] = make_element_model(matrices, elements[e], scene_.volumetric);

  std::vector<std::int32_t> element = lattice_.levels[static_cast<std::size_t>(level_)].element;
  if (scene_.islands == Islands::drop && !islands_.empty()) {
    const std::size_t count = models.size();
    for (std::size_t e = 0; e < count; ++e) {
      models.push_back(models[e]);
      models.back().stiffness *= dropped_stiffness;
    }
    for (std::size_t c = 0; c < element.size(); ++c)
      if (islands_[c]) element[c] += static_cast<std::int32_t>(count);
  }
  std::vector<std::pair<std::int32_t, double>> springs;
  for (std::size_t c = 0; c < islands_.size() && scene_.islands == Islands::hold; ++c)
    if (islands_[c])
      springs.emplace_back(static_cast<std::int32_t>(c),
                           island_spring * models[static_cast<std::size_t>(element[c])].stiffness.trace() / 24);

  potential_ = std::make_unique<Potential>(mesh());
  auto elastic = make_elastic_cells(mesh(), std::move(element), std::move(models), scene_.strain, scene_.rotation);
  elastic_ = elastic.get();
  potential_->add(std::move(elastic));
  if (!springs.empty()) potential_->add(std::make_unique<GroundSprings>(mesh(), std::move(springs)));
  for (auto& load : loads_) potential_->add(std::move(load));
  loads_.clear();
}

int first_nested_level(const Lattice& lattice, int finest) {
  constexpr std::size_t least_cells = 64;
  constexpr std::size_t least_compared_cells = 8;  // of levels that are there for the error estimate alone
  constexpr int most_compared = 2;
  int first = finest;
  for (int coarser = finest + 1; coarser < static_cast<int>(lattice.levels.size()); ++coarser) {
    const std::size_t cells = lattice.levels[static_cast<std::size_t>(coarser)].cells.size();
    if (cells >= least_cells || (first < finest + most_compared && cells >= least_compared_cells)) first = coarser;
  }
  return first;
}

std::vector<ConditionReport> report_points(const LevelProblem& problem) {
  std::vector<ConditionReport> out;
  for (const Condition& c : problem.conditions()) out.push_back({c.name, 0, 0, 0, Vec3::Zero()});
  for (const ConstraintPoint& p : problem.constraints().points()) ++out[static_cast<std::size_t>(p.condition)].points;
  const std::vector<std::size_t> kept = problem.constraints().kept_by_condition(out.size());
  for (std::size_t c = 0; c < kept.size(); ++c) out[c].kept = kept[c];
  return out;
}

std::vector<std::string> check_single_points(const Scene& scene) {
  std::vector<std::string> warnings;
  for (const Condition& c : scene.conditions) {
    const std::vector<Ball>& balls = c.selection.balls;
    if (std::none_of(balls.begin(), balls.end(), [](const Ball& b) { return b.radius == 0; })) continue;
    const std::string what = fmt::format(
        "condition '{}' ({}) holds single points (radius_mm = 0), whose displacement has no limit as cells get smaller",
        c.name, c.where);
    if (scene.accuracy) throw Error(ErrorKind::input, what + ", expected a radius > 0 with accuracy_mm");
    warnings.push_back(what);
  }
  return warnings;
}

std::vector<std::string> check_conflicts(const LevelProblem& problem, const Scene& scene) {
  const std::vector<std::string> conflicts = problem.conflicts();
  if (conflicts.empty()) return {};
  const std::string what =
      fmt::format("conditions contradict each other at level {}: {}", problem.level(), fmt::join(conflicts, " and "));
  if (scene.compromise) return {what + "; they are met by least squares"};
  throw Error(ErrorKind::geometry,
              fmt::format("{}, expected displacements that the cells can follow (a finer level, patches farther apart, "
                          "or solve.conflicts = \"compromise\")",
                          what));
}

}  // namespace hexsolver

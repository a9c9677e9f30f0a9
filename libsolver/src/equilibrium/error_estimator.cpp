// SPDX-License-Identifier: Apache-2.0
#include "equilibrium/error_estimator.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <complex>

namespace hexsolver {
namespace {

/// Rates that differences of levels show: h to h^2 give 0.5 to 0.25, singular strains at the rims of supports more.
constexpr double least_rate = 0.2, most_rate = 0.7, usual_rate = 0.45;
/// Less is by chance.
constexpr double rate_of_chance = 0.15;

/// How differences go on: each is r times as large as the one before and turned by an angle against it.
struct Rate {
  double r = usual_rate, cosine = 1;

  /// q + q^2 + ... + q^count with q = r exp(i angle); count 0: without end.
  std::complex<double> series(int count) const {
    const std::complex<double> q = std::polar(r, std::acos(cosine));
    return q * (count > 0 ? 1.0 - std::pow(q, count) : 1.0) / (1.0 - q);
  }
};

constexpr double mostly = 0.75;

/// Whether no level as fine as the finest one sees what stiffnesses the cells of a level average over.
bool is_mixed_in_both(double mixture, double mixture_of_finest) {
  constexpr double without_effect = 0.05;
  return mixture_of_finest > without_effect && mixture_of_finest > mostly * mixture;
}

/// Whether the next finer level has gaps end where a level does.
bool closes_as_finer(const hexmesh::OpenGaps& gaps) {
  constexpr double without_effect = 0.02;
  return gaps.open > without_effect && gaps.closed > 0 && gaps.closed_finer > mostly * gaps.closed;
}

/// The cosine between two differences of these lengths whose sum has that one.
double cosine_of(double before, double step, double sum) {
  const double product = 2 * before * step;
  return product > 0 ? std::clamp((sum * sum - before * before - step * step) / product, -1.0, 1.0) : 1;
}

/// The largest error over the largest reaction; nothing where one is unknown or there is no reaction.
std::optional<double> largest_part(const std::vector<std::optional<double>>& errors,
                                   const std::vector<Vec3>& reactions) {
  double error = 0, reaction = 0;
  for (std::size_t c = 0; c < errors.size(); ++c) {
    if (!errors[c]) return {};
    error = std::max(error, *errors[c]);
    reaction = std::max(reaction, reactions[c].norm());
  }
  if (!(reaction > 0)) return {};
  return error / reaction;
}

}  // namespace

std::vector<Averages> averages_of(const hexmesh::Lattice& lattice) {
  std::vector<Averages> out;
  for (const hexmesh::Level& level : lattice.levels) out.push_back({level.mixture, level.gaps});
  return out;
}

double unseen_by_cycle(const hexmesh::Lattice& lattice) {
  constexpr double seen = 50;
  double ratio = 0;
  for (const hexmesh::VoxelMaterial& m : lattice.materials)
    ratio = std::max(ratio, m.material.bulk_modulus() / m.material.shear_modulus());
  return std::max(1.0, ratio / seen);
}

double usual_margin(const Scene& scene, Elasticity elasticity) {
  constexpr double usual = 1.5, of_condensed = 2.5;
  if (!scene.contacts.empty()) return unsure_margin;
  const bool are_halved = scene.is_graded() && elasticity != Elasticity::corotational;
  return scene.stiffness_of_cells() == Stiffness::condensed && !are_halved ? of_condensed : usual;
}

double rate_of_errors(const std::vector<double>& coarse_to_fine) {
  if (coarse_to_fine.size() < 2) return usual_rate;
  return std::clamp(coarse_to_fine.back() / coarse_to_fine.end()[-2], least_rate, most_rate);
}

void ErrorEstimator::add(std::vector<std::optional<ElasticCells::Size>> differences, LevelMeasures measures,
                         int finer) {
  if (differences.empty()) {
    num_before_ += known_.size();
    known_.clear();
  }
  known_.push_back({std::move(differences), std::move(measures), finer});
}

template <class Distance>
std::optional<double> ErrorEstimator::error(std::size_t i, const Distance& distance, double negligible) const {
  const std::size_t last = known_.size() - 1;
  const int finer = known_[last].finer;
  if (last == 0) return {};
  const double step = distance(last - 1, last);
  std::optional<double> measured;
  Rate rate;
  double by_chance = 0;  // what a step lacks that is shorter than cells can make it
  if (measures_rates_ && last > 1 && step > negligible) {
    const double before = distance(last - 2, last - 1);
    measured = before > 0 ? step / before : 0;
    rate = {std::clamp(*measured, least_rate, most_rate), cosine_of(before, step, distance(last - 2, last))};
    by_chance = std::clamp(rate_of_chance * before - step, 0.0, step);
  }
  if (i == last) {
    if (!measures_rates_ || finer > 0 || last < 2 || measured.value_or(0) > most_rate) return {};
    return (step + by_chance) * std::abs(rate.series(0));
  }
  if (finer == 0) return distance(i, last);
  if (is_hidden(i)) return {};
  if (measured && *measured > 1) return {};
  return distance(i, last) + by_chance + (step + by_chance) * std::max(0.0, rate.series(finer).real());
}

bool ErrorEstimator::is_hidden(std::size_t i) const {
  const Averages &own = known_[i].measures.averages, &finest = known_.back().measures.averages;
  if (is_mixed_in_both(own.mixture, finest.mixture)) return true;
  return i + 1 < known_.size() && std::all_of(known_.begin() + static_cast<std::ptrdiff_t>(i), known_.end() - 1,
                                              [](const Known& k) { return closes_as_finer(k.measures.averages.gaps); });
}

double ErrorEstimator::difference(std::size_t i, std::size_t j, double ElasticCells::Size::*size) const {
  double sum = 0;
  while (i < j) {
    std::size_t with = j;
    while (with > i + 1 && !known_[with].differences[i]) --with;
    sum += (*known_[with].differences[i]).*size;
    i = with;
  }
  return sum;
}

bool ErrorEstimator::closes_in() const {
  if (!measures_rates_ || known_.size() < 3) return true;
  const std::size_t last = known_.size() - 1;
  const auto step = [&](std::size_t to) { return difference(to - 1, to, &ElasticCells::Size::mean); };
  return step(last) <= most_rate * step(last - 1);
}

void ErrorEstimator::write(std::vector<LevelReport>& levels) const {
  if (known_.empty()) return;
  constexpr double exact = 1e-3;  // of energies and forces of levels that are solved to nested_tolerance
  const LevelMeasures& last = known_.back().measures;
  for (std::size_t i = 0; i < known_.size() && num_before_ + i < levels.size(); ++i) {
    ErrorEstimate& e = levels[num_before_ + i].error;
    const auto by_size = [&](double ElasticCells::Size::*size) {
      return error(
          i, [&](std::size_t a, std::size_t b) { return difference(a, b, size); }, 0);
    };
    e.is_hidden = known_.back().finer > 0 && is_hidden(i);
    e.mean_mm = by_size(&ElasticCells::Size::mean);
    e.max_mm = by_size(&ElasticCells::Size::largest);
    const auto of_energy = [&](std::size_t a, std::size_t b) {
      return std::abs(known_[a].measures.strain_energy - known_[b].measures.strain_energy);
    };
    e.strain_energy_n_mm = error(i, of_energy, exact * std::abs(last.strain_energy));
    e.reactions_n.clear();
    for (std::size_t c = 0; c < known_[i].measures.reactions.size(); ++c) {
      const auto of_reaction = [&](std::size_t a, std::size_t b) {
        return (known_[a].measures.reactions[c] - known_[b].measures.reactions[c]).norm();
      };
      e.reactions_n.push_back(error(i, of_reaction, exact * last.reactions[c].norm()));
    }
    e.of_reactions = largest_part(e.reactions_n, last.reactions);
  }
}

std::string accuracy_reached(const LevelReport& level, const Scene& scene) {
  std::string words = fmt::format("the estimated error of level {} is", level.level);
  const auto add = [&](const std::optional<double>& e, double scale, const char* unit, const std::string& asked) {
    words += fmt::format(" {}, {} was asked", e ? fmt::format("{:.2g} {}", scale * *e, unit) : "unknown", asked);
  };
  if (scene.accuracy) add(level.error.mean_mm, 1, "mm", fmt::format("accuracy_mm = {:g}", *scene.accuracy));
  if (scene.accuracy && scene.reaction_accuracy) words += ", and of reactions";
  if (scene.reaction_accuracy)
    add(level.error.of_reactions, 100, "% of the largest reaction",
        fmt::format("accuracy_reactions = {:g}", *scene.reaction_accuracy));
  return words;
}

}  // namespace hexsolver

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "hexmesh/lattice/lattice.h"
#include "hexsolver/report/report.h"
#include "hexsolver/scene/scene.h"
#include "terms/elastic.h"

namespace hexsolver {

/// Coarser levels only provide a start.
inline constexpr double nested_tolerance = 1e-4;

/// With solve.tolerance = "auto" what one more Newton step would add is at most this part of what a level adds to the
/// coarser one's solution. Errors of cells that fall by q from level to level are q / (1 - q) of that, q >= 0.15; of
/// them a twentieth, a quarter of it for reactions and for what one cycle does not see.
inline constexpr double deserved_part = 0.15 / 0.85 / 20 / 4;

/// Likewise of looks on the way to an accuracy, of which only the size counts.
inline constexpr double part_of_looks = 0.02;

/// By how much more than one cycle says equations may be off: in its measure, change of volume, errors that keep volume
/// count for little. As measured: nothing up to kappa / mu = 50 (nu = 0.49), a hundredth of the error is seen at 5000.
double unseen_by_cycle(const hexmesh::Lattice& lattice);

/// Cells of a level whose differences from others mean something, at least.
inline constexpr std::size_t least_compared = 100;

/// Cells of the finest level that errors are told from, at least, where the lattice has as many: what necks, slits and
/// thin walls of a small body do shows on none that has fewer.
inline constexpr std::size_t least_told_from = 3000;

/// By how much an estimate may be too small: one that is not sure, or with contacts.
inline constexpr double unsure_margin = 3;

/// Likewise one that is sure. What is inside condensed cells turns with them alone: what turns there by itself shows on
/// the finest levels only. And coarse levels of condensed cells may agree by chance, where a thin part or a gap that
/// ends inside them bends on none of them: it does once cells are halved where the error comes from.
double usual_margin(const Scene& scene, Elasticity elasticity);

/// What is left of errors one level finer, as the last two show, or as is usual.
double rate_of_errors(const std::vector<double>& coarse_to_fine);

/// What the cells of a level take together, and what levels that do so alike do not show.
struct Averages {
  double mixture = 0;      ///< of stiffnesses, see hexmesh::count_mixture()
  hexmesh::OpenGaps gaps;  ///< as far as they are closed
};

/// Of each level of a lattice.
std::vector<Averages> averages_of(const hexmesh::Lattice& lattice);

/// What is compared of a solution beside its displacement.
struct LevelMeasures {
  double strain_energy = 0;     ///< [N mm]
  std::vector<Vec3> reactions;  ///< of each condition [N]
  Averages averages = {};
};

/// How far the levels of a nested iteration are from the lattice's finest level, from what they differ by.
///
/// Let d_ij be what levels i and j of the iteration differ by, n the finest of them, r = d_(n-1)n / d_(n-2)(n-1) the
/// rate that the last three show, a the angle between the two differences, which d_(n-2)n shows, and k how many levels
/// the lattice has beyond n, graded cells counting how often their largest can be halved. The error of a level i < n is
/// d_in + d_(n-1)n Re(q + q^2 + ... + q^k), q = r exp(i a), the second part, which is not taken below 0, what no level
/// shows. Cells' errors fall to a quarter at best: a d_(n-1)n of less than 0.15 d_(n-2)(n-1) is so by chance and counts
/// as that, at most twice. That of n itself is unknown unless it is the finest of the lattice: then it is its distance
/// from cells of no size, d_(n-1)n |q + q^2 + ...|. Where differences do not fall, what is left cannot be told: errors
/// are unknown. Neither can it where the cells of n average over stiffnesses that differ as those of i do: what is in
/// them, such as layers thinner than a cell, shows in no difference; or where gaps end in the cells of n as they do in
/// those of i, which hold together what is beside a gap as far as they reach.
class ErrorEstimator {
public:
  /// @param measures_rates  false: not all cells are halved from level to level, which then show none; the usual rate,
  ///                        0.45, stands for it
  explicit ErrorEstimator(bool measures_rates = true) : measures_rates_(measures_rates) {}

  /// A level finer than those before.
  /// @param differences  from each of those before, coarse to fine; nothing: not compared any more. Empty: it does
  ///                     not go on from them
  /// @param finer        levels of the lattice beyond this
  void add(std::vector<std::optional<ElasticCells::Size>> differences, LevelMeasures measures, int finer);

  /// The level added last was only looked at.
  void forget_last() { known_.pop_back(); }

  /// Whether the last level known is the lattice's finest: then errors of the others are what they differ by.
  bool knows_finest() const { return !known_.empty() && known_.back().finer == 0; }

  /// Whether levels come closer to each other as those of cells do, as far as the last three known show.
  bool closes_in() const;

  /// What is known of the levels added; a last one that is not among `levels` was looked at only.
  void write(std::vector<LevelReport>& levels) const;

private:
  bool is_hidden(std::size_t i) const;  ///< what the known level averages over: it shows in no difference
  struct Known {
    std::vector<std::optional<ElasticCells::Size>> differences;
    LevelMeasures measures;
    int finer = 0;
  };
  /// What known levels i <= j differ by, or the sum of the way by those that were compared with later ones.
  double difference(std::size_t i, std::size_t j, double ElasticCells::Size::*size) const;

  /// Error of the known level `i` by distances between known levels, distance(i, j); nothing: unknown.
  /// @param negligible  distances below that are of solutions that are not exact, and tell no rate
  template <class Distance>
  std::optional<double> error(std::size_t i, const Distance& distance, double negligible) const;

  bool measures_rates_;
  std::vector<Known> known_;    ///< coarse to fine, the last ones of all levels added
  std::size_t num_before_ = 0;  ///< levels before these
};

/// What a level's errors are beside the accuracies that a scene asks for.
std::string accuracy_reached(const LevelReport& level, const Scene& scene);

}  // namespace hexsolver

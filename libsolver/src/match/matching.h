// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Geometry>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "hexmesh/lattice/lattice.h"
#include "hexsolver/report/report.h"
#include "hexsolver/scene/scene.h"

namespace hexsolver {

/// How points of a body are pulled to where they are to be.
struct Pull {
  double energy = 0;           ///< [N mm]
  std::vector<Vec3> gradient;  ///< of each point [N]
  std::vector<Mat3> hessian;   ///< of each point, positive semi-definite [N/mm]
  /// Of each point: the energy is nowhere above that of a spring of this stiffness with the same gradient here [N/mm].
  std::vector<double> bound;

  void reset(std::size_t num_points);
};

/// How all that matches pull to is pulled to in a round, and what contacts learn from the one before.
struct PullMode {
  double caution = 0;    ///< 0: with the second derivatives there; 1: with springs that bound the energy
  bool lets_go = false;  ///< of what stays far, beside the rest
  double learns = 1;     ///< see PenaltyContact::attach()
  double stiffer = 1;    ///< likewise
};

/// What one [[match]] of a scene asks of a body, wherever the body is. It knows points of the body and nothing of
/// cells.
class Matching {
public:
  virtual ~Matching() = default;
  virtual const std::vector<Vec3>& points() const = 0;  ///< of the body, at rest [mm]

  /// @param places  of the points
  /// @param pose    where the body began: what nothing is known of is held there, weakly
  /// @param lets_go  see PullMode
  virtual void pull(const std::vector<Vec3>& places, const Eigen::Isometry3d& pose, bool lets_go, Pull& out) const = 0;

  /// What a rigid motion is to bring together.
  struct Pair {
    double area;                ///< [mm^2]
    double part;                ///< of it that counts
    double loss;                ///< square of the distance, of what is far less [mm^2]
    const Vec3 &rest, &wanted;  ///< a point of the body at rest, and where it is to be
  };
  /// @param pose   of the body now
  /// @param every    so many samples are one
  /// @param lets_go  see PullMode
  virtual void pair(const Eigen::Isometry3d& pose, std::size_t every, bool lets_go,
                    const std::function<void(const Pair&)>& f) const = 0;

  /// Whether all of the body is to lie on all of a closed surface.
  virtual bool is_whole() const = 0;
  virtual bool is_of_landmarks() const = 0;
  virtual Vec3 middle() const = 0;  ///< of where the body is to be [mm]
  virtual Mat3 spread() const = 0;  ///< about that: the mean of x x^T [mm^2]

  /// How far the body is from where it is to be.
  virtual MatchReport distances(const std::vector<Vec3>& places) const = 0;
  /// Why a body at these distances is not where it is to be.
  virtual std::optional<std::string> why_missed(const MatchReport& distances) const = 0;
};

/// A body that stays off by more than so much of its size in the mean is not where it is to be.
constexpr double far_off = 0.01;

using Matchings = std::vector<std::shared_ptr<const Matching>>;

/// The size of a body: the diagonal of the lattice's box [mm].
double size_of(const hexmesh::Lattice& lattice);

/// Of each [[match]], in their order.
/// @param lattice  with its picture surface
/// @throws Error{input} for a segment that there is not
Matchings make_matchings(const Scene& scene, const hexmesh::Lattice& lattice);

}  // namespace hexsolver

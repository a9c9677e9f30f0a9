// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "hexmesh/lattice/segment_distance.h"
#include "hexsolver/scene/scene.h"
#include "mesh/mesh_cells.h"
#include "selection/selection.h"
#include "terms/body_map.h"
#include "terms/point_hessians.h"

namespace hexsolver {

/// A segment that another one's surface touches, or its own, in place of an obstacle.
struct OtherSegment {
  std::shared_ptr<const hexmesh::SegmentDistance> distance;  ///< never null
  BodyMap map;
  double young;                       ///< [MPa]
  std::vector<bool> touching;         ///< of the surface points, those that are on it at rest
  std::vector<double> outside;        ///< how far surface points are outside the smooth surface of their body [mm]
  double deepest_at_once;             ///< how deep a point may come in one step of Newton's method [mm]
  bool is_self;                       ///< the surface is its own
  std::vector<SurfacePoint> surface;  ///< of what moves with it; none where it is its own
};

/// A point of a surface that may touch.
struct TouchPoint {
  std::int32_t cell;
  NodeWeights weights;
  double gap;    ///< to what it may touch, < 0 inside [mm]
  double force;  ///< across the surface [N]
  /// At rest, of what the face is of a smooth surface across the force, 0 where it does not touch [mm^2]: a surface
  /// with normal n has |n_x| + |n_y| + |n_z| times its area in faces of voxels, of which n_x^2 + n_y^2 + n_z^2 is this.
  double area;
  /// It is there, or nearly: forces of single points tell little, where a surface made of voxels presses some of a cell
  /// bear it all.
  bool touches;
};

/// Of each cell [MPa], 0 where no point touches: the pressure of a node is the force that points hand to it by their
/// weights over the area that they do, that of a cell the mean over its points, so that the whole force is kept.
std::vector<double> pressure_of_cells(const Mesh& mesh, const std::vector<TouchPoint>& points);

/// Of each cell, the least of its points, `farthest` at most [mm].
std::vector<double> gap_of_cells(const Mesh& mesh, const std::vector<TouchPoint>& points, double farthest);

/// An obstacle that surface points enter against springs: W = sum_p k_p/2 min(gap_p, 0)^2, the gap that of the moved
/// point, spread to the nodes by H^T.
///
/// Where the scene names no stiffness k is found, and in an equilibrium the obstacle is hard: each point has a force
/// h_p that attach() learns, max(h - k gap, 0) of the last solution, and W = sum_p (max(h_p - k_p gap_p, 0)^2 - h_p^2)
/// / 2 k_p (augmented Lagrangian), so that the depth falls by k over the body's stiffness from round to round.
///
/// With friction each point has a second spring along the surface, of the same stiffness, from where it was at the
/// begin of the step: its force grows to mu N and then slips. N and the normal are those of the last attach(), so that
/// within a step it is an energy too, k/2 |t|^2 or mu N |t| - (mu N)^2 / 2k (THEORY.md, "Obstacles").
///
/// All of this is a function of where a point is in the obstacle's frame. In place of an obstacle stands the rest shape
/// of another segment, X in place of x, with x = X + u(X) there: what the function says of dX is dX = F^-1 (dx - H du),
/// so the segment's nodes bear the opposite of what the point does, at the same place. Where a point passes from one of
/// the segment's cells to the next F jumps, and the force with it: see gradient_jump(). Second derivatives take with
/// them how X moves as the cells bend, d2X = -F^-1 (2 grad(du) dX + grad grad u [dX, dX]); preconditioners do without
/// the first.
class PenaltyContact final : public Term {
public:
  /// @param mesh     must outlive this
  /// @param points   the whole surface
  /// @param is_hard  as above
  /// @param other    in place of the contact's obstacle
  PenaltyContact(const Contact& contact, const MeshCells& cells, const Mesh& mesh,
                 const std::vector<SurfacePoint>& points, bool is_hard = false,
                 std::unique_ptr<OtherSegment> other = nullptr);

  EffectKind effect() const override { return EffectKind::contact; }
  std::string name() const override { return contact_name(contact_); }
  void set_progress(const Progress& progress);  ///< where the obstacle is
  double energy(const NodeVector& u) const override;
  double longest_step(const NodeVector& u, const NodeVector& step) const override;
  double gradient_jump(const NodeVector& u) const override;
  double stored_energy(const NodeVector& u) const;  ///< of the springs, without what slips takes [N mm]
  void add_gradient(const NodeVector& u, NodeVector& gradient, NodeVector& magnitude) const override;
  bool is_linear() const override { return false; }
  void linearize(const NodeVector& u, double projection) override;
  void add_product(const NodeVector& x, NodeVector& y) const override { add_product_of(x, y); }
  void add_product(const FloatNodeVector& x, FloatNodeVector& y) const override { add_product_of(x, y); }
  void add_cell_hessian(std::size_t cell, CellMatrix& h) const override;
  std::int32_t shared_hessian(std::size_t cell) const override;
  const Couplings* couplings() const override { return other_ ? &couplings_ : nullptr; }
  std::size_t bytes() const override;

  bool has_friction() const noexcept { return contact_.friction > 0; }
  bool is_attached() const noexcept {  ///< attach() changes it
    return has_friction() || !held_off_.empty() || holds_pairs_;
  }
  /// From now on a point stays with the place in the other segment that the last attach() found, X = X0 + F^-1 (x - x0)
  /// with X0, x0 and F^-1 of that place: in a step of a motion forces then have no jump where F has one. Another term
  /// than of segments is as before.
  void hold_pairs();
  /// From u on, until the next attach() or set_progress(), a point's place is by the map of the cell where it is at u,
  /// which goes on beyond that, so that forces have no jump. @returns whether they have one there
  bool settle(const NodeVector& u);
  void unsettle();  ///< not any more
  /// The forces of hard points (but for the first time in a step), what friction may come to, mu N, and which places
  /// are held are those at u.
  /// @param learns   part of their change that the forces of hard points take, up to 1: where what presses is about to
  ///                 slide off to either side, less than the whole of it leads to rest
  /// @param stiffer  how many times stiffer than at first springs across the surface of hard points are from now on,
  ///                 until set_progress()
  /// @returns by how much friction may come to more or less in all, over what it is in all, or the force across the
  ///          surface where places are held
  double attach(const NodeVector& u, double learns = 1, double stiffer = 1);
  /// Whether points went through another part of the body on the straight way to u from the last attach(), of an
  /// equilibrium from the first after set_progress(). Through an obstacle: see went_through().
  bool passes_through(const NodeVector& u) const;
  /// From now on, at u, no spring of it is drawn and no place is held.
  void forget(const NodeVector& u);
  /// A step ends at u and the next one begins. @returns the work that slips took in it [N mm]
  double keep(const NodeVector& u);

  struct State {
    std::size_t points = 0;                                     ///< that touch
    std::size_t slipping = 0;                                   ///< of these, whose friction is all there is
    double deepest = 0;                                         ///< [mm]
    double nearest = std::numeric_limits<double>::quiet_NaN();  ///< least distance, < 0 inside; NaN: nowhere near [mm]
    Vec3 force = Vec3::Zero();  ///< on the body, or the first segment; none of a body on itself [N]
    bool is_inside = false;     ///< the obstacle's middle lies in the body: it went through the surface
  };
  /// Of all points that are near enough to tell, of two segments at both.
  std::vector<TouchPoint> touch_points(const NodeVector& u) const;

  /// What it does to the body on its way, with the forces at u where it is, at its begin or end [N mm].
  double work_of_motion(const NodeVector& u, const Progress& begin, const Progress& end) const;

  State state(const NodeVector& u) const;    ///< as the last set_progress() says
  void remember_force(const NodeVector& u);  ///< of a step that is kept, for went_through()
  /// Whether the obstacle went through the surface since the last step that was kept: its middle is inside, or it
  /// presses the other way.
  bool went_through(const NodeVector& u) const;
  State state_before(const NodeVector& u) const;  ///< before the obstacle has moved

  /// Points of the body at rest that the obstacle has in it on its way [mm]. @pre not of segments
  std::vector<Vec3> places_swept_at_rest() const;

  /// Whether an obstacle moves by more than a quarter of its thickness, and might go through the surface.
  bool goes_too_far(const Progress& from, const Progress& to) const;

  /// The largest part of the load in one step that does not carry an obstacle through the surface.
  /// @param displaced  how far conditions move parts of the body in all [mm]
  double largest_load_step(double displaced) const;

private:
  using Place = Eigen::Isometry3d;  ///< of the obstacle, from where the scene puts it

  /// Where a point is to the obstacle.
  struct At {
    Vec3 place = Vec3::Zero();     ///< in the obstacle's frame, or in the other segment at rest [mm]
    Mat3 to_frame = Mat3::Zero();  ///< its derivative by the place in space
    bool is_there = true;          ///< false: nowhere near the other segment
    std::int32_t cell = -1;        ///< of the other segment, whose nodes bear what the point does not
    NodeWeights weights = NodeWeights::Zero();
    Vec3 local = Vec3::Zero();  ///< in that cell
  };
  struct Point {
    std::int32_t cell;
    NodeWeights weights;
    Vec3 rest;
    Vec3 area;         ///< outward, at rest
    double stiffness;  ///< [N/mm]
    double begin = 0;  ///< its depth at rest in another segment that it touches or is inside, which counts as none [mm]
    double outside = 0;            ///< of its own smooth surface, where it touches none [mm]
    bool is_bonded = false;        ///< it never leaves that segment
    hexmesh::Embedding near = {};  ///< where in that segment it was last
  };
  /// Of a point along the obstacle's surface, in its frame.
  struct Friction {
    Vec3 begin = Vec3::Zero();   ///< where the point was when the step began [mm]
    Vec3 spring = Vec3::Zero();  ///< how far its spring was drawn then [mm]
    Vec3 normal = Vec3::Zero();
    double most = 0;       ///< mu N [N]
    bool slipped = false;  ///< in the last step
    bool began = true;     ///< false: it was nowhere near when the step began
  };
  /// Of a point that presses on another segment, what turns its force: -(G(v) . r(w) + G(w) . r(v)) with
  /// G(v) = sum_b (m . v_b) g_b over the segment's nodes and r the point's displacement less that of the segment there.
  struct Turning {
    std::int32_t cell, of_other;
    NodeWeights weights, other_weights;
    Vec3 m;           ///< the slope of the energy by the point's place [N]
    NodeGradients g;  ///< of the shape functions [1/mm]
  };
  /// The spring along the surface at u.
  struct Drawn {
    Vec3 by = Vec3::Zero();  ///< in the obstacle's frame [mm]
    double length = 0;       ///< of `by` [mm]
    double force = 0;        ///< [N]
    bool slips = false;
  };
  Vec3 now(const Point& p, const NodeVector& u) const { return p.rest + mesh_.interpolate(p.cell, p.weights, u); }
  /// Where a point is, and how far from there to the surface, in the frame.
  struct Located {
    At at;
    hexmesh::Gap gap;
  };
  Located locate(const Point& p, const NodeVector& u) const { return locate(p, u, place_); }
  Located locate(const Point& p, const NodeVector& u, const Place& place) const;
  /// Where all points are at a displacement.
  struct Places {
    std::vector<Located> all;
    NodeVector at;  ///< u

    bool is_of(const NodeVector& u) const { return at.size() == u.size() && at == u; }
    void forget() {
      all.clear();
      at.resize(0);
    }
  };
  /// Parts of a way in none of which anything moves against another by more than may be at once.
  double looks_along(const NodeVector& from, const NodeVector& to) const;
  /// f(part, where all points are then), at the ends of these parts, 256 of them at most; until f returns false.
  /// @returns the part looked at, less than 1 where the way is too long
  template <class F>
  double look_ahead(const NodeVector& from, const NodeVector& to, const F& f) const;
  Located located_at(const Point& p, const BodyMap::Place& there) const;
  Located locate_held(const Point& p, const Located& pair, const NodeVector& u) const;
  /// Of all points wherever they are at u, or at the places held; until the next state is asked for.
  const std::vector<Located>& find_all(const NodeVector& u) const;
  const std::vector<Located>& locate_all(const NodeVector& u) const;
  Vec3 force_at(std::size_t p, const Located& located) const;                         ///< on the body, in the frame [N]
  double stiffness(std::size_t p) const { return strength_ * points_[p].stiffness; }  ///< [N/mm]
  double stiffness_across(std::size_t p) const { return stiffer_ * stiffness(p); }    ///< the surface [N/mm]
  /// The force across the surface of a point so deep [N].
  double press(std::size_t p, double depth) const {
    if (depth == std::numeric_limits<double>::infinity()) return 0;
    const double pressing = (held_off_.empty() ? 0 : held_off_[p]) - stiffness_across(p) * depth;
    return points_[p].is_bonded ? pressing : std::max(pressing, 0.0);
  }
  double energy_of(std::size_t p, double pressing) const;  ///< across the surface [N mm]
  Drawn drawn(std::size_t p, const At& at) const;
  bool holds() const { return (holds_pairs_ && !seen_.all.empty()) || !settled_.empty(); }  ///< places
  bool goes_straight() const { return settled_.empty() && holds(); }                        ///< F^-1 is held
  const std::vector<Located>& pairs() const { return settled_.empty() ? seen_.all : settled_; }
  void hold_friction(std::size_t p, const Located& found, const Located* held);
  class Way;  ///< of a point through the other segment
  /// The part of a step before which no point that is nowhere near the segment comes into it.
  double part_before_touch(const NodeVector& u, const NodeVector& step, double most) const;
  static Vec3 force_of(const Drawn& drawn);  ///< on the body, in the frame [N]
  void remember_cells(const NodeVector& u);  ///< of the other segment
  template <class Vector>
  void add_turning_product(const Vector& x, Vector& y) const;
  bool is_boundless() const;  ///< without another side
  template <class Vector>
  void add_product_of(const Vector& x, Vector& y) const {
    active_.add_product(x, y);
    couplings_.add_product(mesh_, x, y);
    add_turning_product(x, y);
  }
  State state(const NodeVector& u, const Place& place, bool with_friction) const;
  Mat3 deformation(const Point& p, const NodeVector& u) const;  ///< of the surface there

  Contact contact_;
  const Mesh& mesh_;
  std::vector<Point> points_;          ///< ascending cells
  std::vector<double> held_off_;       ///< h of the points; empty where they are not hard [N]
  std::vector<double> kept_held_off_;  ///< of the last step that was kept
  Vec3 kept_force_ = Vec3::Zero();     ///< likewise, on the body [N]
  bool is_solved_ = false;           ///< whether a solution may be behind the next attach(): not at the begin of a step
  std::vector<Friction> frictions_;  ///< of the points; empty without friction
  std::vector<Friction> kept_frictions_;  ///< of the last step that was kept; empty where no places are held
  Place place_;
  double strength_ = 1;   ///< part of the stiffness that there is
  double stiffer_ = 1;    ///< see attach()
  PointHessians active_;  ///< of the last linearize(), of both sides; as the next two
  Couplings couplings_;
  std::vector<Turning> turnings_;
  std::unique_ptr<OtherSegment> other_;
  bool holds_pairs_ = false;
  Places seen_;                   ///< by attach(), see passes_through(); none before the first and of obstacles
  std::vector<Located> settled_;  ///< by settle()
  mutable Places held_, found_;   ///< the last asked for
};

}  // namespace hexsolver

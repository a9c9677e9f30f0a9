// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "constraints/constraints.h"
#include "distributed/part.h"
#include "distributed/part_constraints.h"
#include "distributed/part_hierarchy.h"
#include "distributed/petsc.h"
#include "distributed/shared_nodes.h"
#include "hexmesh/file/lattice_reader.h"
#include "hexsolver/report/report.h"
#include "hexsolver/scene/history.h"
#include "hexsolver/scene/scene.h"
#include "level/balance.h"
#include "terms/elastic.h"
#include "terms/load.h"
#include "terms/match_term.h"
#include "terms/potential.h"

namespace hexsolver::mpi {

/// The points held, which every process has: as many as the conditions' patches have, not as the body.
class SharedConstraints {
public:
  struct Point {
    std::int32_t condition = 0;
    Key cell;
    CornerNumbers corners{};  ///< of the cell
    std::array<double, 8> weights{};
    std::array<bool, 3> axes{};
    double area = 0;  ///< see ConstraintPoint, as the next two
    bool is_quarter = false;
    bool is_soft = false;
    int num_alike = 1;
  };

  /// @param edges, corner  of the whole level
  /// @param field          a vector of it
  SharedConstraints(const std::vector<Point>& points, const Scene& scene, const Mat3& edges, const Vec3& corner,
                    const SharedNodes& nodes, Vec field);

  const Constraints& local() const { return *constraints_; }
  const Mesh& mesh() const { return *mesh_; }  ///< of the cells that hold points
  const KeyedCells& keys() const noexcept { return keys_; }

  void prescribe(const Scene& scene, const Progress& progress);
  /// @param stiffness  of each of local().held() [N/mm]
  void set_springs(const std::vector<double>& stiffness);
  void project(Vec v) const;                            ///< v <- P v
  NodeVector values_of(Vec field) const;                ///< at the nodes of mesh()
  void put(const NodeVector& values, Vec field) const;  ///< into those that this process owns

private:
  KeyedCells keys_;
  std::unique_ptr<Mesh> mesh_;
  std::unique_ptr<Constraints> constraints_;
  NodeCopies copies_;
  NodeCopies owners_copies_;  ///< the same for processes that own some of these nodes; none for others
  std::vector<std::pair<Eigen::Index, PetscInt>> own_;  ///< nodes of mesh() and where this process keeps them
};

/// One level of a lattice under a scene, its cells divided among the processes: which cells are whose follows a
/// space-filling curve; selections, surface and files go by layers of the scan.
///
/// Called by all processes at once, as all its members but those that return references.
class SharedLevel {
public:
  /// @param outline  of the file, with the materials that count; all must outlive this
  /// @param matchings  of the scene
  /// @throws SharedError{geometry} for selections and missing supports
  SharedLevel(const Processes& all, const hexmesh::LatticeReader& file, const hexmesh::Lattice& outline,
              const Scene& scene, int level, Matchings matchings = {});
  ~SharedLevel() = default;
  SharedLevel(const SharedLevel&) = delete;
  SharedLevel& operator=(const SharedLevel&) = delete;

  int level() const noexcept { return level_; }
  const Processes& all() const noexcept { return all_; }
  const Scene& scene() const noexcept { return scene_; }
  const SharedNodes& nodes() const noexcept { return *nodes_; }
  const SharedConstraints& constraints() const noexcept { return *constraints_; }
  std::size_t num_cells() const noexcept { return num_cells_; }  ///< of all processes
  const Potential& potential() const noexcept { return *potential_; }
  bool is_linear() const { return potential_->is_linear(); }
  bool is_conservative() const { return potential_->is_conservative(); }

  OwnedVec make_vector() const { return zero_like(pattern_); }  ///< three values for each node

  void set_progress(const Progress& progress);
  bool attach_matches(Vec u, const PullMode& mode);  ///< see LevelProblem
  const std::vector<MatchTerm*>& matches() const noexcept { return matches_; }
  double energy(Vec u) const;         ///< [N mm]
  double strain_energy(Vec u) const;  ///< [N mm]
  double inner_forces(Vec u) const;   ///< norm of those that cells exert on nodes [N]
  /// dW/du; @returns the norm of the absolute values that it sums up [N]
  double gradient(Vec u, Vec gradient) const;
  double rounding() const noexcept { return rounding_; }                ///< ElasticCells::rounding
  double energy_rounding() const noexcept { return energy_rounding_; }  ///< likewise
  double rounding(Vec u) const;  ///< size of the rounding errors in a gradient at u [N]
  void project(Vec v) const { constraints_->project(v); }

  void linearize(Vec u, double clamping);
  void apply(Vec x, Vec y) const;           ///< y = P H P x
  void apply_unheld(Vec x, Vec y) const;    ///< y = H x
  Mat product() const { return product_; }  ///< P H P to PETSc

  const hexmesh::LatticeReader& file() const noexcept { return file_; }
  const hexmesh::Lattice& outline() const noexcept { return outline_; }
  const Piece& piece() const { return *piece_; }
  Elasticity elasticity() const noexcept { return elasticity_; }
  const std::vector<bool>& rotating() const noexcept { return rotating_; }  ///< of the part; empty = all

  const Mesh& mesh() const { return hierarchy_->meshes[0]; }  ///< of the part of this process
  const NodeCopies& copies() const { return copies_; }        ///< of the part's nodes
  const Hierarchy& hierarchy() const { return *hierarchy_; }  ///< below the part
  const HeldDirections& held_in_part() const { return *held_in_part_; }
  const KeyedCells& keys() const noexcept { return part_->keys; }                        ///< of the part
  std::int32_t own_cell(const Key& cell) const { return place_of(keys().cells, cell); }  ///< of the part; -1: another's
  NodeVector part_of(Vec field) const;                                                   ///< at the part's nodes
  void put_own(const NodeVector& values, Vec field) const;  ///< of the part, those that this process owns

  /// A field of a level with cells `merge` times as large, on this one.
  void prolongate(const SharedLevel& coarser, const Index3& merge, Vec from, Vec to) const;

  ElasticCells::Size size_in_material(Vec field) const;                  ///< see there
  double mean_deformation(Vec u) const;                                  ///< see EquilibriumLevel
  double share_of_turns(double angle, Vec u) const;                      ///< likewise
  std::vector<BalanceReport::Row> loads(Vec u, const Arms& arms) const;  ///< forces of the scene, then gravity, matches
  double size_of_loads() const;  ///< the largest resultant of these, without matches [N]
  Vec3 total(Vec forces) const;  ///< of forces on the nodes [N]
  std::size_t num_loads() const noexcept { return loads_.size(); }  ///< of these, without matches
  std::string limit_reached(Vec u, bool nearly) const;              ///< ElasticCells::limit_reached of some cell
  double diameter() const;                                          ///< of the box of the body [mm]

  /// Form the elements anew for another law, or for cells of which only some rotate.
  /// @param rotating  of the part; empty = all
  void build_potential(Elasticity elasticity, std::vector<bool> rotating);

  /// Of this process's cells, those whose parents on a coarser level are rotated by more than an angle [rad].
  std::vector<bool> cells_rotated_by(double angle, const SharedLevel& coarser, const Index3& merge, Vec u) const;

  /// Of the piece's cells, as condense(); those of its outermost layers may miss what holds them on the other side.
  std::vector<hexmesh::CondensedLevel> condense_piece() const;

  ProcessReport holding() const;  ///< what this process holds, without its memory

private:
  /// What a load exerts at rest on a mesh's nodes.
  OwnedVec forces_of(const Load& load, const Mesh& mesh, const NodeCopies& copies) const;
  std::vector<SharedConstraints::Point> select();                          ///< @returns all that hold the body
  std::vector<SharedConstraints::Point> find_matched(Selector& selector);  ///< @returns these, as if they were held
  void add_matches();
  void hold_in_part();
  void find_springs();
  /// Of each cell of the part, that of a coarser level in which it is.
  std::vector<Piece::Holder> parents(const SharedLevel& coarser, const Index3& merge) const;
  SharedConstraints::Point in_piece(const SurfacePoint& p) const;  ///< in a cell of the piece
  void make_hierarchy(SharedMerges merges);
  std::vector<Acting> acting_of_all(const std::vector<Acting>& own) const;
  std::vector<hexmesh::CondensedLevel> condense_part() const;
  double mean_of_all(double mean) const;  ///< from the mean over the material of each process

  const Processes& all_;
  const hexmesh::LatticeReader& file_;
  const hexmesh::Lattice& outline_;
  Scene scene_;
  int level_;
  std::size_t num_cells_ = 0;
  std::unique_ptr<Piece> piece_;
  std::optional<Part> part_;
  std::unique_ptr<Hierarchy> hierarchy_;
  std::unique_ptr<SharedNodes> nodes_;
  OwnedVec pattern_;
  NodeCopies copies_;  ///< of the part's nodes
  Elasticity elasticity_;
  std::vector<bool> rotating_;
  std::unique_ptr<Potential> potential_;
  ElasticCells* elastic_ = nullptr;  ///< in the potential
  double rounding_ = 0, energy_rounding_ = 0;
  std::vector<OwnedVec> loads_;  ///< in full [N]
  double load_factor_ = 1;

  Matchings matchings_;
  std::vector<ConstraintPoint> sprung_;        ///< points with springs, in cells of the part
  std::vector<std::size_t> number_of_sprung_;  ///< in constraints().local().held()
  MatchedPoints matched_;                      ///< in cells of the part
  std::vector<MatchTerm*> matches_;

  std::vector<Acting> acting_;  ///< of all processes, at indices of the piece; for condensed cells alone
  std::vector<SharedConstraints::Point> points_;
  std::unique_ptr<SharedConstraints> constraints_;
  std::unique_ptr<PartConstraints> held_in_part_;
  OwnedMat product_;
  mutable OwnedVec projected_;  ///< work space
  mutable NodeVector x_, y_;    ///< of the part, likewise
};

}  // namespace hexsolver::mpi

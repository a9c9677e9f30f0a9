// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "constraints/patch_springs.h"
#include "hexsolver/report/report.h"
#include "hexsolver/scene/scene.h"
#include "level/make_contacts.h"
#include "multigrid/multigrid.h"
#include "terms/dead_load.h"
#include "terms/elastic.h"
#include "terms/grabs.h"
#include "terms/ground_springs.h"
#include "terms/match_term.h"
#include "terms/potential.h"

namespace hexsolver {

/// Whether stiffnesses are too far apart for multigrid in single precision.
bool is_of_high_contrast(const hexmesh::Lattice& lattice);

/// See Hierarchy.
std::size_t coarsest_dofs(const hexmesh::Lattice& lattice, const Scene& scene);

/// Displacements where load steps begin: none, or where the scene puts the body.
NodeVector start_of(const Scene& scene, const Mesh& mesh);

/// What the levels of a solution find once for all of them.
struct SharedFindings {
  SegmentShapes shapes;
  std::optional<hexmesh::Condensation> condensed;
};

/// One level of a lattice under a scene. Its parts refer to each other: it stays where it was made.
class LevelProblem {
public:
  /// Finds what the conditions and forces select and what nothing holds.
  /// @throws Error{geometry} for selections and missing supports
  /// @param matchings  of the scene, where they are there already
  /// @param shared     of the lattice under the scene, which this adds to; null: its own
  LevelProblem(const hexmesh::Lattice& lattice, const Scene& scene, int level, Matchings matchings = {},
               std::shared_ptr<SharedFindings> shared = {});
  /// The same with cells of the scene's lattice that are named.
  LevelProblem(MeshCells cells, const Scene& scene, Matchings matchings = {},
               std::shared_ptr<SharedFindings> shared = {});
  LevelProblem(const LevelProblem&) = delete;
  LevelProblem& operator=(const LevelProblem&) = delete;

  /// Form the elements; before this there is no potential. Cells are at rest where set_rest() said.
  /// @param rotating  which cells rotate; empty = all
  void build_potential(Elasticity elasticity, std::vector<bool> rotating = {});

  /// The body is at rest where displaced by `to_rest` from the lattice, from which displacements stay measured. Before
  /// the potential is built: load steps then begin on the lattice, where what the cells exert is balanced by forces
  /// that the load takes the place of.
  /// @param to_rest  of the nodes [mm]
  /// @pre the scene is_reshaped(); no material is inside out there
  void set_rest(const NodeVector& to_rest);

  /// Add a term to the potential, which is built.
  template <class T>
  T& add_term(std::unique_ptr<T> term) {
    T& added = *term;
    potential_->add(std::move(term));
    return added;
  }

  int level() const noexcept { return cells_.level(); }
  const MeshCells& cells() const noexcept { return cells_; }
  const Scene& scene() const noexcept { return scene_; }
  const Mesh& mesh() const { return hierarchy_.meshes.front(); }
  const Hierarchy& hierarchy() const noexcept { return hierarchy_; }
  const Constraints& constraints() const noexcept { return *constraints_; }
  Potential& potential() { return *potential_; }
  const Potential& potential() const { return *potential_; }
  const ElasticCells& elastic() const { return *elastic_; }
  ElasticCells& elastic() { return *elastic_; }

  bool is_carried() const noexcept { return !carried_.empty(); }  ///< by nothing but obstacles, in part or all of it
  /// F0 of the cells, see ElasticCells::set_prestretch(); empty: none.
  const std::vector<Mat3>& prestretches() const noexcept { return prestretches_; }
  const std::vector<bool>& islands() const noexcept { return islands_; }  ///< held by springs, per cell; empty = none
  std::size_t num_island_cells() const;
  Vec3 spring_force(const NodeVector& u) const;      ///< of what holds the islands [N]
  double strain_energy(const NodeVector& u) const;   ///< [N mm]
  double contact_energy(const NodeVector& u) const;  ///< of obstacles, springs and hands [N mm]
  /// The same with what friction takes in the step, an energy while it lasts [N mm].
  double contact_potential(const NodeVector& u) const;
  /// What obstacles, hands and soft supports do to the body on their way, with the forces at u where they are at its
  /// begin or end [N mm].
  double work_of_obstacles(const NodeVector& u, const Progress& begin, const Progress& end) const;
  /// Take hold of a picture surface around one of its points.
  /// @param hand   the number of that point
  /// @param reach  of the points that are held with it [mm]
  /// @returns false where no cell moves the point
  bool grasp(std::size_t hand, const hexmesh::TriangleSurface& surface, double reach, const NodeVector& u);
  Grabs* grabs() noexcept { return grabs_; }  ///< null before the first grasp
  const Grabs* grabs() const noexcept { return grabs_; }

  double load_energy(const NodeVector& u) const;  ///< of forces and gravity [N mm]
  double largest_load_step() const;               ///< from rest, as its contacts allow

  /// Prescribe displacements, forces and places of obstacles as they are then; before that they are all there in full.
  void set_progress(const Progress& progress);
  const Progress& progress() const noexcept { return progress_; }

  struct LoadTotal {
    std::string name;
    Vec3 total;  ///< [N]
  };
  /// Each [[force]] of the scene, then gravity if there is any; as they act now.
  std::vector<LoadTotal> loads(const NodeVector& u) const;
  NodeVector load(const NodeVector& u) const;  ///< of all of these on the nodes [N]; empty without any
  const std::vector<PenaltyContact*>& contacts() const noexcept { return contacts_; }
  std::vector<TouchPoint> touch_points(const NodeVector& u) const;  ///< of all contacts
  const std::vector<MatchTerm*>& matches() const noexcept { return matches_; }

  /// Find what each [[match]] pulls to from a state, see MatchTerm, what obstacles exert there, and let what
  /// nothing but obstacles holds go on from there. @returns whether there is any of these
  bool attach(const NodeVector& u, const PullMode& mode);

  bool has_attached_contacts() const;  ///< that attach_contacts() changes
  /// See PenaltyContact::attach(): the most that a contact changes.
  double attach_contacts(const NodeVector& u, double learns = 1, double stiffer = 1);
  /// See PenaltyContact::settle(), and springs of what is carried fade. @returns whether any of these is there
  bool settle_contacts(const NodeVector& u);
  void unsettle_contacts();
  /// See PenaltyContact: a part of the body another, on the way from the last attach_contacts() to u.
  bool passes_through_itself(const NodeVector& u) const;
  void forget_frictions(const NodeVector& u);  ///< see PenaltyContact
  /// See PenaltyContact::keep(): of all obstacles [N mm].
  double keep_contacts(const NodeVector& u);

  /// Where load steps begin: at rest, or where the scene puts the body.
  NodeVector start() const { return start_of(scene_, mesh()); }

private:
  void set_loads(const Progress& progress);
  double energy_of_springs(const NodeVector& u) const;  ///< of islands, supports and hands [N mm]
  void balance_lattice();
  void grow_prestress();  ///< with the load, where it is not the lattice that is balanced
  std::vector<std::pair<std::int32_t, double>> carrying_springs() const;
  void find_islands(const std::vector<ConstraintPoint>& points);

  MeshCells cells_;
  Scene scene_;
  Progress progress_;  ///< of what is prescribed and loaded now
  Hierarchy hierarchy_;
  std::vector<bool> islands_;
  std::vector<Acting> acting_;  ///< for condensed cells alone
  std::shared_ptr<SharedFindings> shared_;
  std::vector<std::int32_t> carried_;  ///< cells that nothing but obstacles holds, ascending
  std::unique_ptr<Constraints> constraints_;
  std::vector<Vec3> prescribed_;                               ///< space for the points of the constraints [mm]
  std::vector<std::unique_ptr<Load>> new_loads_;               ///< until the potential takes them
  std::vector<std::unique_ptr<PenaltyContact>> new_contacts_;  ///< likewise
  std::vector<std::unique_ptr<MatchTerm>> new_matches_;        ///< likewise
  std::vector<Load*> loads_;
  std::vector<PenaltyContact*> contacts_;
  std::vector<MatchTerm*> matches_;
  NodeVector to_rest_;              ///< empty: at rest on the lattice
  std::vector<Mat3> prestretches_;  ///< of the cells; empty: free of stress at rest
  Load* of_lattice_ = nullptr;      ///< what balances the cells there, likewise
  std::unique_ptr<Potential> potential_;
  ElasticCells* elastic_ = nullptr;              ///< in the potential
  const GroundSprings* springs_ = nullptr;       ///< likewise, if it has any
  const PatchSprings* patch_springs_ = nullptr;  ///< likewise
  GroundSprings* carrying_ = nullptr;            ///< likewise
  Grabs* grabs_ = nullptr;                       ///< likewise
};

}  // namespace hexsolver

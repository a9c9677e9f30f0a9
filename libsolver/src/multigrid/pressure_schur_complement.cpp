// SPDX-License-Identifier: Apache-2.0
#include "multigrid/pressure_schur_complement.h"

#include <algorithm>
#include <map>
#include <optional>
#include <unordered_map>

#include "core/parallel.h"

namespace hexsolver {

using Eigen::Index;
using hexmesh::bytes_of;

namespace {

/// Number of a cell around another one, from their indices: that of PressureSchurComplement::around_.
std::size_t offset_of(const Index3& from, const Index3& to) {
  std::size_t o = 0;
  for (std::size_t d = 3; d-- > 0;) o = 3 * o + static_cast<std::size_t>(to[d] - from[d] + 1);
  return o;
}

/// Nodes a of a cell and b of one around it which are at one index.
struct Pair {
  int a, b;
};

std::array<std::vector<Pair>, 27> pairs_by_offset() {
  std::array<std::vector<Pair>, 27> out;
  for (int a = 0; a < 8; ++a)
    for (int b = 0; b < 8; ++b)
      out[offset_of(hexmesh::corner_of({0, 0, 0}, b), hexmesh::corner_of({0, 0, 0}, a))].push_back({a, b});
  return out;
}

/// An entry of S.
template <class Real>
Real couple(const Mesh& mesh, const CellRows<Real>& b, std::size_t cell, const Eigen::Matrix<Real, 3, 8>& moved,
            std::size_t other) {
  static const auto pairs = pairs_by_offset();
  const auto of_other = b.get(other);
  const CellNodes &nodes = mesh.cell_nodes()[cell], &other_nodes = mesh.cell_nodes()[other];
  Real sum = 0;
  for (const auto [a, c] : pairs[offset_of(mesh.cells()[cell], mesh.cells()[other])])
    if (nodes[a] == other_nodes[c]) sum += moved.col(a).dot(of_other.col(c));
  return sum;
}

/// D^-1 b of a cell, shape (3, 8), 0 at nodes that are left out.
template <class Real>
Eigen::Matrix<Real, 3, 8> moved_by(const Mesh& mesh, const CellRows<Real>& b, std::size_t cell,
                                   const std::vector<Eigen::Matrix<Real, 3, 3>>& inverse,
                                   const std::vector<bool>& left_out) {
  const auto of_cell = b.get(cell);
  Eigen::Matrix<Real, 3, 8> moved;
  for (int a = 0; a < 8; ++a) {
    const auto node = mesh.node(cell, a);
    if (left_out[node])
      moved.col(a).setZero();
    else
      moved.col(a) = inverse[node] * of_cell.col(a);
  }
  return moved;
}

}  // namespace

/// The cells that have each node.
template <class Real>
class PressureSchurComplement<Real>::CellsOfNodes {
public:
  explicit CellsOfNodes(const Mesh& mesh) : mesh_(mesh), begin_(mesh.num_nodes() + 1) {
    for (std::size_t c = 0; c < mesh.num_cells(); ++c)
      for_each_node(c, [&](std::int32_t n) { ++begin_[static_cast<std::size_t>(n) + 1]; });
    for (std::size_t n = 1; n < begin_.size(); ++n) begin_[n] += begin_[n - 1];
    cells_.resize(static_cast<std::size_t>(begin_.back()));
    std::vector<std::int32_t> next(begin_.begin(), begin_.end() - 1);
    for (std::size_t c = 0; c < mesh.num_cells(); ++c)
      for_each_node(c, [&](std::int32_t n) { cells_[next[n]++] = static_cast<std::int32_t>(c); });
  }

  /// The cells that share a node with one; several may stand at one index.
  void find_around(std::size_t cell, std::vector<std::int32_t>& out) const {
    out.clear();
    for_each_node(cell, [&](std::int32_t node) {
      const auto n = static_cast<std::size_t>(node);
      out.insert(out.end(), cells_.begin() + begin_[n], cells_.begin() + begin_[n + 1]);
    });
    std::sort(out.begin(), out.end());
    out.erase(std::unique(out.begin(), out.end()), out.end());
  }

private:
  template <class F>
  void for_each_node(std::size_t cell, F&& f) const {
    for (std::size_t a = 0; a < 8; ++a) mesh_.for_each_free(cell, a, [&](std::int32_t n, double) { f(n); });
  }

  const Mesh& mesh_;
  std::vector<std::int32_t> begin_, cells_;
};

template <class Real>
PressureSchurComplement<Real>::PressureSchurComplement(const Mesh& mesh) : mesh_(mesh) {
  lay_out();
  is_plain_ = find_plain_cells();
  cut_into_segments();
  std::optional<CellsOfNodes> cells_of;
  std::vector<std::int32_t> around;
  for (std::size_t c = 0; c < mesh.num_cells(); ++c) {
    if (is_plain_[c]) continue;
    if (!cells_of) cells_of.emplace(mesh);
    cells_of->find_around(c, around);
    other_cells_.push_back({static_cast<std::int32_t>(c), other_columns_.size()});
    other_columns_.insert(other_columns_.end(), around.begin(), around.end());
  }
  other_cells_.push_back({none, other_columns_.size()});
  other_values_.resize(other_columns_.size());
}

template <class Real>
void PressureSchurComplement<Real>::lay_out() {
  const std::vector<Index3>& cells = mesh_.cells();
  if (cells.empty()) return;
  Index3 first = cells[0], last = first;
  for (const Index3& c : cells)
    for (std::size_t d = 0; d < 3; ++d) first[d] = std::min(first[d], c[d]), last[d] = std::max(last[d], c[d]);
  std::array<std::size_t, 4> stride{1};
  for (std::size_t d = 0; d < 3; ++d) {
    // Nothing around the outermost, and what a segment that begins in a row has of it ends before the next row.
    const std::size_t rim = d == 0 ? lanes : 2;
    stride[d + 1] = stride[d] * (static_cast<std::size_t>(last[d] - first[d]) + 1 + rim);
  }
  constexpr std::size_t most_of_box = 32;  // places for a cell
  has_box_ = !mesh_.is_graded() && stride[3] <= most_of_box * cells.size();
  if (has_box_) cell_at_.assign(stride[3], none);
  for (std::size_t c = 0; c < cells.size(); ++c) {
    std::size_t at = 0;
    for (std::size_t d = 0; d < 3; ++d) at += stride[d] * static_cast<std::size_t>(cells[c][d] - first[d] + 1);
    if (!has_box_ || cell_at_[at] != none) {  // behind the box
      at = cell_at_.size();
      cell_at_.push_back(none);
    }
    cell_at_[at] = static_cast<std::int32_t>(c);
    place_.push_back(static_cast<std::int32_t>(at));
  }
  // What segments may reach behind the last cell.
  const std::size_t reach = lanes + stride[0] + (has_box_ ? stride[1] + stride[2] : 0);
  cell_at_.insert(cell_at_.end(), reach, none);
  if (!has_box_) return;
  for (std::size_t o = 0; o < num_around; ++o) {
    const std::array<std::size_t, 3> steps{o % 3, o / 3 % 3, o / 9};
    for (std::size_t d = 0; d < 3; ++d)
      around_[o] += (static_cast<std::ptrdiff_t>(steps[d]) - 1) * static_cast<std::ptrdiff_t>(stride[d]);
    if (steps[0] == 0) row_around_[o / 3] = around_[o];
  }
}

/// Those around which no other cell or node stands where they, their nodes and the cells around them are.
template <class Real>
std::vector<bool> PressureSchurComplement<Real>::find_plain_cells() const {
  const std::vector<Index3>&cells = mesh_.cells(), &nodes = mesh_.nodes();
  std::vector<bool> is_plain(cells.size(), has_box_);
  if (!has_box_ || std::adjacent_find(nodes.begin(), nodes.end()) == nodes.end()) return is_plain;
  std::vector<bool> cell_is_double(cells.size()), node_is_double(nodes.size());
  for (std::size_t c = 1; c < cells.size(); ++c)
    if (cells[c] == cells[c - 1]) cell_is_double[c] = cell_is_double[c - 1] = true;
  for (std::size_t n = 1; n < nodes.size(); ++n)
    if (nodes[n] == nodes[n - 1]) node_is_double[n] = node_is_double[n - 1] = true;
  for (std::size_t c = 0; c < cells.size(); ++c) {
    is_plain[c] = !cell_is_double[c];
    for (std::size_t o = 0; o < num_around && is_plain[c]; ++o) {
      const std::int32_t other = cell_around(place(c), o);
      is_plain[c] = other == none || !cell_is_double[other];
    }
    for (const std::int32_t n : mesh_.cell_nodes()[c]) is_plain[c] = is_plain[c] && !node_is_double[n];
  }
  return is_plain;
}

/// So that each cell is in one, from its place on; they have places without cells too.
template <class Real>
void PressureSchurComplement<Real>::cut_into_segments() {
  std::vector<std::int32_t> places = place_;
  std::sort(places.begin(), places.end());
  std::int32_t end = 0;
  for (const std::int32_t at : places) {
    if (at < end) continue;
    segments_.push_back({at});
    end = at + static_cast<std::int32_t>(lanes);
  }
}

/// The number that the cells of a segment and all around them have in B; none where they differ, some are missing, or
/// nodes are left out.
template <class Real>
std::int32_t PressureSchurComplement<Real>::number_of_all_around(std::size_t place, const CellRows<Real>& b,
                                                                 const std::vector<bool>& left_out) const {
  const std::int32_t cell = cell_at_[place];
  const std::int32_t number = b.batches().shared_place(mesh_.batch_of(cell));
  if (!has_box_ || number < 0) return none;
  for (std::size_t at = place; at < place + lanes; ++at) {
    for (std::size_t o = 0; o < num_around; ++o) {
      const std::int32_t other = cell_around(at, o);
      if (other == none || b.batches().shared_place(mesh_.batch_of(other)) != number) return none;
    }
    const auto c = static_cast<std::size_t>(cell_at_[at]);
    if (!is_plain_[c]) return none;
    for (const std::int32_t node : mesh_.cell_nodes()[c])
      if (left_out[node]) return none;
  }
  return number;
}

template <class Real>
void PressureSchurComplement<Real>::set(const CellRows<Real>& b, const std::vector<Block>& inverse,
                                        const std::vector<bool>& left_out) {
  std::unordered_map<std::int32_t, std::size_t> known;
  computed_.clear();
  std::size_t size = 0;
  for (std::size_t n = 0; n < segments_.size(); ++n) {
    PlaceSegment& s = segments_[n];
    const std::int32_t number = number_of_all_around(s.place, b, left_out);
    s.alike = number != none;
    s.values = size;
    if (s.alike) {
      const auto [entry, is_new] = known.try_emplace(number, size);
      s.values = entry->second;
      if (!is_new) continue;
    }
    computed_.push_back(n);
    size += num_around * (s.alike ? 1 : lanes);
  }
  values_.assign(size, 0);
  const bool in_parallel = mesh_.num_cells() >= Mesh::worth_threads;
#pragma omp parallel for schedule(dynamic, 64) if (in_parallel)
  for (std::size_t n = 0; n < computed_.size(); ++n) {
    const PlaceSegment& s = segments_[computed_[n]];
    for (std::size_t lane = 0; lane < (s.alike ? 1 : lanes); ++lane) {
      const std::size_t at = static_cast<std::size_t>(s.place) + lane;
      const auto cell = static_cast<std::size_t>(cell_at_[at]);
      if (cell_at_[at] == none || !is_plain_[cell]) continue;
      const Eigen::Matrix<Real, 3, 8> moved = moved_by(mesh_, b, cell, inverse, left_out);
      for (std::size_t o = 0; o < num_around; ++o)
        if (const std::int32_t other = cell_around(at, o); other != none)
          values_[s.values + (s.alike ? o : lanes * o + lane)] =
              couple(mesh_, b, cell, moved, static_cast<std::size_t>(other));
    }
  }
  if (mesh_.num_hanging() > 0) {
    set_graded(b, inverse, left_out);
    return;
  }
#pragma omp parallel for schedule(dynamic, 64) if (in_parallel)
  for (std::size_t n = 0; n < other_cells_.size() - 1; ++n) {
    const auto cell = static_cast<std::size_t>(other_cells_[n].cell);
    const Eigen::Matrix<Real, 3, 8> moved = moved_by(mesh_, b, cell, inverse, left_out);
    for (std::size_t i = other_cells_[n].begin; i < other_cells_[n + 1].begin; ++i)
      other_values_[i] = couple(mesh_, b, cell, moved, static_cast<std::size_t>(other_columns_[i]));
  }
}

/// Rows of B at the free nodes, those of hanging corners with those these hang on.
template <class Real>
void PressureSchurComplement<Real>::set_graded(const CellRows<Real>& b, const std::vector<Block>& inverse,
                                               const std::vector<bool>& left_out) {
  using Point = Eigen::Matrix<Real, 3, 1>;
  using Row = std::vector<std::pair<std::int32_t, Point>>;  // sorted by node
  std::vector<Row> rows(mesh_.num_cells());
  for (std::size_t c = 0; c < rows.size(); ++c) {
    const auto of_cell = b.get(c);
    std::map<std::int32_t, Point> at;
    for (std::size_t a = 0; a < 8; ++a)
      mesh_.for_each_free(c, a, [&](std::int32_t n, double weight) {
        if (left_out[static_cast<std::size_t>(n)]) return;
        at.try_emplace(n, Point::Zero()).first->second +=
            static_cast<Real>(weight) * of_cell.col(static_cast<Eigen::Index>(a));
      });
    rows[c].assign(at.begin(), at.end());
  }
#pragma omp parallel for schedule(dynamic, 64)
  for (std::size_t n = 0; n < other_cells_.size() - 1; ++n) {
    Row moved = rows[static_cast<std::size_t>(other_cells_[n].cell)];
    for (auto& [node, v] : moved) v = Point(inverse[static_cast<std::size_t>(node)] * v);
    for (std::size_t i = other_cells_[n].begin; i < other_cells_[n + 1].begin; ++i) {
      const Row& other = rows[static_cast<std::size_t>(other_columns_[i])];
      Real sum = 0;
      for (auto x = moved.cbegin(), y = other.cbegin(); x != moved.cend() && y != other.cend();) {
        if (x->first == y->first)
          sum += (x++)->second.dot((y++)->second);
        else if (x->first < y->first)
          ++x;
        else
          ++y;
      }
      other_values_[i] = sum;
    }
  }
}

template <class Real>
void PressureSchurComplement<Real>::step(const PressureStep<Real>& step, const Vector& gained, const Vector& p,
                                         Vector& next) const {
  constexpr std::size_t at_once = 64;
  const std::size_t parts = (segments_.size() + at_once - 1) / at_once;
  const bool in_parallel = mesh_.num_cells() >= cells_worth_threads;
#pragma omp parallel for schedule(static) if (in_parallel)
  for (std::size_t part = 0; part < parts; ++part) {
    const std::size_t first = part * at_once;
    step_pressures(std::span(segments_).subspan(first, std::min(at_once, segments_.size() - first)), row_around_.data(),
                   values_.data(), step, gained.data(), p.data(), next.data());
  }
  // Of other cells that was the same without S.
  const bool are_many = static_cast<Index>(other_columns_.size()) >= worth_threads;
#pragma omp parallel for schedule(static) if (are_many)
  for (std::size_t n = 0; n < other_cells_.size() - 1; ++n) {
    Real sum = 0;
    for (std::size_t i = other_cells_[n].begin; i < other_cells_[n + 1].begin; ++i)
      sum += other_values_[i] * p[place(other_columns_[i])];
    next[place(other_cells_[n].cell)] -= step.add * sum;
  }
}

template <class Real>
std::size_t PressureSchurComplement<Real>::bytes() const {
  return bytes_of(place_) + bytes_of(cell_at_) + is_plain_.capacity() / 8 + bytes_of(segments_) + bytes_of(computed_) +
         bytes_of(values_) + bytes_of(other_cells_) + bytes_of(other_columns_) + bytes_of(other_values_);
}

template class PressureSchurComplement<float>;
template class PressureSchurComplement<double>;

}  // namespace hexsolver

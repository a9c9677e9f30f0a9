// SPDX-License-Identifier: Apache-2.0
#include "cell_checks.h"

#include <fmt/format.h>

#include <algorithm>

#include "../volume/label_runs.h"
#include "bounds.h"

namespace hexmesh::hdf5 {
namespace {

/// Which cells of one layer hold material, and whether those of a file are these.
class OccupiedLayer {
public:
  OccupiedLayer(const Reader& file, const Grid& voxels, const StoredCells& of)
      : file_(file), of_(of), extent_(coarser_extent(voxels.extent(), of.voxels_per_cell)) {
    holds_.assign(as_size(extent_[0]) * as_size(extent_[1]), 0);
  }

  /// Voxels from `begin` to `end` - 1 of row j have material.
  void mark(std::int32_t j, std::size_t begin, std::size_t end) {
    const std::size_t size = as_size(of_.voxels_per_cell[0]);
    const auto row = holds_.begin() + j / of_.voxels_per_cell[1] * extent_[0];
    std::fill(row + static_cast<std::ptrdiff_t>(begin / size), row + static_cast<std::ptrdiff_t>((end - 1) / size) + 1,
              1);
  }

  /// All voxels of the layer have been marked: compare, and go on to the next.
  void finish(std::int32_t k) {
    for (; next_ < of_.cells.size() && of_.cells[next_][2] == k; ++next_) {
      const Index3& c = of_.cells[next_];
      if (next_ > 0 && of_.cells[next_ - 1] == c) continue;  // of several there
      char& holds = holds_[as_size(c[0]) + as_size(extent_[0]) * as_size(c[1])];
      if (!holds) file_.fail(fmt::format("has a cell {} in '{}' where no voxel has material", text_of(c), of_.name));
      holds = 0;
    }
    const auto left = of_.are_all ? std::find(holds_.begin(), holds_.end(), 1) : holds_.end();
    if (left != holds_.end()) {
      const auto n = static_cast<std::int32_t>(left - holds_.begin());
      file_.fail(fmt::format("has no cell {} in '{}', where voxels have material",
                             text_of({n % extent_[0], n / extent_[0], k}), of_.name));
    }
    if (!of_.are_all) std::fill(holds_.begin(), holds_.end(), 0);
  }

private:
  const Reader& file_;
  const StoredCells& of_;
  Index3 extent_;
  std::vector<char> holds_;
  std::size_t next_ = 0;
};

}  // namespace

std::string text_of(const Index3& i) { return fmt::format("({}, {}, {})", i[0], i[1], i[2]); }

std::vector<LabelKind> kinds_of_labels(const std::vector<LatticeSegment>& segments) {
  std::vector<LabelKind> kinds(65536, LabelKind::unknown);
  for (const LatticeSegment& s : segments)
    kinds[s.segment.label] = s.material ? LabelKind::with_material : LabelKind::without_material;
  return kinds;
}

std::size_t count_material(const std::vector<LatticeSegment>& segments) {
  std::size_t count = 0;
  for (const LatticeSegment& s : segments)
    if (s.material) count += s.num_voxels;
  return count;
}

void check_order(const Reader& file, const std::string& name, std::span<const Index3> cells, bool may_share) {
  bool is_good = true;
  const std::uint64_t least = may_share ? 0 : 1;  // from one to the next
  for (std::size_t n = 1; n < cells.size(); ++n) is_good &= sort_key(cells[n - 1]) + least <= sort_key(cells[n]);
  if (is_good) return;
  for (std::size_t n = 1; n < cells.size(); ++n)
    if (sort_key(cells[n - 1]) + least > sort_key(cells[n]))
      file.fail(fmt::format("has cells of '{}' twice or out of order: {} after {}", name, text_of(cells[n]),
                            text_of(cells[n - 1])));
}

void check_box(const Reader& file, const Grid& voxels, const std::vector<LatticeSegment>& segments,
               const StoredCells& cells) {
  if (!std::all_of(segments.begin(), segments.end(), [](const auto& s) { return s.material.has_value(); })) return;
  const Index3 extent = coarser_extent(voxels.extent(), cells.voxels_per_cell);
  Index3 reached = {0, 0, 0};
  for (const Index3& c : cells.cells)
    for (std::size_t d = 0; d < 3; ++d) reached[d] = std::max(reached[d], c[d] + 1);
  if (reached == extent) return;
  const Index3& n = voxels.extent();
  file.fail(fmt::format("has '/voxels/labels' of {} x {} x {} voxels, {} cells, but cells of '{}' up to {} only", n[0],
                        n[1], n[2], text_of(extent), cells.name, text_of(reached)));
}

std::vector<std::size_t> check_labels(const Reader& file, const Grid& voxels, std::span<const std::uint16_t> labels,
                                      const std::vector<LatticeSegment>& segments, const StoredCells& cells) {
  const std::vector<LabelKind> kinds = kinds_of_labels(segments);
  std::vector<std::size_t> count(65536);
  OccupiedLayer layer(file, voxels, cells);
  const Index3& extent = voxels.extent();
  const std::size_t width = as_size(extent[0]);
  for (std::int32_t k = 0; k < extent[2]; ++k) {
    for (std::int32_t j = 0; j < extent[1]; ++j)
      for_each_run(labels.subspan(voxels.offset({0, j, k}), width), [&](std::uint16_t label, std::size_t begin,
                                                                        std::size_t end) {
        count[label] += end - begin;
        if (kinds[label] == LabelKind::with_material) layer.mark(j, begin, end);
        if (label != 0 && kinds[label] == LabelKind::unknown)
          file.fail(fmt::format("has label {} in '/voxels/labels' at voxel {}, expected 0 or that of a segment", label,
                                text_of({static_cast<std::int32_t>(begin), j, k})));
      });
    const std::int32_t size = cells.voxels_per_cell[2];
    if (!cells.cells.empty() && ((k + 1) % size == 0 || k + 1 == extent[2])) layer.finish(k / size);
  }
  return count;
}

void check_counts(const Reader& file, const std::vector<std::size_t>& count,
                  const std::vector<LatticeSegment>& segments) {
  for (const LatticeSegment& s : segments)
    if (s.material && count[s.segment.label] != s.num_voxels)
      file.fail(
          fmt::format("has {} voxels of segment '{}' in '/voxels/labels', expected {} as in '/segments/num_voxels'",
                      count[s.segment.label], s.segment.name, s.num_voxels));
}

void check_segments(const Reader& file, const std::string& name, std::span<const std::uint16_t> segment,
                    const std::vector<LatticeSegment>& segments, LabelKind least) {
  const std::vector<LabelKind> kinds = kinds_of_labels(segments);
  bool is_good = true;
  for (const std::uint16_t label : segment) is_good &= kinds[label] >= least;
  if (is_good) return;
  for (std::size_t n = 0; n < segment.size(); ++n)
    if (kinds[segment[n]] < least)
      file.fail(fmt::format("has label {} in row {} of '{}', expected that of a segment{}", segment[n], n, name,
                            least == LabelKind::with_material ? " with material" : ""));
}

void check_places(const Reader& file, const std::string& name, const std::vector<Vec3>& points, const Grid& voxels) {
  const Index3& n = voxels.extent();
  const double across = voxels.spacing().cwiseProduct(Vec3(n[0], n[1], n[2])).norm();
  const Vec3 middle = voxels.position(0.5 * Vec3(n[0] - 1, n[1] - 1, n[2] - 1));
  const double reach = 1.5 * across + 10;
  bool is_good = true;
  for (const Vec3& p : points) is_good &= (p - middle).squaredNorm() <= reach * reach;  // NaN is not
  if (is_good) return;
  for (std::size_t p = 0; p < points.size(); ++p)
    if (!((points[p] - middle).squaredNorm() <= reach * reach))
      file.fail(fmt::format(
          "has the point ({:g}, {:g}, {:g}) in row {} of '{}', expected within {:g} mm of ({:g}, {:g}, {:g})",
          points[p][0], points[p][1], points[p][2], p, name, reach, middle[0], middle[1], middle[2]));
}

}  // namespace hexmesh::hdf5

// SPDX-License-Identifier: Apache-2.0
#include "hexmesh/tetra/mesh_body.h"

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Labeled_mesh_domain_3.h>
#include <CGAL/Mesh_complex_3_in_triangulation_3.h>
#include <CGAL/Mesh_criteria_3.h>
#include <CGAL/Mesh_triangulation_3.h>
#include <CGAL/make_mesh_3.h>
#include <fmt/format.h>
#include <vtkImageData.h>
#include <vtkImageGaussianSmooth.h>
#include <vtkNew.h>
#include <vtkSmartPointer.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <map>
#include <span>

#include "hexmesh/core/error.h"

namespace hexmesh {
namespace {

namespace parameters = CGAL::parameters;
using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Domain = CGAL::Labeled_mesh_domain_3<Kernel>;
using Triangulation = CGAL::Mesh_triangulation_3<Domain>::type;
using Complex = CGAL::Mesh_complex_3_in_triangulation_3<Triangulation>;
using Criteria = CGAL::Mesh_criteria_3<Triangulation>;

Vec3 to_vec(const Kernel::Point_3& p) { return {p.x(), p.y(), p.z()}; }

/// 1 in the voxels of a segment and 0 elsewhere, smoothed by a Gaussian of one voxel; with a margin around the box.
class SmoothMask {
public:
  static constexpr int margin = 4;  // voxels

  SmoothMask(const Lattice& lattice, std::uint16_t label) {
    const Index3& n = lattice.voxels.extent();
    vtkNew<vtkImageData> mask;
    mask->SetDimensions(n[0] + 2 * margin, n[1] + 2 * margin, n[2] + 2 * margin);
    mask->AllocateScalars(VTK_FLOAT, 1);
    std::fill_n(static_cast<float*>(mask->GetScalarPointer()), mask->GetNumberOfPoints(), 0.0F);
    for (std::size_t v = 0; v < lattice.labels.size(); ++v) {
      if (lattice.labels[v] != label) continue;
      const Index3 ijk = lattice.voxels.index(v);
      *static_cast<float*>(mask->GetScalarPointer(ijk[0] + margin, ijk[1] + margin, ijk[2] + margin)) = 1;
    }
    vtkNew<vtkImageGaussianSmooth> smooth;
    smooth->SetInputData(mask);
    smooth->SetStandardDeviation(1);
    smooth->SetRadiusFactor(3);
    smooth->SetNumberOfThreads(1);
    smooth->Update();
    image_ = smooth->GetOutput();
    values_ = static_cast<const float*>(image_->GetScalarPointer());
    for (int d = 0; d < 3; ++d) extent_[d] = image_->GetDimensions()[d];
  }

  std::span<const float> values() const { return {values_, static_cast<std::size_t>(image_->GetNumberOfPoints())}; }

  /// Trilinear; 0 outside. @param index  continuous voxel index
  double at(const Vec3& index) const {
    Index3 base{};
    Vec3 part;
    for (int d = 0; d < 3; ++d) {
      const double x = index[d] + margin;
      if (!(x >= 0 && x < extent_[d] - 1)) return 0;
      base[d] = static_cast<std::int32_t>(x);
      part[d] = x - std::floor(x);
    }
    double sum = 0;
    for (int a = 0; a < 8; ++a) {
      double weight = 1;
      Index3 c = base;
      for (int d = 0; d < 3; ++d) {
        const int bit = a >> d & 1;
        c[d] += bit;
        weight *= bit ? part[d] : 1 - part[d];
      }
      sum += weight * static_cast<double>(values_[offset_in(extent_, c)]);
    }
    return sum;
  }

private:
  vtkSmartPointer<vtkImageData> image_;
  const float* values_ = nullptr;
  Index3 extent_{};
};

/// What is where: number of the segment plus 1, 0 outside.
class Body {
public:
  explicit Body(const Lattice& lattice) : voxels_(lattice.voxels) {
    std::size_t filled = 0;
    std::vector<float> sum;
    for (const LatticeSegment& s : lattice.segments) {
      if (!s.material) continue;
      labels_.push_back(s.segment.label);
      masks_.emplace_back(lattice, s.segment.label);
      filled += s.num_voxels;
      sum.resize(masks_.back().values().size());
      std::transform(sum.begin(), sum.end(), masks_.back().values().begin(), sum.begin(), std::plus<>());
    }
    std::nth_element(sum.begin(), sum.begin() + static_cast<std::ptrdiff_t>(filled), sum.end(), std::greater<>());
    level_ = sum[filled];
  }

  int at(const Vec3& position) const {
    const Vec3 index = voxels_.continuous_index(position);
    double sum = 0, most = 0;
    int which = 0;
    for (std::size_t s = 0; s < masks_.size(); ++s) {
      const double value = masks_[s].at(index);
      sum += value;
      if (value <= most) continue;
      most = value;
      which = static_cast<int>(s) + 1;
    }
    return sum > level_ ? which : 0;
  }

  std::uint16_t label(int which) const { return labels_[which - 1]; }

private:
  Grid voxels_;
  std::vector<std::uint16_t> labels_;
  std::vector<SmoothMask> masks_;
  double level_ = 0.5;  ///< of the surface
};

CGAL::Bbox_3 bounds_of(const Grid& voxels) {
  CGAL::Bbox_3 box;
  for (int a = 0; a < 8; ++a) {
    Vec3 corner;
    for (int d = 0; d < 3; ++d) corner[d] = a >> d & 1 ? voxels.extent()[d] + 1.0 : -2.0;
    const Vec3 p = voxels.position(corner);
    box += CGAL::Bbox_3(p[0], p[1], p[2], p[0], p[1], p[2]);
  }
  return box;
}

TetMesh to_mesh(const Complex& complex, const Body& body) {
  TetMesh mesh;
  std::map<Complex::Vertex_handle, std::int32_t> number;
  for (auto cell = complex.cells_in_complex_begin(); cell != complex.cells_in_complex_end(); ++cell) {
    std::array<std::int32_t, 4> corners{};
    for (int a = 0; a < 4; ++a) {
      const Complex::Vertex_handle v = cell->vertex(a);
      const auto [found, is_new] = number.try_emplace(v, static_cast<std::int32_t>(mesh.points.size()));
      if (is_new) mesh.points.push_back(to_vec(v->point().point()));
      corners[a] = found->second;
    }
    mesh.corners.push_back(corners);
    mesh.segment.push_back(body.label(complex.subdomain_index(cell)));
  }
  return mesh;
}

}  // namespace

double TetSizes::at(const Vec3& position) const {
  double least = size;
  for (const Finer& f : finer)
    least = std::min(least, f.size + std::max(0.0, (position - f.center).norm() - f.radius) / 2);
  return least;
}

TetMesh mesh_body(const Lattice& lattice, const TetSizes& sizes) {
  const Body body(lattice);
  CGAL::get_default_random() = CGAL::Random(42);
  CGAL::Random random(42);
  const auto label = [&body](const Kernel::Point_3& p) { return body.at(to_vec(p)); };
  const Domain domain(label, bounds_of(lattice.voxels), parameters::relative_error_bound = 1e-4,
                      parameters::p_rng = &random);
  struct Field {
    using FT = Kernel::FT;
    using Point_3 = Kernel::Point_3;
    using Index = Domain::Index;
    const TetSizes* sizes;
    double factor;
    FT operator()(const Point_3& p, int, const Index&) const { return factor * sizes->at(to_vec(p)); }
  };
  const Criteria criteria(parameters::facet_angle = 25, parameters::facet_size = Field{&sizes, 1},
                          parameters::facet_distance = Field{&sizes, 0.1}, parameters::cell_radius_edge_ratio = 2,
                          parameters::cell_size = Field{&sizes, 1});
  const auto complex = CGAL::make_mesh_3<Complex>(domain, criteria, parameters::no_perturb(), parameters::no_exude());
  TetMesh mesh = to_mesh(complex, body);
  if (mesh.corners.empty())
    throw Error(ErrorKind::input,
                fmt::format("no tetrahedron of {:g} mm fits into the body, expected smaller ones", sizes.size));
  return mesh;
}

}  // namespace hexmesh

// SPDX-License-Identifier: Apache-2.0
#include "hexmesh/view/volume.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <numbers>

#include "hexmesh/view/grey_window.h"

namespace hexmesh {
namespace {

constexpr double full = 65535;
constexpr double full_normal = 32767;
constexpr double margin = 1.05;  // of the picture around the body
constexpr int planes_at_a_time = 32;
constexpr int rows_at_a_time = 16;
constexpr double darkest = 0.6;  // of a colour at the dark end of the grey window
constexpr float ambient = 0.55F, diffuse = 0.75F;

/// The edges of a cell: two nodes that differ in one bit.
constexpr std::array<std::array<int, 2>, 12> cell_edges = {
    {{0, 1}, {2, 3}, {4, 5}, {6, 7}, {0, 2}, {1, 3}, {4, 6}, {5, 7}, {0, 4}, {1, 5}, {2, 6}, {3, 7}}};

using Float4 = float __attribute__((vector_size(16)));
using Int4 = std::int32_t __attribute__((vector_size(16)));
using Short4 = std::uint16_t __attribute__((vector_size(8)));
using SignedShort4 = std::int16_t __attribute__((vector_size(8)));

// Inlined into VolumeRenderer::paint, whose clones are for more than one kind of processor.
template <class Packed>
[[gnu::always_inline]] inline Float4 unpack(const unsigned char* from) {
  Packed packed;
  std::memcpy(&packed, from, sizeof(packed));
  return __builtin_convertvector(__builtin_convertvector(packed, Int4), Float4);  // no one step is as fast with GCC 12
}

/// Linear between two neighbours.
template <class Packed>
[[gnu::always_inline]] inline Float4 along_row(const unsigned char* from, float x) {
  const Float4 a = unpack<Packed>(from), b = unpack<Packed>(from + sizeof(Packed));
  return a + x * (b - a);
}

/// Trilinear between the eight texels at `base`.
template <class Packed>
[[gnu::always_inline]] inline Float4 interpolate(const unsigned char* base, std::ptrdiff_t row, std::ptrdiff_t layer,
                                                 Float4 share) {
  const float x = share[0];
  const Float4 a = along_row<Packed>(base, x), b = along_row<Packed>(base + row, x);
  const Float4 c = along_row<Packed>(base + layer, x), d = along_row<Packed>(base + layer + row, x);
  const Float4 low = a + share[1] * (b - a), high = c + share[1] * (d - c);
  return low + share[2] * (high - low);
}

/// Grows from 0 to 4 with the angle of (x, y): the quadrant by the signs, within it by the share of one coordinate.
float order_around(float x, float y) {
  const float sum = std::abs(x) + std::abs(y);
  if (sum == 0) return 0;
  if (y >= 0) return x >= 0 ? y / sum : 1 - x / sum;
  return x < 0 ? 2 - y / sum : 3 + x / sum;
}

}  // namespace

/// The cells of one state, seen from the camera.
struct VolumeRenderer::Moved {
  std::vector<Eigen::Vector3f> nodes;       ///< column and row [mm across the view, as in the middle], depth
  std::vector<std::array<float, 3>> light;  ///< of each cell; see Polygon
};

std::map<std::uint16_t, Appearance> default_appearance(const Result& result) {
  std::map<std::uint16_t, Appearance> out;
  std::size_t most = 0;
  for (const LatticeSegment& s : result.segments)
    if (s.material) most = std::max(most, s.num_voxels);
  for (const LatticeSegment& s : result.segments)
    if (s.material) out[s.segment.label] = {s.segment.color, s.num_voxels == most ? 0.05 : 0.25};
  return out;
}

VolumeRenderer::VolumeRenderer(const Result& result, const IntensityVolume* scan, const VolumeOptions& options)
    : result_(result), options_(options) {
  for (std::size_t d = 0; d < 3; ++d) size_[d] = result.voxels.extent()[d] + 2;
  classify(scan);
  if (options_.shaded) find_normals();
  place_camera();
}

void VolumeRenderer::classify(const IntensityVolume* scan) {
  std::map<std::uint16_t, Appearance> appearance = default_appearance(result_);
  for (const auto& [label, look] : options_.appearance) appearance[label] = look;
  const double share = static_cast<double>(reference_planes) / options_.planes;
  for (auto& [label, look] : appearance)
    look.opacity =
        options_.linear_opacity ? std::min(1.0, look.opacity * share) : 1 - std::pow(1 - look.opacity, share);
  most_opaque_ = 1e-12;
  for (const auto& [label, look] : appearance) most_opaque_ = std::max(most_opaque_, look.opacity);
  std::optional<GreyWindow> window;
  if (scan) window = grey_window(result_, *scan, options_.level, options_.window);

  texture_.assign(
      static_cast<std::size_t>(size_[0]) * static_cast<std::size_t>(size_[1]) * static_cast<std::size_t>(size_[2]),
      Texel{});
  const Index3& n = result_.voxels.extent();
#pragma omp parallel for schedule(static)
  for (std::int32_t k = 0; k < n[2]; ++k)
    for (std::int32_t j = 0; j < n[1]; ++j)
      for (std::int32_t i = 0; i < n[0]; ++i) {
        const auto look = appearance.find(result_.labels[result_.voxels.offset({i, j, k})]);
        if (look == appearance.end()) continue;
        double brightness = 1;
        if (scan) {
          const double value = value_at(*scan, result_.voxels.position(Vec3(i, j, k)));
          brightness = std::isnan(value) ? darkest : darkest + (1 - darkest) * window->brightness(value);
        }
        Texel& texel = texture_[static_cast<std::size_t>(i + 1) +
                                static_cast<std::size_t>(size_[0]) *
                                    (static_cast<std::size_t>(j + 1) +
                                     static_cast<std::size_t>(size_[1]) * static_cast<std::size_t>(k + 1))];
        const double opacity = look->second.opacity;
        for (std::size_t c = 0; c < 3; ++c)
          texel.rgba[c] = static_cast<std::uint16_t>(
              std::lround(full * opacity / most_opaque_ * brightness * std::clamp(look->second.color[c], 0.0, 1.0)));
        texel.rgba[3] = static_cast<std::uint16_t>(std::lround(full * opacity / most_opaque_));
      }
}

/// Central differences of the opacity over five voxels, so that the steps between voxels do not show.
void VolumeRenderer::find_normals() {
  normals_.assign(texture_.size(), Normal{});
  const std::array<std::ptrdiff_t, 3> stride = {1, size_[0], static_cast<std::ptrdiff_t>(size_[0]) * size_[1]};
  constexpr int reach = 2;
  const Vec3& spacing = result_.voxels.spacing();
  const Vec3 per_mm = spacing.minCoeff() * spacing.cwiseInverse();  // at most 1
  double largest = 1;
  for (const Texel& t : texture_) largest = std::max<double>(largest, t.rgba[3]);
#pragma omp parallel for schedule(static)
  for (std::int32_t k = 0; k < size_[2]; ++k)
    for (std::int32_t j = 0; j < size_[1]; ++j)
      for (std::int32_t i = 0; i < size_[0]; ++i) {
        const std::ptrdiff_t n = i + stride[1] * j + stride[2] * k;
        Eigen::Vector3d sum = Eigen::Vector3d::Zero();
        double weights = 0;
        for (int c = std::max(-reach, -k); c <= std::min(reach, size_[2] - 1 - k); ++c)
          for (int b = std::max(-reach, -j); b <= std::min(reach, size_[1] - 1 - j); ++b)
            for (int a = std::max(-reach, -i); a <= std::min(reach, size_[0] - 1 - i); ++a) {
              const std::ptrdiff_t m = n + a + stride[1] * b + stride[2] * c;
              const double weight = 1.0 / (1 + a * a + b * b + c * c);
              sum -= weight * texture_[static_cast<std::size_t>(m)].rgba[3] * Eigen::Vector3d(a, b, c);
              weights += weight;
            }
        const Eigen::Vector3d normal = (sum / (weights * largest) * full_normal).cwiseProduct(per_mm);
        for (std::size_t d = 0; d < 3; ++d)
          normals_[static_cast<std::size_t>(n)].xyz0[d] =
              static_cast<std::int16_t>(std::clamp(normal[static_cast<Eigen::Index>(d)], -full_normal, full_normal));
      }
}

void VolumeRenderer::place_camera() {
  view_ = options_.view.normalized();
  right_ = view_.cross(options_.up).normalized();
  down_ = view_.cross(right_);
  const Bounds b = bounds_of(result_);
  const Vec3 middle = (b.low + b.high) / 2;
  near_ = std::numeric_limits<double>::infinity();
  far_ = -near_;
  double across = 0, along = 0;  // half sizes on the picture
  for (int corner = 0; corner < 8; ++corner) {
    Vec3 p;
    for (int d = 0; d < 3; ++d) p[d] = (corner_bit(corner, d) == 1 ? b.high[d] : b.low[d]) - middle[d];
    near_ = std::min(near_, view_.dot(p));
    far_ = std::max(far_, view_.dot(p));
    across = std::max(across, std::abs(right_.dot(p)));
    along = std::max(along, std::abs(down_.dot(p)));
  }
  pixel_ = 2 * margin * std::max(across / options_.width, along / options_.height);
  // In perspective a pixel is that large in front of the body.
  if (options_.perspective > 0)
    focal_ = pixel_ * options_.height / 2 / std::tan(options_.perspective * std::numbers::pi / 360);
  center_ = middle;
}

Canvas VolumeRenderer::draw(const std::vector<Vec3>& displacement) const {
  Moved moved;
  moved.nodes.resize(result_.nodes.size());
  for (std::size_t n = 0; n < result_.nodes.size(); ++n) {
    const Vec3 p = result_.nodes[n] - center_ + (displacement.empty() ? Vec3(Vec3::Zero()) : displacement[n]);
    moved.nodes[n] = Vec3(right_.dot(p), down_.dot(p), view_.dot(p)).cast<float>();
  }
  const Vec3 light = (-0.5 * right_ - 0.6 * down_ - view_).normalized();
  moved.light.resize(result_.cells.size());

  // The cells that each plane cuts: those whose depths it lies between. No other is looked at.
  const double distance = plane_distance();
  const auto planes = static_cast<std::size_t>(options_.planes);
  std::vector<std::vector<std::int32_t>> cut_by(planes);
  for (std::size_t c = 0; c < result_.cells.size(); ++c) {
    double nearest = std::numeric_limits<double>::infinity(), farthest = -nearest;
    std::array<Eigen::Vector3f, 8> corners;
    for (std::size_t a = 0; a < 8; ++a) {
      corners[a] = moved.nodes[static_cast<std::size_t>(result_.cell_nodes[c][a])];
      nearest = std::min<double>(nearest, corners[a][2]);
      farthest = std::max<double>(farthest, corners[a][2]);
    }
    const double first = std::ceil((far_ - farthest) / distance - 0.5);
    const double last = std::floor((far_ - nearest) / distance - 0.5);
    for (double n = std::max(0.0, first); n <= std::min(last, options_.planes - 1.0); ++n)
      cut_by[static_cast<std::size_t>(n)].push_back(static_cast<std::int32_t>(c));
    if (!options_.shaded) continue;
    // A normal is turned by F^-T: n . F^-1 light, exact where the cell is turned, about right where it is strained.
    Mat3 edges;  // F
    for (int d = 0; d < 3; ++d) {
      Eigen::Vector3f sum = Eigen::Vector3f::Zero();
      for (int a = 0; a < 8; ++a)
        sum += (corner_bit(a, d) == 1 ? 0.25F : -0.25F) * corners[static_cast<std::size_t>(a)];
      edges.col(d) =
          sum.cast<double>() / (result_.voxels_per_cell[static_cast<std::size_t>(d)] * result_.voxels.spacing()[d]);
    }
    const Vec3 seen(right_.dot(light), down_.dot(light), view_.dot(light));
    Vec3 rest = std::abs(edges.determinant()) > 1e-6 ? Vec3(edges.inverse() * seen) : Vec3(Vec3::Zero());
    if (const double length = rest.norm(); length > 0) rest /= length;
    for (std::size_t d = 0; d < 3; ++d) moved.light[c][d] = static_cast<float>(rest[static_cast<Eigen::Index>(d)]);
  }

  std::vector<std::array<float, 4>> picture(static_cast<std::size_t>(options_.width) *
                                            static_cast<std::size_t>(options_.height));
  std::vector<Plane> cuts(planes_at_a_time);
  for (int first = 0; first < options_.planes; first += planes_at_a_time) {
    const int count = std::min(planes_at_a_time, options_.planes - first);
#pragma omp parallel for schedule(dynamic, 1)
    for (int n = 0; n < count; ++n)
      cut(moved, first + n, cut_by[static_cast<std::size_t>(first + n)], cuts[static_cast<std::size_t>(n)]);
#pragma omp parallel for schedule(dynamic, 1)
    for (int row = 0; row < options_.height; row += rows_at_a_time)
      for (int n = 0; n < count; ++n)
        paint(cuts[static_cast<std::size_t>(n)], row, std::min(row + rows_at_a_time, options_.height) - 1, picture);
  }

  Canvas canvas(options_.width, options_.height);
  for (int y = 0; y < options_.height; ++y)
    for (int x = 0; x < options_.width; ++x) {
      const auto& p =
          picture[static_cast<std::size_t>(y) * static_cast<std::size_t>(options_.width) + static_cast<std::size_t>(x)];
      for (std::size_t c = 0; c < 3; ++c)
        canvas.at(x, y)[c] = static_cast<std::uint8_t>(std::lround(
            std::clamp(255 * p[c] + (1 - p[3]) * static_cast<float>(options_.background[c]), 0.0F, 255.0F)));
    }
  return canvas;
}

/// The polygons in which a plane cuts cells: its intersections with their edges, in the order of their angles around
/// the mean, which is the order of the outline wherever that is seen whole from there.
void VolumeRenderer::cut(const Moved& moved, int plane, const std::vector<std::int32_t>& cells, Plane& out) const {
  out.corners.clear();
  out.polygons.clear();
  const auto depth = static_cast<float>(far_ - (plane + 0.5) * plane_distance());
  double scale = 1 / pixel_;
  if (focal_ > 0) scale *= focal_ / (focal_ + depth - near_);
  const auto zoom = static_cast<float>(scale);
  const float middle_x = static_cast<float>(options_.width) / 2 - 0.5F;
  const float middle_y = static_cast<float>(options_.height) / 2 - 0.5F;
  for (const std::int32_t cell : cells) {
    const auto c = static_cast<std::size_t>(cell);
    std::array<std::pair<float, Corner>, 12> cuts;
    std::size_t count = 0;
    Corner mean{};
    for (const auto& [a, b] : cell_edges) {
      // From the lower node, so that all cells of an edge agree to the last bit.
      const auto node_a = static_cast<std::size_t>(result_.cell_nodes[c][static_cast<std::size_t>(a)]);
      const auto node_b = static_cast<std::size_t>(result_.cell_nodes[c][static_cast<std::size_t>(b)]);
      const Eigen::Vector3f &p = moved.nodes[node_a], &q = moved.nodes[node_b];
      if ((p[2] < depth) == (q[2] < depth)) continue;
      const float t = (depth - p[2]) / (q[2] - p[2]);
      Corner& corner = cuts[count++].second;
      corner.x = middle_x + zoom * (p[0] + t * (q[0] - p[0]));
      corner.y = middle_y + zoom * (p[1] + t * (q[1] - p[1]));
      for (std::size_t d = 0; d < 3; ++d) {
        // Voxel (0, 0, 0) is texel (1, 1, 1); its corner lies half a voxel before it.
        const int side_a = corner_bit(a, static_cast<int>(d)), side_b = corner_bit(b, static_cast<int>(d));
        const float place = static_cast<float>(side_a) + t * static_cast<float>(side_b - side_a);
        corner.texture[d] =
            (static_cast<float>(result_.cells[c][d]) + place) * static_cast<float>(result_.voxels_per_cell[d]) + 0.5F;
        mean.texture[d] += corner.texture[d];
      }
      mean.x += corner.x;
      mean.y += corner.y;
    }
    if (count < 3) continue;
    const float part = 1 / static_cast<float>(count);
    mean.x *= part;
    mean.y *= part;
    for (float& t : mean.texture) t *= part;
    for (std::size_t n = 0; n < count; ++n) {
      cuts[n].first = order_around(cuts[n].second.x - mean.x, cuts[n].second.y - mean.y);
      for (std::size_t m = n; m > 0 && cuts[m].first < cuts[m - 1].first; --m) std::swap(cuts[m], cuts[m - 1]);
    }
    Polygon polygon{static_cast<std::int32_t>(out.corners.size()), static_cast<std::int32_t>(count) + 1, mean.y, mean.y,
                    moved.light[c]};
    out.corners.push_back(mean);
    for (std::size_t n = 0; n < count; ++n) {
      out.corners.push_back(cuts[n].second);
      polygon.top = std::min(polygon.top, cuts[n].second.y);
      polygon.bottom = std::max(polygon.bottom, cuts[n].second.y);
    }
    out.polygons.push_back(polygon);
  }
}

/// Blends a triangle over those rows of the picture, at the centres of its pixels. A pixel on an edge belongs to one of
/// the two triangles there.
template <bool shaded>
[[gnu::always_inline]] inline void VolumeRenderer::paint_triangle(const Corner& a, const Corner& b, const Corner& c,
                                                                  const std::array<float, 3>& light, int first_row,
                                                                  int last_row,
                                                                  std::vector<std::array<float, 4>>& picture) const {
  const Corner *top = &a, *middle = &b, *bottom = &c;
  const auto above = [](const Corner* p, const Corner* q) { return p->y < q->y || (p->y == q->y && p->x < q->x); };
  if (above(middle, top)) std::swap(top, middle);
  if (above(bottom, middle)) std::swap(middle, bottom);
  if (above(middle, top)) std::swap(top, middle);

  const float area = (middle->x - top->x) * (bottom->y - top->y) - (bottom->x - top->x) * (middle->y - top->y);
  if (!(std::abs(area) > 0) || !std::isfinite(area)) return;
  const auto texture = [](const Corner& corner) {
    return Float4{corner.texture[0], corner.texture[1], corner.texture[2], 0};
  };
  const Float4 start = texture(*top), p = texture(*middle) - start, q = texture(*bottom) - start;
  const Float4 along_x = (p * (bottom->y - top->y) - q * (middle->y - top->y)) / area;
  const Float4 along_y = (q * (middle->x - top->x) - p * (bottom->x - top->x)) / area;
  const auto before_end = [](std::int32_t size) { return static_cast<float>(size) - 1.001F; };
  const Float4 last = {before_end(size_[0]), before_end(size_[1]), before_end(size_[2]), 0};
  const auto edge = [](const Corner& from, const Corner& to, float y) {
    return to.y > from.y ? from.x + (y - from.y) * (to.x - from.x) / (to.y - from.y) : from.x;
  };
  const std::ptrdiff_t row_bytes = size_[0] * static_cast<std::ptrdiff_t>(sizeof(Texel));
  const std::ptrdiff_t layer_bytes = row_bytes * size_[1];
  const auto* texels = reinterpret_cast<const unsigned char*>(texture_.data());
  const auto* normals = reinterpret_cast<const unsigned char*>(normals_.data());
  const auto unit = static_cast<float>(most_opaque_ / full);

  // Corners may be anywhere: those of slivers move without meaning.
  const auto pixel_from = [](float place, int size) {
    return static_cast<int>(std::clamp(std::ceil(place), 0.0F, static_cast<float>(size)));
  };
  const int first = std::max(first_row, pixel_from(top->y, options_.height));
  const int end = std::min(last_row, pixel_from(bottom->y, options_.height) - 1);
  for (int row = first; row <= end; ++row) {
    const auto y = static_cast<float>(row);
    const float x0 = edge(*top, *bottom, y);
    const float x1 = y < middle->y ? edge(*top, *middle, y) : edge(*middle, *bottom, y);
    const int left = pixel_from(std::min(x0, x1), options_.width);
    const int right = pixel_from(std::max(x0, x1), options_.width);
    std::array<float, 4>* pixel = picture.data() + static_cast<std::ptrdiff_t>(row) * options_.width + left;
    const Float4 at_row = start + (y - top->y) * along_y;
    for (int column = left; column < right; ++column, ++pixel) {
      Float4 place = at_row + (static_cast<float>(column) - top->x) * along_x;
      place = place > 0 ? place : Float4{};
      place = place < last ? place : last;
      const Int4 base = __builtin_convertvector(place, Int4);
      const Float4 share = place - __builtin_convertvector(base, Float4);
      const std::ptrdiff_t offset =
          base[0] * static_cast<std::ptrdiff_t>(sizeof(Texel)) + base[1] * row_bytes + base[2] * layer_bytes;
      Float4 color = unit * interpolate<Short4>(texels + offset, row_bytes, layer_bytes, share);
      const float opacity = color[3];
      if (!(opacity > 0)) continue;
      if constexpr (shaded) {
        const Float4 normal = interpolate<SignedShort4>(normals + offset, row_bytes, layer_bytes, share);
        const float length = std::sqrt(normal[0] * normal[0] + normal[1] * normal[1] + normal[2] * normal[2]);
        // The steeper the opacity, the more of a surface it is; inside there is none to be lit.
        const float surface = std::min(1.0F, length * (4 / static_cast<float>(full_normal)));
        const float cosine =
            (normal[0] * light[0] + normal[1] * light[1] + normal[2] * light[2]) / std::max(length, 1e-6F);
        const float lit = 1 + surface * (ambient + diffuse * std::max(0.0F, cosine) - 1);
        color *= lit;
        color[3] = opacity;
      }
      Float4 behind;
      std::memcpy(&behind, pixel, sizeof(behind));
      const Float4 blended = color + (1 - opacity) * behind;
      std::memcpy(pixel, &blended, sizeof(blended));
    }
  }
}

__attribute__((target_clones("arch=x86-64-v3", "default"))) void VolumeRenderer::paint(
    const Plane& plane, int first_row, int last_row, std::vector<std::array<float, 4>>& picture) const {
  for (const Polygon& polygon : plane.polygons) {
    if (polygon.bottom < static_cast<float>(first_row) || polygon.top > static_cast<float>(last_row)) continue;
    const Corner* corners = &plane.corners[static_cast<std::size_t>(polygon.first)];
    for (std::int32_t n = 1; n < polygon.count; ++n) {
      const Corner &b = corners[n], &c = corners[n + 1 < polygon.count ? n + 1 : 1];
      if (options_.shaded)
        paint_triangle<true>(corners[0], b, c, polygon.light, first_row, last_row, picture);
      else
        paint_triangle<false>(corners[0], b, c, polygon.light, first_row, last_row, picture);
    }
  }
}

}  // namespace hexmesh

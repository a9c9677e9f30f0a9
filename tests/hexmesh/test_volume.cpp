// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>

#include "hexmesh/surface/extract.h"
#include "hexmesh/view/volume.h"
#include "support/bodies.h"

namespace test_volume {

using namespace hexmesh;
using namespace testing_support;

/// A ball of two segments with grey values, not aligned with the axes.
struct Patient {
  Patient()
      : lattice(bitten_ball({1, 1.1, 0.9}, {0, 0, 0}, random_rotation(3))),
        scan{lattice.voxels, std::vector<float>(lattice.labels.size())} {
    for (const LatticeSegment& s : lattice.segments) append(lattice.surface, extract_surface(lattice, s.segment.label));
    for (std::size_t n = 0; n < scan.values.size(); ++n) {
      const Index3 v = lattice.voxels.index(n);
      scan.values[n] = static_cast<float>(100 + 40 * std::sin(0.9 * v[0]) * std::cos(0.7 * v[1] + 0.5 * v[2]));
    }
    double opacity = 0.02;
    for (const LatticeSegment& s : lattice.segments) {
      options.appearance[s.segment.label] = {s.segment.color, opacity};
      opacity = 0.08;
    }
    options.shaded = false;
    options.view = {0.5, 1, -0.3};
    options.width = options.height = 160;
    options.level = 100;
    options.window = 120;
  }
  Lattice lattice;
  IntensityVolume scan;
  VolumeOptions options;
};

double root_mean_square(const Canvas& a, const Canvas& b) {
  double sum = 0;
  for (int y = 0; y < a.height(); ++y)
    for (int x = 0; x < a.width(); ++x)
      for (std::size_t c = 0; c < 3; ++c) sum += std::pow(a.at(x, y)[c] - b.at(x, y)[c], 2);
  return std::sqrt(sum / (3.0 * a.width() * a.height()));
}

/// A ray through the scan for each pixel, front to back in small steps: the body at rest, orthographic.
Canvas cast_rays(const Patient& p, const Result& r) {
  const VolumeOptions& o = p.options;
  const Grid& grid = p.lattice.voxels;
  const Vec3 view = o.view.normalized(), right = view.cross(o.up).normalized(), down = view.cross(right);
  const Bounds b = bounds_of(r);
  const Vec3 middle = (b.low + b.high) / 2;
  double near = INFINITY, far = -INFINITY, across = 0, along = 0;
  for (int corner = 0; corner < 8; ++corner) {
    Vec3 q;
    for (int d = 0; d < 3; ++d) q[d] = (corner_bit(corner, d) == 1 ? b.high[d] : b.low[d]) - middle[d];
    near = std::min(near, view.dot(q));
    far = std::max(far, view.dot(q));
    across = std::max(across, std::abs(right.dot(q)));
    along = std::max(along, std::abs(down.dot(q)));
  }
  const double pixel = 2.1 * std::max(across / o.width, along / o.height);
  const double reference = (far - near) / reference_planes, step = reference / 20;
  Canvas out(o.width, o.height);
  for (int y = 0; y < o.height; ++y)
    for (int x = 0; x < o.width; ++x) {
      Vec3 color = Vec3::Zero();
      double clear = 1;
      for (double depth = near + step / 2; depth < far; depth += step) {
        const Vec3 at = middle + pixel * (x - o.width / 2.0 + 0.5) * right + pixel * (y - o.height / 2.0 + 0.5) * down +
                        depth * view;
        const Vec3 index = grid.continuous_index(at);
        Vec3 sample = Vec3::Zero();
        double opacity = 0;
        for (int a = 0; a < 8; ++a) {
          Index3 v;
          double weight = 1;
          for (int d = 0; d < 3; ++d) {
            const double base = std::floor(index[d]);
            v[d] = static_cast<std::int32_t>(base) + corner_bit(a, d);
            weight *= corner_bit(a, d) == 1 ? index[d] - base : 1 - index[d] + base;
          }
          if (!grid.contains(v)) continue;
          const auto look = o.appearance.find(p.lattice.labels[grid.offset(v)]);
          if (look == o.appearance.end()) continue;
          const double grey = std::clamp((static_cast<double>(p.scan.values[grid.offset(v)]) - 40) / 120, 0.0, 1.0);
          const double alpha = 1 - std::pow(1 - look->second.opacity, step / reference);
          opacity += weight * alpha;
          sample += weight * alpha * (0.6 + 0.4 * grey) *
                    Vec3(look->second.color[0], look->second.color[1], look->second.color[2]);
        }
        color += clear * sample;
        clear *= 1 - opacity;
      }
      for (std::size_t c = 0; c < 3; ++c)
        out.at(x, y)[c] =
            static_cast<std::uint8_t>(std::lround(255 * color[static_cast<Eigen::Index>(c)] + clear * o.background[c]));
    }
  return out;
}

TEST(Volume, ABodyAtRestLooksLikeRaysCastThroughTheScan) {
  Patient p;
  p.options.planes = 400;
  // The rays see half a voxel around the material, which cells that are full to the brim do not hold: coarser cells do.
  for (const int level : {1, 2}) {
    const Result r = rest_state(p.lattice, level);
    const Canvas planes = VolumeRenderer(r, &p.scan, p.options).draw({});
    const double difference = root_mean_square(planes, cast_rays(p, r));
    RecordProperty("rms", std::to_string(difference));
    EXPECT_LT(difference, 2) << level;
    std::size_t lit = 0;
    for (int y = 0; y < planes.height(); ++y)
      for (int x = 0; x < planes.width(); ++x) lit += planes.at(x, y)[0] > 60;
    EXPECT_GT(lit, 3000U) << "something is seen";
  }
}

TEST(Volume, AHundredPlanesLookLikeFourHundred) {
  Patient p;
  const Result r = displaced(p.lattice, 1, [](const Vec3& x) -> Vec3 { return {0.2 * x[1], 0.1 * x[2], -0.1 * x[0]}; });
  const auto draw = [&](int planes) {
    p.options.planes = planes;
    return VolumeRenderer(r, &p.scan, p.options).draw(r.displacement);
  };
  const Canvas few = draw(100), many = draw(400);
  double difference = 0, total = 0;
  for (int y = 0; y < few.height(); ++y)
    for (int x = 0; x < few.width(); ++x)
      for (std::size_t c = 0; c < 3; ++c) {
        difference += std::abs(few.at(x, y)[c] - many.at(x, y)[c]);
        total += many.at(x, y)[c];
      }
  EXPECT_LT(difference / total, 0.03);
}

TEST(Volume, OpacityDoesNotDependOnTheNumberOfPlanesAndIsThatOfTheReference) {
  // A block of one value, seen along an axis: what is left of the background is (1 - alpha)^101.
  Lattice lattice = box({16, 16, 16}, {1, 1, 1});
  Result r = rest_state(lattice, 1);
  VolumeOptions o;
  o.shaded = false;
  o.background = {255, 255, 255};
  o.appearance[lattice.segments.front().segment.label] = {{0, 0, 0}, 0.03};
  o.width = o.height = 65;
  const double thickness = 15.75 / 16;  // the outer half of the outermost voxels fades to a half
  for (const int planes : {20, 101, 300}) {
    o.planes = planes;
    EXPECT_NEAR(VolumeRenderer(r, nullptr, o).draw({}).at(32, 32)[0], 255 * std::pow(1 - 0.03, 101 * thickness), 1.5)
        << planes;
  }
  o.linear_opacity = true;  // the paper's
  o.planes = 20;
  EXPECT_NEAR(VolumeRenderer(r, nullptr, o).draw({}).at(32, 32)[0], 255 * std::pow(1 - 0.03 * 101 / 20, 20 * thickness),
              1.5);
}

TEST(Volume, ThePolygonsOfAPlaneLeaveNoGapAndDoNotOverlap) {
  // One half-clear plane through the middle of a block, askew to its cells: each pixel is covered once.
  const Lattice lattice = box({16, 16, 16}, {1, 1, 1});
  const auto bend = [](const Vec3& x) -> Vec3 { return {0.02 * x[1] * x[2], -0.01 * x[0] * x[2], 0.1 * x[0]}; };
  VolumeOptions o;
  o.shaded = false;
  o.background = {0, 0, 0};
  o.planes = reference_planes;
  o.view = {0.5, 1, -0.7};
  o.width = o.height = 240;
  for (const int level : {0, 1, 2}) {
    const Result r = displaced(lattice, level, bend);
    o.appearance[lattice.segments.front().segment.label] = {{1, 1, 1}, 1 - std::pow(0.5, 1.0 / reference_planes)};
    o.planes = 1;
    const Canvas picture = VolumeRenderer(r, nullptr, o).draw(r.displacement);
    for (int y = 80; y < 160; ++y)
      for (int x = 80; x < 160; ++x) ASSERT_NEAR(picture.at(x, y)[0], 127.5, 1) << level << ": " << x << " " << y;
  }
}

TEST(Volume, FaintSegmentsAreSeenAlsoWithManyPlanes) {
  const Lattice lattice = box({16, 16, 16}, {1, 1, 1});
  const Result r = rest_state(lattice, 1);
  VolumeOptions o;
  o.shaded = false;
  o.background = {255, 255, 255};
  o.width = o.height = 33;
  o.planes = 10000;
  for (const double opacity : {0.0007, 0.0022}) {
    o.appearance[lattice.segments.front().segment.label] = {{0, 0, 0}, opacity};
    EXPECT_NEAR(VolumeRenderer(r, nullptr, o).draw({}).at(16, 16)[0], 255 * std::pow(1 - opacity, 101 * 15.75 / 16),
                1.5);
  }
}

TEST(Volume, FlatVoxelsAreLitAsCubes) {
  // The same ball of voxels four times as high as wide, and of cubes.
  const auto picture = [](double height) {
    const LabelVolume volume =
        make_volume({28, 28, static_cast<std::int32_t>(28 / height)}, {1, 1, height}, [&](const Index3& v) {
          return (Vec3(v[0] + 0.5, v[1] + 0.5, height * (v[2] + 0.5)) - Vec3::Constant(14)).norm() < 12 ? 1 : 0;
        });
    std::vector<LatticeSegment> segments;
    for (const Segment& s : volume.segments) segments.push_back({s, Material{0.1, 0.3, 1e-9}});
    const Lattice lattice = build_lattice(volume, segments);
    VolumeOptions o;
    o.width = o.height = 100;
    o.appearance[1] = {{0.6, 0.6, 0.6}, 1};
    return VolumeRenderer(rest_state(lattice, 1), nullptr, o).draw({});
  };
  const Canvas cubes = picture(1), flat = picture(4);
  // Down the middle of the ball, away from its jagged rim.
  for (const int y : {20, 30, 50, 70}) EXPECT_NEAR(flat.at(50, y)[0], cubes.at(50, y)[0], 25) << y;
}

TEST(Volume, AMovedBodyIsSeenWhereItWentFromEverySide) {
  // A bright bead in a dim block; the block is shifted and squeezed, and the bead is found where that takes it.
  const LabelVolume volume = make_volume({24, 20, 16}, {1, 1, 1}, [](const Index3& v) {
    return std::abs(v[0] - 6) <= 1 && std::abs(v[1] - 12) <= 1 && std::abs(v[2] - 4) <= 1 ? 2 : 1;
  });
  std::vector<LatticeSegment> segments;
  for (const Segment& s : volume.segments) segments.push_back({s, Material{0.1, 0.3, 1e-9}});
  const Lattice lattice = build_lattice(volume, segments);
  const Vec3 bead(6, 12, 4);
  const auto field = [](const Vec3& x) -> Vec3 { return {2 + 0.2 * x[1], -0.2 * x[1], 1 - 0.1 * x[0]}; };
  for (const Vec3& view : {Vec3(0, 1, 0), Vec3(1, 0, 0), Vec3(0, 0, -1), Vec3(0.3, -1, 0.5)})
    for (const double perspective : {0.0, 40.0}) {
      const Result r = displaced(lattice, 1, field);
      VolumeOptions o;
      o.view = view;
      o.up = std::abs(view[2]) > 0.9 ? Vec3(0, -1, 0) : Vec3(0, 0, 1);
      o.perspective = perspective;
      o.shaded = false;
      o.width = 200;
      o.height = 160;
      o.planes = 200;
      o.background = {0, 0, 0};
      o.appearance[1] = {{0, 0, 1}, 0.002};
      o.appearance[2] = {{1, 0, 0}, 0.5};
      const Canvas picture = VolumeRenderer(r, nullptr, o).draw(r.displacement);
      Eigen::Vector2d found(0, 0);
      double weight = 0;
      for (int y = 0; y < picture.height(); ++y)
        for (int x = 0; x < picture.width(); ++x) {
          found += picture.at(x, y)[0] * Eigen::Vector2d(x, y);
          weight += picture.at(x, y)[0];
        }
      ASSERT_GT(weight, 1000);
      found /= weight;
      // The camera as VolumeOptions says: the body's box in the middle, 5 % of room.
      const Bounds b = bounds_of(r);
      const Vec3 middle = (b.low + b.high) / 2, ahead = view.normalized();
      const Vec3 right = ahead.cross(o.up).normalized(), down = ahead.cross(right);
      double across = 0, along = 0, near = INFINITY;
      for (int corner = 0; corner < 8; ++corner) {
        Vec3 q;
        for (int d = 0; d < 3; ++d) q[d] = (corner_bit(corner, d) == 1 ? b.high[d] : b.low[d]) - middle[d];
        across = std::max(across, std::abs(right.dot(q)));
        along = std::max(along, std::abs(down.dot(q)));
        near = std::min(near, ahead.dot(q));
      }
      const double pixel = 2.1 * std::max(across / o.width, along / o.height);
      const Vec3 at = bead + field(bead) - middle;
      double zoom = 1;
      if (perspective > 0) {
        const double focal = pixel * o.height / 2 / std::tan(perspective / 2 * M_PI / 180);
        zoom = focal / (focal + ahead.dot(at) - near);
      }
      EXPECT_NEAR(found[0], (o.width - 1) / 2.0 + zoom * right.dot(at) / pixel, 1.5);
      EXPECT_NEAR(found[1], (o.height - 1) / 2.0 + zoom * down.dot(at) / pixel, 1.5);
    }
}

TEST(Volume, LightFallsFromTheUpperLeftAlsoOnABodyThatTurned) {
  const Lattice lattice = box({16, 16, 16}, {1, 1, 1});
  const Mat3 turn = Eigen::AngleAxisd(M_PI, Vec3(0, 1, 0)).toRotationMatrix();
  const Vec3 middle = Vec3::Constant(7.5);
  const Result r = displaced(lattice, 1, [&](const Vec3& x) -> Vec3 { return middle + turn * (x - middle) - x; });
  VolumeOptions o;
  o.view = {0.6, 1, -0.6};
  o.width = o.height = 120;
  o.appearance[lattice.segments.front().segment.label] = {{0.5, 0.5, 0.5}, 0.5};
  for (const bool turned : {false, true}) {
    const Canvas picture = VolumeRenderer(r, nullptr, o).draw(turned ? r.displacement : std::vector<Vec3>{});
    EXPECT_GT(picture.at(60, 30)[0], picture.at(90, 85)[0] + 20) << "the top is brighter than the side away from it";
  }
}

}  // namespace test_volume

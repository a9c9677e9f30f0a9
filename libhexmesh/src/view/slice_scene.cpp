// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>

#include "hexmesh/view/slice.h"

namespace hexmesh {
namespace {

constexpr Rgb held_color = {60, 140, 255}, moved_color = {255, 80, 40}, obstacle_color = {230, 60, 230},
              target_color = {255, 220, 40};

/// A square of some pixels.
void dot(Canvas& canvas, int column, int row, Rgb color) {
  constexpr int half = 1;
  for (int y = std::max(0, row - half); y <= std::min(canvas.height() - 1, row + half); ++y)
    for (int x = std::max(0, column - half); x <= std::min(canvas.width() - 1, column + half); ++x)
      canvas.at(x, y) = color;
}

/// Where the surfaces of obstacles cut the plane: pixels inside beside one outside.
void draw_obstacles(const std::vector<Obstacle>& obstacles, const Grid& frame, Canvas& canvas) {
  for (const Obstacle& o : obstacles) {
    const auto inside = [&](int column, int row) { return o.depth(frame.position(Vec3(column, row, 0))) < 0; };
    for (int row = 0; row + 1 < canvas.height(); ++row)
      for (int column = 0; column + 1 < canvas.width(); ++column)
        if (inside(column, row) != inside(column + 1, row) || inside(column, row) != inside(column, row + 1))
          dot(canvas, column, row, obstacle_color);
  }
}

}  // namespace

/// Where triangles of the target cut the plane.
void SliceRenderer::add_target(const Grid& f, Canvas& canvas) const {
  std::vector<Vec3> pixels;  // and the distance from the plane
  for (const Vec3& p : options_.target.points) pixels.push_back(f.continuous_index(p));
  const auto round = [](double x) { return static_cast<int>(std::lround(x)); };
  for (const auto& t : options_.target.triangles) {
    std::vector<Vec3> ends;
    for (std::size_t n = 0; n < 3; ++n) {
      const Vec3 &a = pixels[as_size(t[n])], &b = pixels[as_size(t[(n + 1) % 3])];
      if ((a[2] < 0) != (b[2] < 0)) ends.emplace_back(a + a[2] / (a[2] - b[2]) * (b - a));
    }
    const auto is_near = [](const Vec3& end) { return end.cwiseAbs().maxCoeff() < 1e5; };  // of pixels there are fewer
    if (ends.size() == 2 && is_near(ends[0]) && is_near(ends[1]))
      canvas.line(round(ends[0][0]), round(ends[0][1]), round(ends[1][0]), round(ends[1][1]), target_color);
  }
}

/// Points within a voxel of the plane; of those that are moved one arrow for each condition, from the middle of them.
void SliceRenderer::add_scene(const Grid& f, bool deformed, Canvas& canvas) const {
  const double near = result_.voxels.spacing().maxCoeff();
  const auto pixel = [&](const Vec3& x) -> std::pair<int, int> {
    const Vec3 index = f.continuous_index(x);
    return {static_cast<int>(std::lround(index[0])), static_cast<int>(std::lround(index[1]))};
  };
  if ((deformed || !options_.deformed) && options_.magnified == 1) draw_obstacles(options_.obstacles, f, canvas);
  for (const ConditionPoints& c : result_.conditions) {
    Vec3 middle = Vec3::Zero(), step = Vec3::Zero();
    double count = 0;
    const bool moves = options_.moved.contains(c.name);
    for (std::size_t p = 0; p < c.points.size(); ++p) {
      const Vec3 u = p < c.displacement.size() ? c.displacement[p] : Vec3(Vec3::Zero());
      const Vec3 at = deformed ? Vec3(c.points[p] + u) : c.points[p];
      if (std::abs((at - f.origin()).dot(f.direction().col(2))) > near) continue;
      const auto [column, row] = pixel(at);
      dot(canvas, column, row, moves ? moved_color : held_color);
      middle += c.points[p];
      step += u;
      ++count;
    }
    if (!moves || count == 0) continue;
    const auto [x0, y0] = pixel(middle / count);
    const auto [x1, y1] = pixel((middle + step) / count);
    canvas.arrow(x0, y0, x1, y1, moved_color);
  }
}

}  // namespace hexmesh

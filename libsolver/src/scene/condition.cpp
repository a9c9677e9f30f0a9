// SPDX-License-Identifier: Apache-2.0
#include <Eigen/Geometry>

#include "hexsolver/scene/scene.h"

namespace hexsolver {

Vec3 prescribed_displacement(const Condition& condition, const Vec3& rest, const Progress& progress) {
  if (!condition.turn)
    return condition.history ? condition.history->at(progress.time) : progress.fraction * condition.by;
  const Turn& turn = *condition.turn;
  const double angle = condition.history ? condition.history->at(progress.time)[0] : progress.fraction * turn.radians;
  const Vec3 arm = rest - turn.about;
  return Eigen::AngleAxisd(angle, turn.axis) * arm - arm;
}

}  // namespace hexsolver

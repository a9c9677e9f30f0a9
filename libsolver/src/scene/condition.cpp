// SPDX-License-Identifier: Apache-2.0
#include <Eigen/Geometry>

#include "hexsolver/scene/scene.h"

namespace hexsolver {
namespace {

/// Of a condition or an obstacle that turns [rad].
template <class Moved>
double angle_of(const Moved& moved, const Progress& progress) {
  return moved.history ? moved.history->at(progress.time)[0] : progress.fraction * moved.turn->radians;
}

/// Of one that does not [mm].
template <class Moved>
Vec3 shift_of(const Moved& moved, const Progress& progress) {
  return moved.history ? moved.history->at(progress.time) : Vec3(progress.fraction * moved.by);
}

}  // namespace

Vec3 prescribed_displacement(const Condition& condition, const Vec3& rest, const Progress& progress) {
  if (!condition.turn) return shift_of(condition, progress);
  const Vec3 arm = rest - condition.turn->about;
  return Eigen::AngleAxisd(angle_of(condition, progress), condition.turn->axis) * arm - arm;
}

Eigen::Isometry3d place_of(const Contact& contact, const Progress& progress) {
  Eigen::Isometry3d place = Eigen::Isometry3d::Identity();
  if (!contact.turn) {
    place.translation() = shift_of(contact, progress);
    return place;
  }
  const Vec3& about = contact.turn->about;
  place.linear() = Eigen::AngleAxisd(angle_of(contact, progress), contact.turn->axis).toRotationMatrix();
  place.translation() = about - place.linear() * about;
  return place;
}

}  // namespace hexsolver

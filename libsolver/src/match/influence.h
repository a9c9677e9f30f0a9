// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace hexsolver {

/// How hard a point is pulled over a distance d [mm]: like a spring up to `far`, by the same force beyond (Huber, Ann.
/// Math. Stat. 35 (1964) 73); or, to let go of what is far, by less and less there and by nothing from 2 far on
/// (Hampel, J. Am. Stat. Ass. 69 (1974) 383). A spring of the stiffness part(d) bounds the energy from above.
class Influence {
public:
  Influence(double far, bool lets_go) : far_(far), lets_go_(lets_go) {}

  double far() const { return far_; }
  bool ends_before(double distance) const { return distance >= 2 * far_; }
  /// Of a spring of stiffness 1 [mm^2].
  double energy(double d) const {
    if (d <= far_) return d * d / 2;
    if (!lets_go_) return far_ * (d - far_ / 2);
    return ends_before(d) ? far_ * far_ : 2 * far_ * d - d * d / 2 - far_ * far_;
  }
  /// Of the force of that spring.
  double part(double d) const {
    if (d <= far_) return 1;
    if (!lets_go_) return far_ / d;
    return ends_before(d) ? 0 : (2 * far_ - d) / d;
  }

private:
  double far_;
  bool lets_go_;
};

}  // namespace hexsolver

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "terms/term.h"

namespace hexsolver {

/// What acts on the body from outside, by a factor.
class Load : public Term {
public:
  virtual void set_factor(const Vec3& factor) = 0;    ///< of each component
  virtual Vec3 total(const NodeVector& u) const = 0;  ///< [N], as it acts now. @param u  of all nodes
};

}  // namespace hexsolver

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "cli/run_files.h"
#include "hexsolver/scene/scene.h"
#include "options.h"

namespace hextools {

/// A fit as a scene for hexsolve, and the surfaces that it names beside it.
class SceneWriter {
public:
  /// @throws Error{usage} for options that it cannot keep
  explicit SceneWriter(const FitOptions& o);

  /// @param base  what acts beside the targets, or nullptr
  void write(const Input* base, const std::vector<hexsolver::Match>& matches, RunFiles& files) const;

private:
  const FitOptions& o_;
};

}  // namespace hextools

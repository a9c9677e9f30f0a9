// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <vector>

#include "cli/run_files.h"
#include "hexmesh/lattice/lattice.h"
#include "hexsolver/scene/scene.h"
#include "options.h"

namespace hextools {

class SegmentReader;

/// What a body is to lie on now, as options name it.
class Targets {
public:
  /// Declares the inputs. All must outlive this.
  /// @throws Error{usage} for options that do not go together
  Targets(FitOptions& o, RunFiles& files, const Console& console);
  ~Targets();

  /// Reads them. @param segments  of the body
  /// @throws Error{input}, Error{usage}
  std::vector<hexsolver::Match> read(const std::vector<hexmesh::LatticeSegment>& segments) const;

  std::vector<const Input*> files() const;  ///< all that read() reads

private:
  std::string body_segment(const std::string& of_target, const std::vector<hexmesh::LatticeSegment>& segments) const;

  const FitOptions& o_;
  const Console& console_;
  std::vector<const Input*> surfaces_, landmarks_;
  std::unique_ptr<SegmentReader> segments_;
};

}  // namespace hextools

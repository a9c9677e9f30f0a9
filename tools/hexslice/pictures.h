// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "hexmesh/view/slice.h"
#include "plane_stacks.h"

namespace hextools {

/// Pictures in the output folder; all names are free before the first is taken.
class Pictures {
public:
  /// Makes the folder. @param names  of all pictures, in order
  /// @throws Error{output} where it cannot be made, or a picture exists without --force
  Pictures(const PlaneOptions& o, const CommonOptions& common, std::vector<std::string> names);

  void write(const std::string& name, const hexmesh::Canvas& picture) const;
  std::size_t size() const { return names_.size(); }

private:
  /// Pictures of an earlier, longer series of the same names, which --force replaces as a whole.
  void remove_older() const;
  std::string path(const std::string& name) const;

  const PlaneOptions& o_;
  const CommonOptions& common_;
  std::vector<std::string> names_;
};

}  // namespace hextools

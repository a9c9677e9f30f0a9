// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "cli/run_files.h"
#include "hexmesh/view/slice.h"

namespace hextools {

/// Pictures in the output folder, which appear together; all names are free before the first is drawn.
class Pictures {
public:
  /// @param names  of all pictures, in order
  /// @throws Error{output} where the folder cannot be made; as RunFiles::output
  Pictures(const std::string& folder, const std::vector<std::string>& names, RunFiles& files,
           const CommonOptions& common);

  void write(const std::string& name, const hexmesh::Canvas& picture) const;

  /// All of them appear.
  void commit(const Console& console);

private:
  /// Pictures of an earlier, longer series of the same names, which --force replaces as a whole.
  void remove_older() const;
  std::string path(const std::string& name) const;

  std::string folder_;
  RunFiles& files_;
  const CommonOptions& common_;
  std::vector<std::pair<std::string, Output*>> pictures_;
};

}  // namespace hextools

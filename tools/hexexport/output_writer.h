// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <functional>

#include "hexmesh/file/result_file.h"
#include "options.h"

namespace hextools {

/// Endings that the name of an output may have; the first is that of standard output.
using Endings = std::vector<std::string>;

namespace endings {
inline const Endings lattice = {".vtu", ".hdf"};
inline const Endings surface = {".vtp", ".stl", ".obj", ".ply"};
inline const Endings conditions = {".vtp"};
inline const Endings csv = {".csv"};
inline const Endings deck = {".inp"};
inline const Endings report = {".json", ".csv"};
inline const Endings html = {".html"};
inline const Endings volume = {".nrrd", ".nii.gz", ".nii"};
inline const Endings transform = {".h5", ".nrrd", ".nii.gz", ".nii", ".mha"};
}  // namespace endings

/// Writes files by the names that the user gave, each whole or not at all; nothing where a name is empty.
class OutputWriter {
public:
  OutputWriter(const ExportOptions& o, const CommonOptions& common, const Console& console)
      : o_(o), common_(common), console_(console) {}

  /// All names are good and free before the first file is written.
  /// @throws Error{usage} for an ending that the output does not have; as open_output
  void check_names() const;

  using Write = std::function<void(const std::filesystem::path&)>;
  void write(const std::string& name, const Endings& endings, const Write& write_file) const;

  /// Likewise; or of a name in .pvd a file of the first ending for each step of a motion, NAME/NAME_0000.vtu, ..., and
  /// NAME.pvd that lists them.
  /// @param path  of the result
  /// @throws Error{usage} for a name in .pvd if the result is no motion
  using WriteStep = std::function<void(const hexmesh::Result&, const std::filesystem::path&)>;
  void write_steps(const std::string& name, const Endings& endings, const hexmesh::Result& result,
                   const std::filesystem::path& path, const WriteStep& write_step) const;

private:
  void write_series(const std::string& name, const std::string& ending, const hexmesh::Result& result,
                    const std::filesystem::path& path, const WriteStep& write_step) const;

  const ExportOptions& o_;
  const CommonOptions& common_;
  const Console& console_;
};

}  // namespace hextools

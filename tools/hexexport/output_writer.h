// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <functional>
#include <map>

#include "cli/run_files.h"
#include "hexmesh/file/result_file.h"
#include "options.h"

namespace hextools {

/// Endings that the name of an output may have; the first is that of standard output.
using Endings = std::vector<std::string>;

namespace endings {
inline const Endings lattice = {".vtu", ".hdf"};
inline const Endings surface = {".vtp", ".stl", ".obj", ".ply"};
inline const Endings conditions = {".vtp"};
inline const Endings obstacles = {".vtp"};
inline const Endings csv = {".csv"};
inline const Endings deck = {".inp"};
inline const Endings report = {".json", ".csv"};
inline const Endings html = {".html"};
inline const Endings volume = {".nrrd", ".nii.gz", ".nii"};
inline const Endings transform = {".h5", ".nrrd", ".nii.gz", ".nii", ".mha"};
}  // namespace endings

/// Writes files by the names that the user gave; nothing where a name is empty. They appear together.
class OutputWriter {
public:
  /// All names are good and free before the first file is written.
  /// @param num_steps  of the motion; 0 = none
  /// @throws Error{usage} for an ending that the output does not have, or a name in .pvd if there is no motion; as
  ///         RunFiles::output
  OutputWriter(const ExportOptions& o, std::size_t num_steps, RunFiles& files, const CommonOptions& common);

  using Write = std::function<void(const std::filesystem::path&)>;
  void write(const std::string& name, const Write& write_file) const;

  using MakeText = std::function<std::string()>;
  void write_text(const std::string& name, const MakeText& make_text) const;

  /// Likewise; or of a name in .pvd a file of the first ending for each step of a motion, NAME/NAME_0000.vtu, ..., and
  /// NAME.pvd that lists them.
  /// @param path  of the result
  using WriteStep = std::function<void(const hexmesh::Result&, const std::filesystem::path&)>;
  void write_steps(const std::string& name, const hexmesh::Result& result, const std::filesystem::path& path,
                   const WriteStep& write_step) const;

  /// All of them appear.
  void commit(const Console& console);

private:
  /// NAME.pvd and the files that it lists.
  struct Series {
    std::filesystem::path folder;
    std::string stem, ending;
    std::vector<Output*> steps;

    std::string name_of(std::size_t step) const;
  };

  void declare(const std::string& name, const Endings& endings, Content content);
  void declare_series(const std::string& name, const Endings& endings, std::size_t num_steps);
  void remove_surplus(const Series& series) const;

  RunFiles& files_;
  const CommonOptions& common_;
  std::vector<std::string> names_;  ///< in their order
  std::map<std::string, Output*> outputs_;
  std::map<std::string, Series> series_;
};

}  // namespace hextools

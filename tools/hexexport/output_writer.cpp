// SPDX-License-Identifier: Apache-2.0
#include "output_writer.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "cli/result_steps.h"
#include "hexmesh/core/error.h"
#include "hexmesh/view/vtk_export.h"

namespace hextools {
namespace {

using hexmesh::Error;
using hexmesh::ErrorKind;

/// Those of an earlier, longer series of the name, which --force replaces as a whole.
void remove_surplus_pieces(const std::filesystem::path& folder, const std::string& stem, const std::string& ending,
                           std::size_t first) {
  for (std::size_t n = first;; ++n)
    if (!std::filesystem::remove(folder / fmt::format("{}_{:04}{}", stem, n, ending))) return;
}

/// The ending of a name, which the format is chosen by.
/// @throws Error{usage} if it is none of those
std::string ending_of(const std::string& name, const Endings& endings) {
  for (const std::string& e : endings)
    if (name.ends_with(e)) return e;
  throw Error(ErrorKind::usage,
              fmt::format("output '{}', expected a name that ends in {}", name, fmt::join(endings, ", ")));
}

}  // namespace

void OutputWriter::check_names() const {
  const auto check = [&](const std::string& name, const Endings& allowed) {
    if (name.empty()) return;
    if (name != "-") ending_of(name, allowed);
    open_output(name, "", common_, {o_.input, o_.scan, o_.grid});
  };
  const auto with_series = [](Endings all) {
    all.push_back(".pvd");
    return all;
  };
  check(o_.lattice, with_series(endings::lattice));
  check(o_.surface, with_series(endings::surface));
  check(o_.conditions, endings::conditions);
  check(o_.csv, endings::csv);
  check(o_.deck, endings::deck);
  check(o_.report, endings::report);
  check(o_.html, endings::html);
  for (const std::string& name : {o_.warped, o_.segmentation}) check(name, endings::volume);
  for (const std::string& name : {o_.transform, o_.transform_points}) check(name, endings::transform);
  if (!o_.grid.empty() && o_.grid != "fitted") hexmesh::InputFile(std::string(o_.grid));
}

void OutputWriter::write(const std::string& name, const Endings& endings, const Write& write_file) const {
  if (name.empty()) return;
  const std::string ending = name == "-" ? endings.front() : ending_of(name, endings);
  const auto file = open_output(name, ending, common_, {o_.input, o_.scan, o_.grid});
  write_file(file->path());
  file->commit();
  console_.note(fmt::format("wrote {}", name == "-" ? "standard output" : name));
}

void OutputWriter::write_steps(const std::string& name, const Endings& endings, const hexmesh::Result& result,
                               const std::filesystem::path& path, const WriteStep& write_step) const {
  if (!name.ends_with(".pvd"))
    return write(name, endings, [&](const std::filesystem::path& file) { write_step(result, file); });
  write_series(name, endings.front(), result, path, write_step);
  console_.note(fmt::format("wrote {} and {} files beside it", name, result.times.size()));
}

void OutputWriter::write_series(const std::string& name, const std::string& ending, const hexmesh::Result& result,
                                const std::filesystem::path& path, const WriteStep& write_step) const {
  if (result.times.empty())
    throw Error(ErrorKind::usage,
                fmt::format("output '{}', but the result is no motion, expected a name that ends in {}", name, ending));
  const std::filesystem::path list(name), folder = list.parent_path() / list.stem();
  const auto file = open_output(name, ".pvd", common_, {o_.input});
  std::error_code failed;
  std::filesystem::create_directories(folder, failed);
  if (failed) throw Error(ErrorKind::output, fmt::format("cannot make the folder '{}'", folder.string()));
  ResultSteps steps(path, result);
  std::vector<std::pair<double, std::string>> files;
  for (std::size_t n = 0; n < result.times.size(); ++n) {
    const std::string piece = fmt::format("{}_{:04}{}", list.stem().string(), n, ending);
    const auto out = open_output((folder / piece).string(), ending, common_, {o_.input});
    write_step(steps.at(n), out->path());
    out->commit();
    files.emplace_back(result.times[n], (list.stem() / piece).string());
  }
  hexmesh::write_pvd(files, file->path());
  file->commit();
  if (common_.force) remove_surplus_pieces(folder, list.stem().string(), ending, files.size());
}

}  // namespace hextools

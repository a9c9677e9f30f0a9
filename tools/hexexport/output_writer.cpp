// SPDX-License-Identifier: Apache-2.0
#include "output_writer.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "cli/result_steps.h"
#include "hexmesh/core/error.h"
#include "hexmesh/core/printable.h"
#include "hexmesh/view/vtk_export.h"

namespace hextools {
namespace {

using hexmesh::Error;
using hexmesh::ErrorKind;

/// The ending of a name, which the format is chosen by.
/// @throws Error{usage} if it is none of those
std::string ending_of(const std::string& name, const Endings& endings) {
  if (name == "-") return endings.front();
  for (const std::string& e : endings)
    if (name.ends_with(e)) return e;
  throw Error(ErrorKind::usage,
              fmt::format("output '{}', expected a name that ends in {}", name, fmt::join(endings, ", ")));
}

}  // namespace

OutputWriter::OutputWriter(const ExportOptions& o, std::size_t num_steps, RunFiles& files, const CommonOptions& common)
    : files_(files), common_(common) {
  declare_series(o.lattice, endings::lattice, num_steps);
  declare_series(o.surface, endings::surface, num_steps);
  declare(o.conditions, endings::conditions, Content::binary);
  declare(o.obstacles, endings::obstacles, Content::binary);
  declare(o.csv, endings::csv, Content::text);
  declare(o.deck, endings::deck, Content::text);
  declare(o.report, endings::report, Content::text);
  for (const std::string& name : {o.warped, o.segmentation}) declare(name, endings::volume, Content::binary);
  for (const std::string& name : {o.transform, o.transform_points}) declare(name, endings::transform, Content::binary);
  declare(o.html, endings::html, Content::text);
}

void OutputWriter::declare(const std::string& name, const Endings& endings, Content content) {
  if (name.empty()) return;
  outputs_[name] = &files_.output(name, content, ending_of(name, endings));
  names_.push_back(name);
}

std::string OutputWriter::Series::name_of(std::size_t step) const {
  return fmt::format("{}_{:04}{}", stem, step, ending);
}

void OutputWriter::declare_series(const std::string& name, const Endings& endings, std::size_t num_steps) {
  if (!name.ends_with(".pvd")) {
    Endings all = endings;
    all.push_back(".pvd");
    if (!name.empty()) ending_of(name, all);
    return declare(name, endings, Content::binary);
  }
  if (num_steps == 0)
    throw Error(ErrorKind::usage,
                fmt::format("output '{}', but the result is no motion, expected a name that ends in {}", name,
                            endings.front()));
  const std::filesystem::path list(name);
  Series series{list.parent_path() / list.stem(), list.stem().string(), endings.front(), {}};
  if (hexmesh::printable_line(series.stem) != series.stem)
    throw Error(ErrorKind::usage,
                fmt::format("output '{}' lists names, expected one of letters that XML can hold", name));
  declare(name, {".pvd"}, Content::text);
  files_.make_folder(series.folder.string());
  for (std::size_t n = 0; n < num_steps; ++n)
    series.steps.push_back(
        &files_.output((series.folder / series.name_of(n)).string(), Content::binary, series.ending));
  series_[name] = std::move(series);
}

void OutputWriter::write(const std::string& name, const Write& write_file) const {
  if (!name.empty()) write_file(outputs_.at(name)->path());
}

void OutputWriter::write_text(const std::string& name, const MakeText& make_text) const {
  if (!name.empty()) outputs_.at(name)->write(make_text());
}

void OutputWriter::write_steps(const std::string& name, const hexmesh::Result& result,
                               const std::filesystem::path& path, const WriteStep& write_step) const {
  const auto series = series_.find(name);
  if (series == series_.end()) return write(name, [&](const std::filesystem::path& file) { write_step(result, file); });
  ResultSteps steps(path, result);
  std::vector<std::pair<double, std::string>> list;
  for (std::size_t n = 0; n < result.times.size(); ++n) {
    write_step(steps.at(n), series->second.steps[n]->path());
    list.emplace_back(result.times[n],
                      (std::filesystem::path(series->second.stem) / series->second.name_of(n)).string());
  }
  hexmesh::write_pvd(list, outputs_.at(name)->path());
}

/// Files of an earlier, longer series of the name, which --force replaces as a whole.
void OutputWriter::remove_surplus(const Series& series) const {
  std::error_code failed;
  for (std::size_t n = series.steps.size();; ++n) {
    const std::filesystem::path file = series.folder / series.name_of(n);
    if (files_.is_input(file.string()) || !std::filesystem::remove(file, failed)) return;
  }
}

void OutputWriter::commit(const Console& console) {
  files_.commit();
  for (const std::string& name : names_) {
    const auto series = series_.find(name);
    if (series != series_.end() && common_.force) remove_surplus(series->second);
    console.note(fmt::format(
        "wrote {}{}", name == "-" ? "standard output" : name,
        series == series_.end() ? "" : fmt::format(" and {} files beside it", series->second.steps.size())));
  }
}

}  // namespace hextools

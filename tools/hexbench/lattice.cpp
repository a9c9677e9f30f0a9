// SPDX-License-Identifier: Apache-2.0
#include <cstring>
#include <nlohmann/json.hpp>

#include "cli/json_text.h"
#include "commands.h"
#include "hexmesh/file/lattice_file.h"
#include "hexmesh/lattice/element_tree.h"
#include "scene_options.h"
#include "statistics.h"

namespace hextools {
namespace {

using nlohmann::json;

/// Bytes read and written per second by memcpy of 256 MB.
double copy_bandwidth(int repeats) {
  constexpr std::size_t size = std::size_t{1} << 28;
  std::vector<char> from(size, 1), to(size);
  return 2.0 * size / median_seconds_of(repeats, [&] {
           std::memcpy(to.data(), from.data(), size);
           from[0] = to[size - 1];
         });
}

/// How fast the elements of all levels follow from the voxels, on one core.
json bench_lattice(const hexmesh::Lattice& lattice, int repeats) {
  double checksum = 0;
  std::size_t elements = 0;
  const double seconds = median_seconds_of(repeats, [&] {
    hexmesh::ElementTree tree(lattice);
    elements = 0;
    for (int l = 0; l < static_cast<int>(lattice.levels.size()); ++l) {
      const auto count = static_cast<std::int32_t>(lattice.levels[static_cast<std::size_t>(l)].filled.size());
      for (std::int32_t e = 0; e < count; ++e) checksum += tree.form(l, e).shear[0];
      elements += static_cast<std::size_t>(count);
    }
  });
  const auto voxels = static_cast<double>(lattice.levels.front().cells.size());
  json report = {{"voxels", voxels},
                 {"levels", lattice.levels.size()},
                 {"elements", elements},
                 {"seconds", seconds},
                 {"voxels_per_second", voxels / seconds},
                 {"copy_bytes_per_second", copy_bandwidth(repeats)},
                 {"checksum", checksum}};
  report["copied_bytes_per_voxel_time"] = report["copy_bytes_per_second"].get<double>() / (voxels / seconds);
  return report;
}

}  // namespace

std::function<int()> declare_lattice(CLI::App& app, const CommonOptions& common, const Console& /*console*/) {
  const auto o = std::make_shared<SceneOptions>();
  add_lattice(app, *o);
  add_repeats(app, o->repeats);
  add_report(app, o->output);
  return [o, &common] {
    RunFiles files(common);
    const Input& file = files.input(o->lattice);
    Output& output = files.output(o->output, Content::text);
    output.write(json_text(bench_lattice(hexmesh::read_lattice(file.path()), o->repeats)));
    files.commit();
    return 0;
  };
}

}  // namespace hextools

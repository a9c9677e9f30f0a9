// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "cli/run_files.h"
#include "hexmesh/scan/image_io.h"
#include "segments/segment_options.h"

namespace hextools {

/// What hexscan is asked for; its subcommands share the inputs, how they are read and the outputs.
struct ScanOptions : SegmentOptions {
  std::string intensity, intensity_output, output;
};

/// @returns nothing for an empty name
/// @throws Error{usage} for a name of another format than NRRD; as RunFiles::output
Output* volume_if_named(const std::string& name, RunFiles& files);

/// Say how many voxels each segment has.
void note_segments(const hexmesh::LabelVolume& volume, const Console& console);

/// The job without a subcommand: segmentations to one labelled volume. @returns as Declare does
std::function<int()> declare_conversion(CLI::App& app, const std::shared_ptr<ScanOptions>& o,
                                        const CommonOptions& common, const Console& console);

/// hexscan phantom
std::function<int()> declare_phantom(CLI::App& app, const std::shared_ptr<ScanOptions>& o, const CommonOptions& common,
                                     const Console& console);

/// hexscan info
std::function<int()> declare_info(CLI::App& app, const std::shared_ptr<ScanOptions>& o, const CommonOptions& common,
                                  const Console& console);

/// hexscan surface
std::function<int()> declare_surface(CLI::App& app, const CommonOptions& common, const Console& console);

}  // namespace hextools

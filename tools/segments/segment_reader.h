// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include "cli/run_files.h"
#include "segments/gather.h"
#include "segments/segment_options.h"

namespace hextools {

/// @throws Error{input} for a table of labels that cannot be read
/// @param names  of labels, or nullptr
hexmesh::ReadOptions read_options(const SegmentOptions& o, const Input* names, const Console& console);

/// Reads what SegmentOptions ask for.
class SegmentReader {
public:
  /// Declares the inputs. All must outlive this.
  /// @throws Error{usage} for options that do not go together; Error{input} as read_options()
  SegmentReader(const SegmentOptions& o, RunFiles& files, const Console& console);

  const hexmesh::ReadOptions& options() const { return read_; }

  /// The scan that segments are drawn on, as stored: where contours and sparse frames go.
  void set_reference(std::optional<hexmesh::Grid> reference) { read_.reference = std::move(reference); }

  /// One label per voxel, cut out and cleaned.
  /// @throws Error{usage}, Error{input}, Error{geometry}
  hexmesh::LabelVolume read() const;

  std::vector<const Input*> files() const;  ///< all that read() reads
  bool has_dicom() const;                   ///< which may go by the reference

private:
  const SegmentOptions& o_;
  const Console& console_;
  Sources sources_;
  const Input* roi_;
  const Input* names_;
  hexmesh::ReadOptions read_;
};

}  // namespace hextools

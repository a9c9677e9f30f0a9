// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/types.h>

#include <string>

namespace hextools {

/// What is the same for all names of a file: links, hard links, ./a and a, /dev/stdout and -. A file that is not there
/// yet is told by the folder it would lie in.
struct FileIdentity {
  enum class Kind { missing, file, folder, terminal, device, pipe };

  dev_t device = 0;
  ino_t node = 0;
  std::string rest;  ///< of the path below the folder, where the file is missing
  Kind kind = Kind::missing;

  /// Whether the same bytes are meant, so that one would lose what the other needs. A device such as /dev/null takes
  /// anything from anybody.
  bool collides_with(const FileIdentity& other) const;
};

/// @param name  of an input; "-" is standard input
FileIdentity identity_of_input(const std::string& name);

/// @param name  of an output; "-" is standard output
FileIdentity identity_of_output(const std::string& name);

/// Whether an input has a file as one of its parts: a DICOM file in its folder, or the data that its header names.
bool has_part(const std::string& input, const FileIdentity& file);

}  // namespace hextools

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <stdexcept>
#include <string>

namespace hexmesh {

/// What kind of mistake the caller or the data made; each kind has its own exit code in the tools.
enum class ErrorKind {
  usage,     ///< the command line: exit 2
  input,     ///< a file or its content: exit 3
  geometry,  ///< selections, supports, conflicts: exit 4
  output     ///< a result that cannot be written: exit 6
};

/// A mistake of the caller or the data. Mistakes of our own are asserts.
///
/// The message is one line: what is wrong, the offending value, what was expected.
class Error : public std::runtime_error {
public:
  Error(ErrorKind kind, const std::string& message) : std::runtime_error(message), kind_(kind) {}

  ErrorKind kind() const noexcept { return kind_; }

private:
  ErrorKind kind_;
};

}  // namespace hexmesh

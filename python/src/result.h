// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <memory>
#include <mutex>
#include <optional>
#include <vector>

#include "hexmesh/lattice/locator.h"
#include "hexmesh/result/result.h"

namespace hextools::python {

/// A result that Python has: solved here, or read from a file.
class Solution {
public:
  /// @param lattice  that labels and surface are taken from when they are asked for
  Solution(hexmesh::Result solved, std::vector<hexmesh::MotionStep> states,
           std::shared_ptr<const hexmesh::Lattice> lattice)
      : result(std::move(solved)), steps(std::move(states)), lattice_(std::move(lattice)) {}

  /// @param file  that states of a motion are read from when they are asked for
  Solution(hexmesh::Result read, std::filesystem::path file) : result(std::move(read)), file_(std::move(file)) {}

  hexmesh::Result result;                  ///< without labels and surface until whole()
  std::vector<hexmesh::MotionStep> steps;  ///< of Result::times

  /// With labels and surface. From any thread.
  hexmesh::Result& whole();

  const hexmesh::CellLocator& locator();  ///< likewise

  std::size_t num_steps() const;
  hexmesh::MotionStep step(std::size_t number) const;

private:
  std::shared_ptr<const hexmesh::Lattice> lattice_;
  std::filesystem::path file_;
  std::optional<hexmesh::CellLocator> locator_;
  std::mutex mutex_;
};

}  // namespace hextools::python

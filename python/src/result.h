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

  hexmesh::Result result;                  ///< without labels and surface until these are asked for
  std::vector<hexmesh::MotionStep> steps;  ///< of Result::times

  /// As files hold it: with labels, and a surface that does not follow from the voxels. From any thread.
  const hexmesh::Result& with_voxels();

  const hexmesh::Result& whole();  ///< with its surface too, likewise

  const hexmesh::CellLocator& locator();  ///< likewise

  std::size_t num_steps() const;
  hexmesh::MotionStep step(std::size_t number) const;

private:
  void take_voxels();  ///< @pre the mutex is held

  std::shared_ptr<const hexmesh::Lattice> lattice_;
  std::filesystem::path file_;
  std::optional<hexmesh::CellLocator> locator_;
  std::mutex mutex_;
};

}  // namespace hextools::python

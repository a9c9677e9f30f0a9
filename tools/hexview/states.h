// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>

#include "cli/result_steps.h"
#include "solver.h"

namespace hextools {

/// States of a body that can be shown, one at a time.
class States {
public:
  virtual ~States() = default;
  virtual const hexmesh::Result& now() const = 0;
  virtual double time() const = 0;          ///< of it [s]
  virtual std::size_t number() const = 0;   ///< of it
  virtual std::size_t count() const = 0;    ///< of those that can be gone to
  virtual void go_to(std::size_t /*n*/) {}  ///< @pre n < count()
  virtual std::vector<double> times() const { return {}; }
};

/// What a result file holds: an equilibrium, or the steps of a motion.
class StatesOfFile final : public States {
public:
  /// @throws Error{input}
  explicit StatesOfFile(std::filesystem::path path);

  const hexmesh::Result& now() const override { return *now_; }
  double time() const override { return result_.times.empty() ? 0 : result_.times[number_]; }
  std::size_t number() const override { return number_; }
  std::size_t count() const override { return std::max<std::size_t>(1, result_.times.size()); }
  void go_to(std::size_t n) override;
  std::vector<double> times() const override { return result_.times; }

private:
  std::filesystem::path path_;
  hexmesh::Result result_;
  std::optional<ResultSteps> steps_;  ///< of a motion
  const hexmesh::Result* now_ = &result_;
  std::size_t number_ = 0;
};

/// The newest state of a motion that is being solved.
class LiveStates final : public States {
public:
  /// @param at_rest  with its surface
  explicit LiveStates(hexmesh::Result at_rest);

  const hexmesh::Result& now() const override { return now_; }
  double time() const override { return time_; }
  std::size_t number() const override { return 0; }
  std::size_t count() const override { return 1; }

  /// @throws Error{output} for one of another body
  void take(const Frame& frame);

private:
  hexmesh::Result now_;
  hexmesh::EmbeddedPoints surface_;
  std::vector<double> nodal_;
  double time_ = 0;
};

}  // namespace hextools

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/types.h>

#include <optional>
#include <string>
#include <vector>

namespace hextools {

/// A state of a motion as it is streamed.
struct Frame {
  double time = 0;                  ///< [s]
  std::vector<float> displacement;  ///< (x, y, z) of each node [mm]
};

/// hexsolve, solving a motion under commands of ours: "Stream" and "Steering" in FORMATS.md.
class Solver {
public:
  /// Begins. @param arguments  of hexsolve, without those for the stream and commands
  /// @throws Error{output} where there is no hexsolve to run
  explicit Solver(std::vector<std::string> arguments);
  /// One that still runs is asked to end.
  ~Solver();
  Solver(const Solver&) = delete;
  Solver& operator=(const Solver&) = delete;

  /// The newest state that has come since the last one, if there is one.
  std::optional<Frame> newest();
  std::size_t num_frames() const { return num_frames_; }  ///< that have come
  bool has_ended() const { return frames_ < 0; }          ///< none will come any more

  /// @returns whether it was taken: what a full pipe refuses is old when there is room
  bool send(const std::string& command);
  void send_for(double time, const std::string& command);  ///< of the motion [s]

  /// Waits for its end, which it is asked for where it goes on. @returns its exit code
  int wait();

private:
  bool read_more();
  bool take_head();

  pid_t process_ = 0;
  int frames_ = -1, commands_ = -1;
  std::string bytes_;
  double time_ = 0, later_ = 0;  ///< of the newest frame; of the last command [s]
  std::size_t num_nodes_ = 0;    ///< 0: the head has not come
  std::size_t num_frames_ = 0;
};

/// Runs hexsolve to its end. @returns its exit code @throws Error{output} likewise
int run_hexsolve(std::vector<std::string> arguments);

}  // namespace hextools

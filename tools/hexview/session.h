// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>

#include "cli/interruption.h"
#include "cli/run_files.h"
#include "options.h"
#include "script.h"
#include "solver.h"
#include "states.h"
#include "window.h"

namespace hextools {

/// A window on states of a body, which a solver may be making.
class Session {
public:
  /// @param states    what is shown
  /// @param live      the same where a solver makes them; else null
  /// @param solver    likewise
  /// @param scan      of slices; may be null
  /// @param script    without what the solver carries out
  /// @param pictures  that a script takes, by name
  Session(const ViewOptions& options, std::unique_ptr<States> states, LiveStates* live, Solver* solver,
          const hexmesh::IntensityVolume* scan, std::deque<ScriptLine> script, std::map<std::string, Output*> pictures,
          const Console& console);

  /// Until the window is closed, the solver ends while a script runs, or a signal asks for it.
  void run();

  /// "412 pictures in 8 s, 51 a second; 400 states".
  std::string summary() const;
  std::size_t num_pictures() const { return window_.num_renders(); }
  int signal() const { return interruption_.signal(); }

private:
  using Clock = std::chrono::steady_clock;
  WindowActions actions();
  void turn();
  bool take_frame();
  void play();
  void go_to(std::size_t number);
  void key(char key);
  void next_color();
  void grab(std::size_t point, const hexmesh::Vec3& place);
  void follow_script();
  void obey(const ScriptLine& line);
  void send_hand();
  void end();
  std::string line() const;
  void count_pictures();

  const ViewOptions& options_;
  const Console& console_;
  std::unique_ptr<States> states_;
  LiveStates* live_;
  Solver* solver_;
  std::deque<ScriptLine> script_;
  std::map<std::string, Output*> pictures_;
  Interruption interruption_;
  Window window_;
  double reach_;  ///< of hands [mm]

  struct Hand {
    std::size_t point;
    hexmesh::Vec3 place;
  };
  std::optional<Hand> hand_;         ///< moved since it was sent
  std::array<int, 2> pressed_at_{};  ///< by a script [pixels]
  bool is_paused_ = false, plays_ = false, ends_ = false, needs_render_ = false, knows_end_ = false;
  Clock::time_point began_ = Clock::now(), counted_since_ = began_, last_step_ = began_;
  std::size_t counted_from_ = 0;
  double pictures_per_second_ = 0;
};

}  // namespace hextools

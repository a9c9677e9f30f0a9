// SPDX-License-Identifier: Apache-2.0
#include "session.h"

#include <fmt/format.h>
#include <vtkCommand.h>

#include <algorithm>

#include "cli/parse.h"
#include "cli/progress.h"
#include "cli/result_state.h"
#include "hexmesh/core/error.h"

namespace hextools {
namespace {

using hexmesh::Vec3;

constexpr double reach_of_size = 1.0 / 40, played_in = 4;  // s

double seconds_since(std::chrono::steady_clock::time_point then) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - then).count();
}

double size_of(const hexmesh::Result& result) {
  const hexmesh::Bounds bounds = hexmesh::bounds_of(result);
  return (bounds.high - bounds.low).norm();
}

}  // namespace

Session::Session(const ViewOptions& options, std::unique_ptr<States> states, LiveStates* live, Solver* solver,
                 const hexmesh::IntensityVolume* scan, std::deque<ScriptLine> script,
                 std::map<std::string, Output*> pictures, const Console& console)
    : options_(options),
      console_(console),
      states_(std::move(states)),
      live_(live),
      solver_(solver),
      script_(std::move(script)),
      pictures_(std::move(pictures)),
      window_(fmt::format("hexview {}", options.input), {options.size[0], options.size[1]}, states_->now(), scan,
              states_->times(), actions()),
      reach_(options.reach >= 0 ? options.reach : reach_of_size * size_of(states_->now())) {
  window_.show(states_->now(), states_->number());
  window_.color_by(options.color);
  if (options.slices) window_.show_slices(true, states_->now());
}

WindowActions Session::actions() {
  WindowActions out;
  if (solver_) {
    out.grab = [this](std::size_t point, const Vec3& place) { grab(point, place); };
    out.let_go = [this](std::size_t point) {
      send_hand();
      solver_->send(fmt::format("release {}", point));
    };
  }
  out.key = [this](char k) { key(k); };
  out.go_to = [this](std::size_t number) { go_to(number); };
  out.turn = [this] { turn(); };
  out.close = [this] { end(); };
  return out;
}

void Session::run() {
  at_work("");
  window_.run();
  end();
}

void Session::grab(std::size_t point, const Vec3& place) {
  hand_ = {point, place};
  needs_render_ = true;
}

/// The last of all places that the mouse was at since the last turn.
void Session::send_hand() {
  if (!hand_) return;
  solver_->send(fmt::format("grab {} {:.4f} {:.4f} {:.4f} {:.4f}", hand_->point, hand_->place[0], hand_->place[1],
                            hand_->place[2], reach_));
  hand_.reset();
}

void Session::end() {
  if (std::exchange(ends_, true)) return;
  window_.stop();
}

bool Session::take_frame() {
  if (!solver_) return false;
  const std::optional<Frame> frame = solver_->newest();
  if (!frame) return false;
  live_->take(*frame);
  return true;
}

void Session::go_to(std::size_t number) {
  states_->go_to(std::min(number, states_->count() - 1));
  window_.show(states_->now(), states_->number());
  needs_render_ = true;
}

/// The states of a file one after the other.
void Session::play() {
  if (!plays_ || states_->count() < 2) return;
  const double interval = played_in / static_cast<double>(states_->count());
  if (seconds_since(last_step_) < interval) return;
  last_step_ = Clock::now();
  go_to((states_->number() + 1) % states_->count());
}

void Session::turn() {
  if (ends_) return;
  if (interruption_.signal() != 0) return end();
  send_hand();
  play();
  if (take_frame()) {
    window_.show(states_->now(), states_->number());
    needs_render_ = true;
  }
  if (solver_ && solver_->has_ended() && !std::exchange(knows_end_, true)) {
    window_.body().hide_hand();
    needs_render_ = true;
  }
  follow_script();
  if (ends_) return;
  const bool waits_for_nothing = solver_ && solver_->has_ended() && script_.empty() && !options_.script.empty();
  const bool never_began = solver_ && solver_->has_ended() && solver_->num_frames() == 0;
  if (waits_for_nothing || never_began) return end();
  if (!std::exchange(needs_render_, false)) return;
  count_pictures();
  window_.say(line());
  window_.render();
}

void Session::count_pictures() {
  constexpr double interval = 0.5;
  const double seconds = seconds_since(counted_since_);
  if (seconds < interval) return;
  pictures_per_second_ = static_cast<double>(window_.num_renders() - counted_from_) / seconds;
  counted_from_ = window_.num_renders();
  counted_since_ = Clock::now();
}

std::string Session::line() const {
  if (!solver_) {
    if (states_->count() > 1)
      return fmt::format("{:.4g} s, state {} of {}", states_->time(), states_->number() + 1, states_->count());
    return state_note(states_->now());
  }
  std::string out = fmt::format("{:.2f} s", states_->time());
  if (is_paused_) out += ", paused";
  if (solver_->has_ended()) out += ", the solver has ended";
  if (pictures_per_second_ > 0) out += fmt::format(", {:.0f} pictures a second", pictures_per_second_);
  return out;
}

void Session::next_color() {
  std::vector<std::string> fields = {"segment", "displacement"};
  for (const auto& [name, values] : states_->now().cell_fields) fields.push_back(name);
  const auto now = std::find(fields.begin(), fields.end(), window_.body().field());
  const auto next = now == fields.end() || now + 1 == fields.end() ? fields.begin() : now + 1;
  window_.color_by(*next);
}

void Session::key(char key) {
  switch (key) {
    case ' ':
      if (solver_) {
        is_paused_ = !is_paused_;
        solver_->send(is_paused_ ? "pause" : "resume");
      } else {
        plays_ = !plays_;
      }
      break;
    case 's':
      window_.show_slices(!window_.shows_slices(), states_->now());
      break;
    case 'c':
      next_color();
      break;
    case ',':
      if (states_->number() > 0) go_to(states_->number() - 1);
      break;
    case '.':
      go_to(states_->number() + 1);
      break;
    default:
      return;
  }
  needs_render_ = true;
}

void Session::follow_script() {
  while (!script_.empty() && !ends_) {
    const ScriptLine& next = script_.front();
    const bool is_to_come = solver_ && !solver_->has_ended();
    if (is_to_come && (solver_->num_frames() == 0 || states_->time() < next.time.value_or(0))) return;
    if (!solver_ && next.time) {
      const std::vector<double> times = states_->times();
      go_to(static_cast<std::size_t>(std::lower_bound(times.begin(), times.end(), *next.time) - times.begin()));
    }
    obey(next);
    script_.pop_front();
  }
}

void Session::obey(const ScriptLine& line) {
  const std::string& verb = line.words[0];
  const auto number = [&](std::size_t n) { return static_cast<int>(parse_number<double>(line.words[n]).value_or(0)); };
  if (verb == "press") {
    const auto point = static_cast<std::size_t>(std::max(0, number(1)));
    if (point >= states_->now().surface.points.size())
      throw hexmesh::Error(hexmesh::ErrorKind::input,
                           fmt::format("{}:{}: press is of point {}, expected 0 to {}", options_.script, line.number,
                                       line.words[1], states_->now().surface.points.size() - 1));
    window_.render();
    pressed_at_ = window_.pixel_of(point);
    window_.mouse(vtkCommand::LeftButtonPressEvent, pressed_at_[0], pressed_at_[1]);
    if (solver_ && !hand_)
      console_.warning(fmt::format("{}:{}: point {} is hidden or outside of the window: the view is turned",
                                   options_.script, line.number, line.words[1]));
  } else if (verb == "drag") {
    window_.mouse(vtkCommand::MouseMoveEvent, pressed_at_[0] + number(1), pressed_at_[1] + number(2));
    send_hand();
  } else if (verb == "lift") {
    window_.mouse(vtkCommand::LeftButtonReleaseEvent, pressed_at_[0], pressed_at_[1]);
  } else if (verb == "key") {
    window_.press(line.words[1] == "space" ? ' ' : line.words[1][0]);
  } else if (verb == "picture") {
    window_.say(this->line());
    window_.picture().write_png(pictures_.at(line.words[1])->path());
  } else if (verb == "close") {
    end();
  }
}

std::string Session::summary() const {
  const double seconds = seconds_since(began_);
  std::string out = fmt::format("{} pictures in {:.3g} s, {:.3g} a second", window_.num_renders(), seconds,
                                static_cast<double>(window_.num_renders()) / seconds);
  if (solver_)
    out += fmt::format("; {} states came, {:.3g} a second", solver_->num_frames(),
                       static_cast<double>(solver_->num_frames()) / seconds);
  return out;
}

}  // namespace hextools

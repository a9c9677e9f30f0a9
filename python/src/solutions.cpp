// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include "arrays.h"
#include "bindings.h"
#include "call.h"
#include "cli/json_text.h"
#include "hexmesh/core/error.h"
#include "hexmesh/core/interruption.h"
#include "hexmesh/file/atomic_file.h"
#include "hexsolver/dynamics/motion.h"
#include "hexsolver/equilibrium/equilibrium.h"
#include "hexsolver/plan/plan.h"
#include "hexsolver/scene/scene_files.h"
#include "report/solution_json.h"
#include "report/solve_work.h"
#include "result.h"

namespace hextools::python {
namespace {

using hexmesh::Lattice;
using hexsolver::Scene;
using hexsolver::SolveReport;

Scene read_scene(const std::filesystem::path& path) {
  const FileLock files;
  const hexmesh::InputFile file(file_name(path), hexmesh::most_text_bytes);
  return hexsolver::read_scene(file.path(), path.string());
}

Scene parse_scene(const Text& scene, const std::filesystem::path& folder) {
  const FileLock files;
  const auto& [text, name, has_places] = scene;
  return hexsolver::parse_scene(text, name, folder, has_places);
}

hexsolver::Request request_of(const py::dict& asked) {
  const auto number = [&](const char* key) { return asked[key].cast<std::optional<double>>(); };
  return {asked["level"].cast<std::optional<int>>(), asked["coarser_by"].cast<std::optional<int>>(), number("accuracy"),
          number("reaction_accuracy"), number("budget")};
}

/// A lattice under a scene as a call asks for it.
class Task {
public:
  Task(std::shared_ptr<const Lattice> lattice, Scene scene, const hexsolver::Request& request)
      : scene_(std::move(scene)), lattice_(std::move(lattice)) {
    apply(request, scene_);
    if (!scene_.materials.empty())
      lattice_ = std::make_shared<const Lattice>(hexsolver::with_overrides(*lattice_, scene_));
    level_ = hexsolver::finest_level(scene_, *lattice_);
  }

  /// Before a solution. @returns a line on what saving memory costs; empty: nothing
  std::string fit_into_memory() {
    std::string note;
    level_ = hexsolver::fit_into_memory(*lattice_, level_, scene_, note);
    return note;
  }

  const Lattice& lattice() const { return *lattice_; }
  const Scene& scene() const { return scene_; }
  int level() const { return level_; }

private:
  Scene scene_;
  std::shared_ptr<const Lattice> lattice_;  ///< with the scene's materials
  int level_ = 0;
};

/// Why a solution is not what was asked for, as hexsolve says it; empty: it is.
std::string shortfall(const SolveReport& report) {
  if (report.accuracy_missed) return "accuracy not reached: " + report.reason;
  return report.converged ? "" : "not converged: " + report.reason;
}

/// Calls progress(what) with the interpreter.
hexsolver::SolveProgress teller(const py::object& progress, const Task& task) {
  if (progress.is_none()) return {};
  return [&progress, work = work_of(task.lattice(), task.scene(), task.level())](int level, double load, int step,
                                                                                 double residual, int linear) {
    const py::gil_scoped_acquire held;
    progress(py::dict(py::arg("level") = level, py::arg("load") = load, py::arg("step") = step,
                      py::arg("residual") = residual, py::arg("linear_iterations") = linear,
                      py::arg("part") = part_done(work, level, load, residual)));
  };
}

/// A motion, of which all states that are kept are in memory.
/// @param steps  gets these
hexsolver::Outcome solve_motion(const Task& task, const py::object& progress, std::vector<hexmesh::MotionStep>& steps) {
  std::vector<double> times;
  const double duration = task.scene().dynamics->duration;
  const auto keep = [&](const hexsolver::Motion& motion) {
    times.push_back(motion.time());
    steps.push_back(motion.state());
  };
  const auto show = [&](const hexsolver::Motion& motion) {
    hexmesh::interruption_point();
    if (progress.is_none()) return;
    const py::gil_scoped_acquire held;
    progress(py::dict(py::arg("level") = task.level(), py::arg("time") = motion.time(),
                      py::arg("step") = motion.counts().steps, py::arg("part") = motion.time() / duration));
  };
  hexsolver::Outcome out = hexsolver::solve_dynamics(task.lattice(), task.scene(), task.level(), keep, show);
  out.result.times = std::move(times);
  return out;
}

py::tuple solve(std::shared_ptr<Lattice> lattice, const Scene& scene, const py::dict& asked, const py::object& progress,
                const std::vector<std::string>& history) {
  const hexsolver::Request request = request_of(asked);
  std::optional<hexsolver::Outcome> solved;
  std::vector<hexmesh::MotionStep> steps;
  std::vector<std::string> warnings = scene.warnings;
  std::string missing;
  {
    const WithoutInterpreter call;
    Task task(lattice, scene, request);
    if (const std::string note = task.fit_into_memory(); !note.empty()) warnings.push_back(note);
    if (task.scene().dynamics)
      solved = solve_motion(task, progress, steps);
    else
      solved = hexsolver::solve_equilibrium(task.lattice(), task.scene(), task.level(), teller(progress, task));
    auto& [result, report] = *solved;
    result.report = json_line(to_json(report, task.scene()));
    result.costs = json_line(costs_of(report, 0));
    result.history = lattice->history;
    result.history.insert(result.history.end(), history.begin(), history.end());
    warnings.insert(warnings.end(), report.warnings.begin(), report.warnings.end());
    missing = shortfall(report);
  }
  return py::make_tuple(std::make_shared<Solution>(std::move(solved->result), std::move(steps), std::move(lattice)),
                        warnings, missing);
}

/// What look(lattice, scene, level) tells of a lattice under a scene without solving it.
template <class Look>
py::object tell(std::shared_ptr<Lattice> lattice, const Scene& scene, const py::dict& asked, const Look& look) {
  const hexsolver::Request request = request_of(asked);
  std::string text;
  {
    const WithoutInterpreter call;
    const Task task(std::move(lattice), scene, request);
    text = json_line(to_json(look(task.lattice(), task.scene(), task.level())));
  }
  return from_json(text);
}

py::object check(std::shared_ptr<Lattice> lattice, const Scene& scene, const py::dict& asked) {
  return tell(std::move(lattice), scene, asked, [](const auto&... of) { return hexsolver::check_scene(of...); });
}

py::object plan(std::shared_ptr<Lattice> lattice, const Scene& scene, const py::dict& asked) {
  return tell(std::move(lattice), scene, asked, [](const auto&... of) { return hexsolver::plan_solution(of...); });
}

/// A motion that Python takes step by step.
class MotionByStep {
public:
  MotionByStep(std::shared_ptr<Lattice> lattice, const Scene& scene, const py::dict& asked)
      : task_(std::move(lattice), scene, request_of(asked)) {
    if (!task_.scene().dynamics)
      throw hexmesh::Error(hexmesh::ErrorKind::input,
                           "the scene is an equilibrium, expected solve.kind = \"dynamics\" and [dynamics]");
    warnings_ = scene.warnings;
    const FileLock files;  // it may start from a result
    const WithoutInterpreter call;
    if (const std::string note = task_.fit_into_memory(); !note.empty()) warnings_.push_back(note);
    motion_.emplace(task_.lattice(), task_.scene(), task_.level());
    const std::vector<std::string> found = motion_->check();
    warnings_.insert(warnings_.end(), found.begin(), found.end());
  }

  /// One step, and what f(motion) tells of the state after it; nothing where the motion is at its end or the step
  /// cannot be solved.
  template <class F>
  auto step(const F& f) {
    const WithoutInterpreter call;
    const std::scoped_lock lock(mutex_);
    std::optional<std::invoke_result_t<F, const hexsolver::Motion&>> state;
    if (motion_->counts().steps < num_steps() && motion_->step()) state = f(*motion_);
    return state;
  }

  /// f(motion), not while another thread takes a step.
  template <class F>
  auto look(const F& f) {
    const WithoutInterpreter call;
    const std::scoped_lock lock(mutex_);
    return f(*motion_);
  }

  const Lattice& lattice() const { return task_.lattice(); }
  int level() const { return task_.level(); }
  int num_steps() const { return task_.scene().dynamics->num_steps(); }
  const std::vector<std::string>& warnings() const { return warnings_; }

private:
  Task task_;
  std::optional<hexsolver::Motion> motion_;
  std::vector<std::string> warnings_;
  std::mutex mutex_;
};

std::vector<Vec3> rows_of(const hexsolver::NodeVector& values) {
  std::vector<Vec3> out(static_cast<std::size_t>(values.size() / 3));
  for (std::size_t n = 0; n < out.size(); ++n) out[n] = values.segment<3>(3 * static_cast<Eigen::Index>(n));
  return out;
}

py::array nodes_of(MotionByStep& motion) {
  return copy_of(
      motion.look([&](const hexsolver::Motion&) { return node_positions(motion.lattice(), motion.level()); }));
}

struct State {
  double time = 0, work = 0;
  std::vector<Vec3> displacement, velocity;
  hexsolver::Energies energies;
  Vec3 momentum;
  std::vector<hexsolver::ContactReport> contacts;
};

State state_of(const hexsolver::Motion& m) {
  return {m.time(),     m.work(),    rows_of(m.displacement()), rows_of(m.velocity()), m.energies(),
          m.momentum(), m.contacts()};
}

/// In arrays of its own.
py::dict to_dict(State s) {
  const py::dict energies(py::arg("kinetic") = s.energies.kinetic, py::arg("strain") = s.energies.strain,
                          py::arg("contact") = s.energies.contact, py::arg("loads") = s.energies.loads);
  return py::dict(py::arg("time") = s.time, py::arg("displacement") = copy_of(std::move(s.displacement)),
                  py::arg("velocity") = copy_of(std::move(s.velocity)), py::arg("energies") = energies,
                  py::arg("work") = s.work, py::arg("momentum") = vector_tuple(s.momentum),
                  py::arg("contacts") = from_json(json_line(to_json(s.contacts))));
}

/// None as MotionByStep::step() has nothing.
py::object step(MotionByStep& motion) {
  std::optional<State> state = motion.step(&state_of);
  return state ? py::object(to_dict(std::move(*state))) : py::none();
}

}  // namespace

void bind_solutions(py::module_& module) {
  py::class_<Scene>(module, "Scene")
      .def_readonly("warnings", &Scene::warnings)
      .def_property_readonly("files", [](const Scene& scene) { return hexsolver::files_of(scene); })
      .def_property_readonly("is_motion", [](const Scene& scene) { return scene.dynamics.has_value(); });
  module.def("read_scene", &read_scene);
  module.def("parse_scene", &parse_scene);
  module.def("example_scene", [](const Lattice& lattice) { return hexsolver::example_scene(lattice); });
  module.def("solve", &solve);
  module.def("check", &check);
  module.def("plan", &plan);
  py::class_<MotionByStep>(module, "Motion")
      .def(py::init<std::shared_ptr<Lattice>, const Scene&, const py::dict&>())
      .def("step", &step)
      .def("state", [](MotionByStep& m) { return to_dict(m.look(&state_of)); })
      .def("steps", [](MotionByStep& m) { return m.look([](const auto& motion) { return motion.counts().steps; }); })
      .def("reason", [](MotionByStep& m) { return m.look([](const auto& motion) { return motion.reason(); }); })
      .def_property_readonly("num_steps", &MotionByStep::num_steps)
      .def_property_readonly("warnings", &MotionByStep::warnings)
      .def_property_readonly("nodes", &nodes_of);
}

}  // namespace hextools::python

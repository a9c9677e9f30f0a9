// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vtkNew.h>
#include <vtkRenderWindow.h>
#include <vtkRenderWindowInteractor.h>
#include <vtkRenderer.h>
#include <vtkSliderWidget.h>
#include <vtkTextActor.h>

#include <array>
#include <chrono>
#include <functional>
#include <memory>
#include <optional>

#include "body_view.h"
#include "slice_view.h"

namespace hextools {

/// What a user does in a window.
struct WindowActions {
  std::function<void(std::size_t point, const hexmesh::Vec3& place)> grab;  ///< or move on; empty: nothing is grabbed
  std::function<void(std::size_t point)> let_go;
  std::function<void(char key)> key;              ///< that the window has no use for itself
  std::function<void(std::size_t number)> go_to;  ///< a state
  std::function<void()> turn;                     ///< called many times a second
  std::function<void()> close;
};

/// The window: the body on the left, slices of it beside it where they are shown, a slider of time below.
class Window {
public:
  /// @param result  with its surface
  /// @param scan    of the slices; may be null; must outlive this
  /// @param times   of the states that can be gone to
  /// @pre expect_display()
  Window(const std::string& title, std::array<int, 2> size, const hexmesh::Result& result,
         const hexmesh::IntensityVolume* scan, const std::vector<double>& times, WindowActions actions);
  ~Window();

  void run();   ///< until it is closed
  void stop();  ///< run() ends

  BodyView& body() { return *body_; }
  void show(const hexmesh::Result& now, std::size_t number);
  void color_by(const std::string& field);  ///< see BodyView
  void show_slices(bool shown, const hexmesh::Result& now);
  bool shows_slices() const { return shows_slices_; }
  void say(const std::string& line);  ///< at the upper border
  void render();
  std::size_t num_renders() const { return num_renders_; }

  /// The view from a direction in patient space.
  void look(const hexmesh::Vec3& direction, const hexmesh::Vec3& up);

  /// As the user does it, for scripts. @param event  of vtkCommand @param x, y  pixels from the lower left
  void mouse(unsigned long event, int x, int y);
  void press(char key);
  hexmesh::Canvas picture();
  /// Where a point of the surface is seen [pixels].
  std::array<int, 2> pixel_of(std::size_t point) const;

private:
  class Style;
  void lay_out();
  void add_slider(const std::vector<double>& times);
  void draw_slices(const hexmesh::Result& now);

  WindowActions actions_;
  vtkNew<vtkRenderWindow> window_;
  vtkNew<vtkRenderWindowInteractor> interactor_;
  vtkNew<vtkRenderer> renderer_;
  vtkNew<vtkTextActor> line_, help_;
  vtkNew<vtkSliderWidget> slider_;
  std::unique_ptr<BodyView> body_;
  std::vector<std::unique_ptr<SliceView>> slices_;
  const hexmesh::Result* shown_ = nullptr;
  bool is_live_;  ///< states come as they are solved
  bool shows_slices_ = false, is_open_ = true;
  std::size_t num_renders_ = 0;
  std::chrono::steady_clock::time_point slices_due_;
};

}  // namespace hextools

// SPDX-License-Identifier: Apache-2.0
#include "window.h"

#include <fmt/format.h>
#include <vtkCallbackCommand.h>
#include <vtkCamera.h>
#include <vtkInteractorStyleTrackballCamera.h>
#include <vtkObjectFactory.h>
#include <vtkProperty2D.h>
#include <vtkSliderRepresentation2D.h>
#include <vtkTextProperty.h>
#include <vtkUnsignedCharArray.h>

namespace hextools {
namespace {

using hexmesh::Vec3;

constexpr int turn_ms = 10;

/// A place as the screen has it: pixels and depth.
Vec3 on_screen(vtkRenderer& renderer, const Vec3& place) {
  renderer.SetWorldPoint(place[0], place[1], place[2], 1);
  renderer.WorldToDisplay();
  const double* out = renderer.GetDisplayPoint();
  return {out[0], out[1], out[2]};
}

Vec3 from_screen(vtkRenderer& renderer, const Vec3& pixel) {
  renderer.SetDisplayPoint(pixel[0], pixel[1], pixel[2]);
  renderer.DisplayToWorld();
  const double* out = renderer.GetWorldPoint();
  return Vec3(out[0], out[1], out[2]) / out[3];
}

template <class F>
void on_event(vtkObject& object, unsigned long event, F* function) {
  vtkNew<vtkCallbackCommand> command;
  command->SetClientData(function);
  command->SetCallback(
      [](vtkObject* /*caller*/, unsigned long /*event*/, void* f, void* /*data*/) { (*static_cast<F*>(f))(); });
  object.AddObserver(event, command);
}

}  // namespace

/// The left button takes hold of the body, beside it or with Shift or Ctrl it turns the view; the wheel zooms, over a
/// slice it goes through the planes.
class Window::Style final : public vtkInteractorStyleTrackballCamera {
public:
  static Style* New();
  vtkTypeMacro(Style, vtkInteractorStyleTrackballCamera)

      Window* window = nullptr;

  void OnLeftButtonDown() override {
    const auto [x, y] = at();
    if (slice_at(x, y)) return;
    const bool turns = Interactor->GetShiftKey() != 0 || Interactor->GetControlKey() != 0;
    const auto hit = window->actions_.grab && !turns ? window->body_->pick(x, y) : std::nullopt;
    if (!hit) return vtkInteractorStyleTrackballCamera::OnLeftButtonDown();
    held_ = hit->point;
    under_mouse_ = hit->place;
    from_hit_ = window->body_->place(*held_) - hit->place;
    OnMouseMove();
  }
  void OnMouseMove() override {
    const auto [x, y] = at();
    if (!held_) return vtkInteractorStyleTrackballCamera::OnMouseMove();
    // As far from the camera as it was: what a depth means changes with what there is to draw.
    const double depth = on_screen(*window->renderer_, under_mouse_)[2];
    under_mouse_ = from_screen(*window->renderer_, {double(x), double(y), depth});
    const Vec3 hand = from_hit_ + under_mouse_;
    window->actions_.grab(*held_, hand);
    window->body_->show_hand(*held_, hand);
  }
  void OnLeftButtonUp() override {
    if (!held_) return vtkInteractorStyleTrackballCamera::OnLeftButtonUp();
    window->actions_.let_go(*std::exchange(held_, {}));
    window->body_->hide_hand();
    window->render();
  }
  void OnMouseWheelForward() override { wheel(1); }
  void OnMouseWheelBackward() override { wheel(-1); }
  void OnChar() override {
    const char key = Interactor->GetKeyCode();
    if (key == 'r') {
      window->renderer_->ResetCamera();
      window->render();
    } else if (key == 'q') {
      window->actions_.close();
    } else {
      window->actions_.key(key);
    }
  }
  /// Not an observer of the window's: while the view is turned the style alone gets its events.
  void OnTimer() override { window->actions_.turn(); }
  void OnKeyPress() override {}
  void OnKeyDown() override {}

private:
  std::array<int, 2> at() const { return {Interactor->GetEventPosition()[0], Interactor->GetEventPosition()[1]}; }
  SliceView* slice_at(int x, int y) {
    vtkRenderer* poked = Interactor->FindPokedRenderer(x, y);
    for (const auto& slice : window->slices_)
      if (&slice->renderer() == poked && window->shows_slices_) return slice.get();
    return nullptr;
  }
  void wheel(int steps) {
    const auto [x, y] = at();
    if (SliceView* slice = slice_at(x, y)) {
      slice->move(steps);
      window->draw_slices(*window->shown_);
      return window->render();
    }
    if (steps > 0) return vtkInteractorStyleTrackballCamera::OnMouseWheelForward();
    vtkInteractorStyleTrackballCamera::OnMouseWheelBackward();
  }

  std::optional<std::size_t> held_;
  Vec3 under_mouse_ = Vec3::Zero();  ///< of what is held [mm]
  Vec3 from_hit_ = Vec3::Zero();
};

vtkStandardNewMacro(Window::Style);

Window::Window(const std::string& title, std::array<int, 2> size, const hexmesh::Result& result,
               const hexmesh::IntensityVolume* scan, const std::vector<double>& times, WindowActions actions)
    : actions_(std::move(actions)), shown_(&result), is_live_(actions_.grab != nullptr) {
  window_->SetWindowName(title.c_str());
  window_->SetSize(size[0], size[1]);
  window_->SetMultiSamples(0);
  renderer_->SetBackground(0.13, 0.14, 0.17);
  window_->AddRenderer(renderer_);
  for (const auto axis : {hexmesh::SliceAxis::axial, hexmesh::SliceAxis::coronal, hexmesh::SliceAxis::sagittal}) {
    slices_.push_back(std::make_unique<SliceView>(axis, result, scan));
    window_->AddRenderer(&slices_.back()->renderer());
  }
  body_ = std::make_unique<BodyView>(result, *renderer_);
  lay_out();

  for (const auto& [text, place] : {std::pair(line_.Get(), 0.97), {help_.Get(), 0.01}}) {
    text->GetTextProperty()->SetFontSize(14);
    text->GetPositionCoordinate()->SetCoordinateSystemToNormalizedViewport();
    text->SetPosition(0.01, place);
    renderer_->AddViewProp(text);
  }
  line_->GetTextProperty()->SetVerticalJustificationToTop();
  help_->GetTextProperty()->SetColor(0.7, 0.7, 0.7);
  help_->SetInput(actions_.grab ? "drag the body: pull it   drag beside it: turn   wheel: zoom\n"
                                  "space: pause   s: slices   c: colours   r: whole body   q: end"
                                : "drag: turn   wheel: zoom   space: play   , and .: step\n"
                                  "s: slices   c: colours   r: whole body   q: end");

  interactor_->SetRenderWindow(window_);
  vtkNew<Style> style;
  style->window = this;
  style->SetDefaultRenderer(nullptr);
  interactor_->SetInteractorStyle(style);
  on_event(*interactor_, vtkCommand::ExitEvent, &actions_.close);
  interactor_->Initialize();
  look({0.3, 1, -0.35}, {0, 0, 1});
  if (times.size() > 1) add_slider(times);
  interactor_->CreateRepeatingTimer(turn_ms);
}

Window::~Window() = default;

void Window::add_slider(const std::vector<double>& times) {
  vtkNew<vtkSliderRepresentation2D> bar;
  bar->SetMinimumValue(0);
  bar->SetMaximumValue(static_cast<double>(times.size() - 1));
  bar->GetPoint1Coordinate()->SetCoordinateSystemToNormalizedDisplay();
  bar->GetPoint2Coordinate()->SetCoordinateSystemToNormalizedDisplay();
  bar->SetSliderLength(0.02);
  bar->SetSliderWidth(0.02);
  bar->SetTubeWidth(0.004);
  bar->SetEndCapLength(0.005);
  bar->ShowSliderLabelOff();
  slider_->SetInteractor(interactor_);
  slider_->SetRepresentation(bar);
  lay_out();
  slider_->SetAnimationModeToJump();
  slider_->EnabledOn();
  vtkNew<vtkCallbackCommand> command;
  command->SetClientData(this);
  command->SetCallback([](vtkObject* /*caller*/, unsigned long /*event*/, void* window, void* /*data*/) {
    auto* self = static_cast<Window*>(window);
    self->actions_.go_to(static_cast<std::size_t>(std::lround(self->slider_->GetSliderRepresentation()->GetValue())));
  });
  slider_->AddObserver(vtkCommand::InteractionEvent, command);
}

/// The body alone, or with its slices to the right.
void Window::lay_out() {
  const double right = shows_slices_ ? 0.62 : 1;
  renderer_->SetViewport(0, 0, right, 1);
  for (std::size_t n = 0; n < slices_.size(); ++n) {
    vtkRenderer& slice = slices_[n]->renderer();
    slice.SetViewport(right, 1 - (static_cast<double>(n) + 1) / 3, 1, 1 - static_cast<double>(n) / 3);
    slice.SetDraw(shows_slices_);
  }
  if (auto* bar = dynamic_cast<vtkSliderRepresentation2D*>(slider_->GetRepresentation())) {
    bar->GetPoint1Coordinate()->SetValue(0.3 * right, 0.1);
    bar->GetPoint2Coordinate()->SetValue(0.7 * right, 0.1);
    bar->Modified();  // which its points are not told to do
  }
}

/// Slices take longer than the body: they get a third of the time.
void Window::draw_slices(const hexmesh::Result& now) {
  if (!shows_slices_) return;
  const auto begin = std::chrono::steady_clock::now();
  for (const auto& slice : slices_) {
    const int* pixels = slice->renderer().GetSize();
    slice->show(now, body_->field(), body_->colors(), {pixels[0], pixels[1]});
  }
  const auto end = std::chrono::steady_clock::now();
  slices_due_ = end + 2 * (end - begin);
}

void Window::show(const hexmesh::Result& now, std::size_t number) {
  shown_ = &now;
  body_->show(now);
  if (!is_live_ || std::chrono::steady_clock::now() >= slices_due_) draw_slices(now);
  if (slider_->GetEnabled() != 0) slider_->GetSliderRepresentation()->SetValue(static_cast<double>(number));
}

void Window::show_slices(bool shown, const hexmesh::Result& now) {
  shows_slices_ = shown;
  lay_out();
  draw_slices(now);
}

void Window::color_by(const std::string& field) {
  body_->color_by(field, *shown_);
  draw_slices(*shown_);
}

void Window::say(const std::string& line) { line_->SetInput(line.c_str()); }

void Window::render() {
  if (!is_open_) return;
  renderer_->ResetCameraClippingRange();
  window_->Render();
  ++num_renders_;
}

void Window::look(const Vec3& direction, const Vec3& up) {
  vtkCamera& camera = *renderer_->GetActiveCamera();
  const Vec3 from = -direction;
  camera.SetFocalPoint(0, 0, 0);
  camera.SetPosition(from.data());
  camera.SetViewUp(up.data());
  renderer_->ResetCamera();
}

void Window::run() {
  render();
  interactor_->Start();
  is_open_ = false;
}

void Window::stop() {
  is_open_ = false;
  interactor_->TerminateApp();
}

void Window::mouse(unsigned long event, int x, int y) {
  interactor_->SetEventInformation(x, y);
  interactor_->InvokeEvent(event);
}

void Window::press(char key) {
  interactor_->SetKeyCode(key);
  interactor_->InvokeEvent(vtkCommand::CharEvent);
}

std::array<int, 2> Window::pixel_of(std::size_t point) const {
  const Vec3 at = on_screen(*renderer_, body_->place(point));
  return {static_cast<int>(std::lround(at[0])), static_cast<int>(std::lround(at[1]))};
}

hexmesh::Canvas Window::picture() {
  draw_slices(*shown_);
  render();
  const int width = window_->GetSize()[0], height = window_->GetSize()[1];
  vtkNew<vtkUnsignedCharArray> pixels;
  window_->GetPixelData(0, 0, width - 1, height - 1, 1, pixels);
  hexmesh::Canvas out(width, height);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      const unsigned char* p = pixels->GetPointer(3 * (static_cast<vtkIdType>(height - 1 - y) * width + x));
      out.at(x, y) = {p[0], p[1], p[2]};
    }
  return out;
}

}  // namespace hextools

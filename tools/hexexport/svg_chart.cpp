// SPDX-License-Identifier: Apache-2.0
#include "svg_chart.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace hextools {
namespace {

constexpr double width = 560, height = 320, left = 70, right = 20, top = 16, bottom = 46;  // [px]
constexpr std::array<const char*, 5> colors = {"#0b5394", "#b45f06", "#38761d", "#741b47", "#444444"};
constexpr std::array<const char*, 5> dashes = {"", "6 3", "2 3", "8 3 2 3", "1 4"};

/// Maps values of one axis to pixels.
class Scale {
public:
  Scale(const ChartAxis& axis, std::vector<double> values, double from, double to)
      : logarithmic_(axis.logarithmic), from_(from), to_(to) {
    std::erase_if(values, [&](double v) { return !shows(v); });
    if (values.empty()) values = {1, 10};
    low_ = place(*std::min_element(values.begin(), values.end()));
    high_ = place(*std::max_element(values.begin(), values.end()));
    const double room = high_ > low_ ? 0.08 * (high_ - low_) : 0.5 * std::max(std::abs(high_), 1e-12);
    low_ -= room;
    high_ += room;
  }

  bool shows(double value) const { return std::isfinite(value) && (!logarithmic_ || value > 0); }
  double pixel(double value) const { return from_ + (to_ - from_) * (place(value) - low_) / (high_ - low_); }

  std::vector<double> ticks() const {
    std::vector<double> out;
    if (logarithmic_) {
      const std::vector<double> digits = high_ - low_ < 2.5 ? std::vector<double>{1, 2, 5} : std::vector<double>{1};
      for (double power = std::floor(low_); power <= high_; ++power)
        for (const double digit : digits)
          if (const double p = power + std::log10(digit); p >= low_ && p <= high_) out.push_back(std::pow(10, p));
      return out;
    }
    const double rough = (high_ - low_) / 6, power = std::pow(10, std::floor(std::log10(rough)));
    double step = 10 * power;
    for (const double digit : {5.0, 2.0, 1.0})
      if (digit * power >= rough) step = digit * power;
    constexpr int most = 32;  // of large values that are close to each other the next one may be the same
    const double first = std::ceil(low_ / step);
    for (int n = 0; n < most && (first + n) * step <= high_; ++n)
      out.push_back((first + n) * step + 0.0);  // -0 + 0 = 0
    return out;
  }

private:
  double place(double value) const { return logarithmic_ ? std::log10(value) : value; }

  bool logarithmic_;
  double from_, to_, low_ = 0, high_ = 1;
};

std::string marker(std::size_t series, double x, double y) {
  const char* color = colors[series % colors.size()];
  if (series % 2 == 0) return fmt::format("<circle cx='{:.1f}' cy='{:.1f}' r='3.5' fill='{}'/>", x, y, color);
  return fmt::format("<rect x='{:.1f}' y='{:.1f}' width='7' height='7' fill='{}'/>", x - 3.5, y - 3.5, color);
}

}  // namespace

std::string escaped_html(const std::string& text) {
  std::string out;
  for (const char c : text) {
    if (c == '&')
      out += "&amp;";
    else if (c == '<')
      out += "&lt;";
    else if (c == '>')
      out += "&gt;";
    else if (c == '"')
      out += "&quot;";
    else
      out += c;
  }
  return out;
}

std::string svg_chart(const ChartAxis& x, const ChartAxis& y, const std::vector<ChartSeries>& series) {
  std::vector<double> xs, ys;
  for (const ChartSeries& s : series)
    for (const auto& [px, py] : s.points) {
      xs.push_back(px);
      ys.push_back(py);
    }
  const Scale across(x, xs, left, width - right), up(y, ys, height - bottom, top);
  std::string out = fmt::format("<svg viewBox='0 0 {0} {1}' width='{0}' height='{1}' role='img'>\n", width, height);
  for (const double t : across.ticks())
    out += fmt::format(
        "<line x1='{0:.1f}' y1='{1}' x2='{0:.1f}' y2='{2}' stroke='#ddd'/><text x='{0:.1f}' y='{3}' "
        "text-anchor='middle'>{4:.3g}</text>\n",
        across.pixel(t), top, height - bottom, height - bottom + 16, t);
  for (const double t : up.ticks())
    out += fmt::format(
        "<line x1='{0}' y1='{1:.1f}' x2='{2}' y2='{1:.1f}' stroke='#ddd'/><text x='{3}' y='{4:.1f}' "
        "text-anchor='end'>{5:.3g}</text>\n",
        left, up.pixel(t), width - right, left - 6, up.pixel(t) + 4, t);
  out += fmt::format("<rect x='{}' y='{}' width='{}' height='{}' fill='none' stroke='#666'/>\n", left, top,
                     width - left - right, height - top - bottom);
  out += fmt::format("<text x='{:.0f}' y='{:.0f}' text-anchor='middle'>{}</text>\n", (left + width - right) / 2,
                     height - 8, escaped_html(x.title));
  out += fmt::format("<text transform='translate(16,{:.0f}) rotate(-90)' text-anchor='middle'>{}</text>\n",
                     (top + height - bottom) / 2, escaped_html(y.title));
  for (std::size_t n = 0; n < series.size(); ++n) {
    const ChartSeries& s = series[n];
    std::string line, marks;
    const bool few = s.points.size() <= 30;
    for (std::size_t p = 0; p < s.points.size(); ++p) {
      const auto& [px, py] = s.points[p];
      if (!across.shows(px) || !up.shows(py)) continue;
      const double sx = across.pixel(px), sy = up.pixel(py);
      line += fmt::format("{:.1f},{:.1f} ", sx, sy);
      if (few) marks += marker(n, sx, sy);
      if (p < s.labels.size())
        marks += fmt::format("<text x='{:.1f}' y='{:.1f}'>{}</text>", sx + 7, sy - 6, escaped_html(s.labels[p]));
    }
    out += fmt::format("<polyline points='{}' fill='none' stroke='{}' stroke-width='1.8' stroke-dasharray='{}'/>{}\n",
                       line, colors[n % colors.size()], dashes[n % dashes.size()], marks);
    if (series.size() > 1)
      out += fmt::format(
          "<line x1='{0}' y1='{1}' x2='{2}' y2='{1}' stroke='{3}' stroke-width='1.8' stroke-dasharray='{4}'/>"
          "<text x='{5}' y='{6}'>{7}</text>\n",
          left + 10, top + 14 + 16 * static_cast<double>(n), left + 36, colors[n % colors.size()],
          dashes[n % dashes.size()], left + 42, top + 18 + 16 * static_cast<double>(n), escaped_html(s.name));
  }
  return out + "</svg>\n";
}

}  // namespace hextools

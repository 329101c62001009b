#include "programs/fit/fit_plot.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <vector>

namespace palpate::fit {
namespace {

constexpr double kWidth = 420, kHeight = 380;                       // of a panel, pixels
constexpr double kLeft = 74, kRight = 16, kTop = 44, kBottom = 56;  // its margins
constexpr const char* kColours[] = {"#2166ac", "#b2182b", "#4d9221", "#762a83", "#e08214",
                                    "#01665e", "#c51b7d", "#8c510a", "#35978f", "#542788"};
constexpr const char* kBand = "#d1e5f0";

std::string escaped(const std::string& text) {
  std::string out;
  for (const char c : text) out += c == '&' ? "&amp;" : c == '<' ? "&lt;" : c == '>' ? "&gt;" : std::string(1, c);
  return out;
}

struct Range {
  double low, high;
};

// With room at both ends. Values that differ by rounding alone get a range about them.
Range widened(Range range, double share) {
  const double largest = std::max({std::abs(range.low), std::abs(range.high), 1e-300});
  const double width = std::max(range.high - range.low, 0.05 * largest);
  return {range.low - share * width, range.high + share * width};
}

// The numbers within a range that are multiples of 1, 2 or 5 times a power of ten, at most nine of them.
std::vector<double> ticks(Range range, double least_step = 0) {
  const double rough = (range.high - range.low) / 8, power = std::pow(10, std::floor(std::log10(rough)));
  double step = 10 * power;
  for (const double factor : {5.0, 2.0, 1.0})
    if (rough <= factor * power) step = factor * power;
  step = std::max(step, least_step);
  std::vector<double> found;
  for (int i = 0; i < 20; ++i) {
    const double at = (std::ceil(range.low / step) + i) * step;
    if (at <= range.high) found.push_back(at);
  }
  return found;
}

// One pair of axes. Later calls draw over earlier ones.
class Panel {
 public:
  Panel(int index, Range x, Range y, const std::string& title, const std::string& x_title, const std::string& y_title)
      : left_(index * kWidth), x_(x), y_(y) {
    text_ += fmt::format("<text x=\"{:.1f}\" y=\"24\" font-size=\"14\" font-weight=\"bold\">{}</text>\n", left_ + kLeft,
                         escaped(title));
    text_ += fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"middle\">{}</text>\n",
                         left_ + (kLeft + kWidth - kRight) / 2, kHeight - 14, escaped(x_title));
    text_ += fmt::format("<text transform=\"translate({:.1f} {:.1f}) rotate(-90)\" text-anchor=\"middle\">{}</text>\n",
                         left_ + 18, (kTop + kHeight - kBottom) / 2, escaped(y_title));
  }
  double x(double value) const {
    return left_ + kLeft + (value - x_.low) / (x_.high - x_.low) * (kWidth - kLeft - kRight);
  }
  double y(double value) const {
    return kHeight - kBottom - (value - y_.low) / (y_.high - y_.low) * (kHeight - kTop - kBottom);
  }
  void band_across(double from, double to) { rectangle(x_.low, x_.high, from, to); }
  void band_along(double from, double to) { rectangle(from, to, y_.low, y_.high); }
  void line(const std::vector<std::array<double, 2>>& points, const char* colour, const char* dashes = "") {
    std::string path;
    for (const auto& p : points) path += fmt::format("{}{:.1f} {:.1f}", path.empty() ? "M" : "L", x(p[0]), y(p[1]));
    text_ += fmt::format("<path d=\"{}\" fill=\"none\" stroke=\"{}\" stroke-width=\"1.6\" stroke-dasharray=\"{}\"/>\n",
                         path, colour, dashes);
  }
  void dot(double at_x, double at_y, const char* colour, const std::string& name) {
    text_ += fmt::format(
        "<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"3.5\" fill=\"{}\" fill-opacity=\"0.75\"><title>{}</title></circle>\n",
        x(at_x), y(at_y), colour, escaped(name));
  }
  // Axes with numbers; along x only whole numbers where only_whole.
  void axes(bool only_whole_x = false) {
    text_ += fmt::format("<path d=\"M{:.1f} {:.1f}V{:.1f}H{:.1f}\" fill=\"none\" stroke=\"black\"/>\n", x(x_.low),
                         y(y_.high), y(y_.low), x(x_.high));
    for (const double at : ticks(x_, only_whole_x ? 1 : 0))
      text_ += fmt::format(
          "<path d=\"M{0:.1f} {1:.1f}v5\" stroke=\"black\"/><text x=\"{0:.1f}\" y=\"{2:.1f}\" "
          "text-anchor=\"middle\">{3:.4g}</text>\n",
          x(at), y(y_.low), y(y_.low) + 18, at);
    for (const double at : ticks(y_))
      text_ += fmt::format(
          "<path d=\"M{0:.1f} {1:.1f}h-5\" stroke=\"black\"/><text x=\"{2:.1f}\" y=\"{3:.1f}\" "
          "text-anchor=\"end\">{4:.4g}</text>\n",
          x(x_.low), y(at), x(x_.low) - 8, y(at) + 4, at);
  }
  const std::string& text() const { return text_; }

 private:
  void rectangle(double x0, double x1, double y0, double y1) {
    x0 = std::max(x0, x_.low), x1 = std::min(x1, x_.high), y0 = std::max(y0, y_.low), y1 = std::min(y1, y_.high);
    text_ += fmt::format("<rect x=\"{:.1f}\" y=\"{:.1f}\" width=\"{:.1f}\" height=\"{:.1f}\" fill=\"{}\"/>\n", x(x0),
                         y(y1), std::max(0.0, x(x1) - x(x0)), std::max(0.0, y(y0) - y(y1)), kBand);
  }
  double left_;
  Range x_, y_;
  std::string text_;
};

const char* colour_of(std::size_t place) {
  return kColours[place % std::size(kColours)];
}

std::string forces_panel(const FitReport& report) {
  double least = 0, most = 0;
  for (std::size_t r = 0; r < report.measurements.rows.size(); ++r) {
    least = std::min({least, report.measurements.rows[r].force, report.fit.fitted_force[r]});
    most = std::max({most, report.measurements.rows[r].force, report.fit.fitted_force[r]});
  }
  const double unit = most < 1 ? 1e-3 : 1;
  const Range range = {1.05 * least / unit, 1.05 * most / unit};
  const std::string name = unit < 1 ? "mN" : "N";
  Panel panel(0, range, range, "Forces, one colour a place", "fitted force, " + name, "measured force, " + name);
  panel.line({{range.low, range.low}, {range.high, range.high}}, "#888888", "5 4");
  for (std::size_t r = 0; r < report.measurements.rows.size(); ++r) {
    const Row& row = report.measurements.rows[r];
    const std::size_t place = report.measurements.spots[row.spot].place;
    panel.dot(report.fit.fitted_force[r] / unit, row.force / unit, colour_of(place),
              fmt::format("{}, {:.3g} mm", report.measurements.places[place], 1e3 * row.depth));
  }
  panel.axes();
  return panel.text();
}

std::string places_panel(const FitReport& report) {
  const Fit& fit = report.fit;
  Range range = {fit.young.value, fit.young.value};
  const auto include = [&](double value) { range = {std::min(range.low, value), std::max(range.high, value)}; };
  for (const PlaceFit& place : fit.places) include(place.young);
  if (fit.young.interval) include(fit.young.interval->low), include(fit.young.interval->high);
  const std::string text = modulus_text(fit.young.value), unit = text.substr(text.find(' ') + 1);
  const double pascals = unit == "Pa" ? 1 : unit == "kPa" ? 1e3 : unit == "MPa" ? 1e6 : 1e9;
  range = widened({range.low / pascals, range.high / pascals}, 0.15);
  Panel panel(1, {0.3, static_cast<double>(fit.places.size()) + 0.7}, range, "Each place on its own; blue: all, 95 %",
              "place, in the order of the file",
              fmt::format("Young's modulus of {}, {}", report.family.regions[0].name, unit));
  if (fit.young.interval) panel.band_across(fit.young.interval->low / pascals, fit.young.interval->high / pascals);
  const double young = fit.young.value / pascals;
  panel.line({{0.3, young}, {static_cast<double>(fit.places.size()) + 0.7, young}}, "#2166ac");
  for (std::size_t p = 0; p < fit.places.size(); ++p)
    panel.dot(static_cast<double>(p) + 1, fit.places[p].young / pascals, colour_of(p), fit.places[p].name);
  panel.axes(true);
  return panel.text();
}

std::string parameter_panel(const FitReport& report) {
  const Fit& fit = report.fit;
  const auto shown = [&](double value) {
    return report.family.parameter == Parameter::ratio ? std::exp(value) : value;
  };
  const auto [least, most] = std::minmax_element(fit.profile_residual.begin(), fit.profile_residual.end());
  const Range range = widened({1e3 * *least, 1e3 * *most}, 0.08);
  Panel panel(2, {shown(report.model.low()), shown(report.model.high())}, range, "Residual; dashed: the bundles",
              parameter_name(report.family), "root mean square residual, mN");
  const Estimate estimate = parameter_estimate(report);
  if (estimate.interval) panel.band_along(estimate.interval->low, estimate.interval->high);
  for (const double value : report.family.values)
    panel.line({{shown(value), range.low}, {shown(value), range.high}}, "#bbbbbb", "4 4");
  std::vector<std::array<double, 2>> profile;
  for (std::size_t i = 0; i < fit.profile_parameter.size(); ++i)
    profile.push_back({shown(fit.profile_parameter[i]), 1e3 * fit.profile_residual[i]});
  panel.line(profile, "black");
  panel.line({{estimate.value, range.low}, {estimate.value, range.high}}, "#2166ac");
  panel.axes();
  return panel.text();
}

}  // namespace

std::string plot_svg(const FitReport& report) {
  const int panels = report.fit.parameter ? 3 : 2;
  return fmt::format(
             "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{0:.0f}\" height=\"{1:.0f}\" viewBox=\"0 0 {0:.0f} "
             "{1:.0f}\" "
             "font-family=\"sans-serif\" font-size=\"12\">\n<rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n",
             panels * kWidth, kHeight) +
         forces_panel(report) + places_panel(report) + (panels == 3 ? parameter_panel(report) : "") + "</svg>\n";
}

}  // namespace palpate::fit

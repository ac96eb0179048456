// Style of the plots: ticks, and colours in light and dark.

#include <fmt/format.h>

#include <cmath>
#include <initializer_list>

#include "tools/report/svg_plot.h"

namespace rcs::report {
namespace {

/// The factors times powers of ten within [low, high].
std::vector<double> decade_ticks(double low, double high, std::initializer_list<double> factors,
                                 int decades) {
  std::vector<double> ticks;
  const int last = static_cast<int>(std::ceil(std::log10(high)));
  for (int e = static_cast<int>(std::floor(std::log10(low))); e <= last; ++e) {
    if (e % decades != 0) continue;
    for (const double factor : factors) {
      const double tick = factor * std::pow(10.0, e);
      if (tick >= low * (1.0 - 1e-9) && tick <= high * (1.0 + 1e-9)) ticks.push_back(tick);
    }
  }
  return ticks;
}

}  // namespace

std::vector<double> round_ticks(double low, double high, int count) {
  const double rough = (high - low) / count;
  const double power = std::pow(10.0, std::floor(std::log10(rough)));
  double step = 10.0 * power;
  for (const double factor : {1.0, 2.0, 2.5, 5.0}) {
    if (factor * power >= rough * (1.0 - 1e-9)) {
      step = factor * power;
      break;
    }
  }
  std::vector<double> ticks;
  for (double k = std::ceil(low / step); k * step <= high + 1e-9 * step; k += 1.0) {
    ticks.push_back(k * step);
  }
  return ticks;
}

std::vector<double> log_ticks(double low, double high, int count) {
  const auto most = static_cast<std::size_t>(count);
  std::vector<double> ticks = decade_ticks(low, high, {1.0, 2.0, 5.0}, 1);
  if (ticks.size() < 2) return round_ticks(low, high, count);
  for (int decades = 1; ticks.size() > most; ++decades) {
    ticks = decade_ticks(low, high, {1.0}, decades);
  }
  return ticks;
}

std::string axis_number(double v) {
  return fmt::format("{:.6g}", std::abs(v) < 1e-9 ? 0.0 : v);  // no -0, no 1e-17
}

std::string_view plot_style() {
  return R"(
.plot{--ink:#1c2430;--soft:#5b6675;--rule:#d9dee5;--sheet:#ffffff;--veil:#e69f00;
 --blue:#0072b2;--orange:#d55e00;--green:#00835f;--purple:#a8538a;--yellow:#8a7400;--grey:#6b7583;
 font-family:system-ui,-apple-system,"Segoe UI",Roboto,"DejaVu Sans",sans-serif}
@media (prefers-color-scheme:dark){.plot{--ink:#e8ecf1;--soft:#a3adba;--rule:#343c47;--sheet:#161b22;
 --blue:#56b4e9;--orange:#ff8b4a;--green:#2fc79a;--purple:#e09cc6;--yellow:#f0e442;--grey:#98a3b1}}
.plot .paper{fill:var(--sheet)}
.plot text{fill:var(--ink)}
.plot .title{font-size:14px;font-weight:600}
.plot .label{font-size:12px}
.plot .tick{font-size:11px;fill:var(--soft)}
.plot .mid{text-anchor:middle}
.plot .end{text-anchor:end}
.plot .halo{font-weight:600;paint-order:stroke;stroke:var(--sheet);stroke-width:3px}
.plot .grid{stroke:var(--rule);stroke-width:1;fill:none}
.plot .axis{stroke:var(--soft);stroke-width:1;fill:none}
.plot .shade{fill:var(--veil);opacity:.14}
.plot .mark{fill:var(--ink);stroke:var(--sheet);stroke-width:1.5}
.plot .c-blue{--c:var(--blue)}.plot .c-orange{--c:var(--orange)}.plot .c-green{--c:var(--green)}
.plot .c-purple{--c:var(--purple)}.plot .c-yellow{--c:var(--yellow)}
.plot .c-grey{--c:var(--grey)}
.plot .line,.plot .thick,.plot .dashed{fill:none;stroke:var(--c);stroke-width:1.6;
 stroke-linejoin:round;stroke-linecap:round}
.plot .thick{stroke-width:3.4}
.plot .dashed{stroke-dasharray:5 4}
.plot .hair{fill:none;stroke:var(--c);stroke-width:.6;opacity:.5}
.plot .dots{fill:none;stroke:var(--c);stroke-width:1.8;stroke-linecap:round}
.plot .band{fill:var(--c);stroke:none;opacity:.2}
.plot .bars{fill:var(--c);stroke:none;opacity:.85}
)";
}

std::string escape_xml(std::string_view text) {
  std::string out;
  for (const char c : text) {
    switch (c) {
      case '<':
        out += "&lt;";
        break;
      case '>':
        out += "&gt;";
        break;
      case '&':
        out += "&amp;";
        break;
      case '"':
        out += "&quot;";
        break;
      default:
        out += c;
    }
  }
  return out;
}

}  // namespace rcs::report

#include "tools/report/html_page.h"

#include <fmt/format.h>

#include <cctype>

#include "tools/report/plot_script.h"

namespace rcs::report {
namespace {

constexpr std::string_view kPageStyle = R"(
:root{color-scheme:light dark;--ink:#1c2430;--soft:#5b6675;--rule:#d9dee5;--paper:#f5f6f8;--sheet:#ffffff}
@media (prefers-color-scheme:dark){:root{--ink:#e8ecf1;--soft:#a3adba;--rule:#343c47;--paper:#0e1217;--sheet:#161b22}}
*{box-sizing:border-box}
body{margin:0;background:var(--paper);color:var(--ink);
 font:16px/1.55 system-ui,-apple-system,"Segoe UI",Roboto,"DejaVu Sans",sans-serif}
main{max-width:960px;margin:0 auto;padding:36px 20px 64px}
h1{font-size:27px;line-height:1.2;margin:0 0 6px}
h2{font-size:19px;margin:38px 0 10px}
p{margin:6px 0 12px;max-width:75ch;color:var(--soft)}
figure{position:relative;margin:14px 0;padding:14px 14px 8px;background:var(--sheet);border:1px solid var(--rule);
 border-radius:8px}
figure svg{display:block;width:100%;height:auto}
.origin{font-size:13px}
.verdict{font-weight:600;color:var(--ink);padding:8px 12px;border-left:6px solid #3b76c4;background:var(--sheet)}
.verdict.fail{border-left-color:#d55e00}
.verdict.none{border-left-color:var(--soft);font-weight:400}
code{font-family:ui-monospace,"DejaVu Sans Mono",monospace;overflow-wrap:anywhere}
a{color:#2f6fc0}
@media (prefers-color-scheme:dark){a{color:#7db3f2}}
.scroll{overflow-x:auto;background:var(--sheet);border:1px solid var(--rule);border-radius:8px;
 margin:12px 0}
table{border-collapse:collapse;width:100%;font-size:14px;font-variant-numeric:tabular-nums}
th,td{padding:7px 8px;text-align:right;white-space:nowrap;border-top:1px solid var(--rule)}
thead th{border-top:0;color:var(--soft);font-weight:600;white-space:normal;vertical-align:bottom}
th:first-child,td:first-child{text-align:left;white-space:normal;min-width:8em}
)";

/// Of what plot.js adds to plots.
constexpr std::string_view kCursorStyle = R"(
svg.plot[tabindex]{cursor:crosshair;user-select:none}
svg.plot:focus{outline:1px solid var(--rule);outline-offset:4px}
svg.plot:focus-visible{outline:2px solid var(--blue)}
.plot.zoomed .data path{vector-effect:non-scaling-stroke}
.plot .cursor{stroke:var(--ink);stroke-width:1;opacity:.55;fill:none}
.plot .at{fill:var(--c);stroke:var(--sheet);stroke-width:1.5}
.plot .selection{fill:var(--blue);opacity:.18}
.values{position:absolute;z-index:1;pointer-events:none;max-width:70%;padding:4px 9px;font-size:12px;
 line-height:1.5;color:var(--ink);background:var(--sheet);border:1px solid var(--soft);
 border-radius:6px;font-variant-numeric:tabular-nums}
.values[hidden]{display:none}
.values div:first-child{font-weight:600}
.values i{display:inline-block;width:9px;height:9px;margin-right:6px;border-radius:2px;background:var(--c)}
)";

}  // namespace

HtmlPage::HtmlPage(std::string_view title, const PageOrigin& origin)
    : title_(escape_xml(title)),
      origin_(fmt::format("<p class=\"origin\"><code>{}</code><br>{}{}, {}</p>\n",
                          escape_xml(origin.command),
                          origin.configuration.empty()
                              ? ""
                              : fmt::format("configuration {}, ", escape_xml(origin.configuration)),
                          escape_xml(origin.program), escape_xml(origin.date))) {}

void HtmlPage::verdict(bool passed, std::string_view text) {
  body_ += fmt::format("<p class=\"verdict {}\">{}: {}</p>\n", passed ? "pass" : "fail",
                       passed ? "Passed" : "Failed", escape_xml(text));
}

void HtmlPage::without_verdict(std::string_view text) {
  body_ += fmt::format("<p class=\"verdict none\">{}</p>\n", escape_xml(text));
}

std::string viewer_link(std::string_view log, double t_s) {
  std::string link = fmt::format("http://127.0.0.1:8765/#t={:.1f}&log=", t_s);
  std::string_view name = log.substr(log.rfind('/') + 1);
  const auto quotes = [](char c) { return c == '\''; };
  while (!name.empty() && quotes(name.front())) name.remove_prefix(1);
  while (!name.empty() && quotes(name.back())) name.remove_suffix(1);
  for (const char c : name) {
    const bool plain =
        std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '.' || c == '_' || c == '-';
    link += plain ? std::string(1, c) : fmt::format("%{:02X}", static_cast<unsigned char>(c));
  }
  return link;
}

void HtmlPage::moments(std::string_view log, const std::vector<Moment>& moments) {
  if (moments.empty()) return;
  body_ += fmt::format("<p>In the viewer (start <code>rcs view {}</code> first):", escape_xml(log));
  std::string_view between = " ";
  for (const Moment& m : moments) {
    body_ += fmt::format("{}<a href=\"{}\">{}, {:.1f} s</a>", between,
                         escape_xml(viewer_link(log, m.t_s)), escape_xml(m.what), m.t_s);
    between = ", ";
  }
  body_ += ".</p>\n";
}

void HtmlPage::heading(std::string_view text) {
  body_ += fmt::format("<h2>{}</h2>\n", escape_xml(text));
}

void HtmlPage::paragraph(std::string_view text) {
  body_ += fmt::format("<p>{}</p>\n", escape_xml(text));
}

void HtmlPage::table(const Table& table) {
  body_ += "<div class=\"scroll\"><table><thead><tr>";
  for (const std::string& cell : table.header) {
    body_ += fmt::format("<th>{}</th>", escape_xml(cell));
  }
  body_ += "</tr></thead><tbody>\n";
  for (const std::vector<std::string>& row : table.rows) {
    body_ += "<tr>";
    for (const std::string& cell : row) body_ += fmt::format("<td>{}</td>", escape_xml(cell));
    body_ += "</tr>\n";
  }
  body_ += "</tbody></table></div>\n";
  if (!table.note.empty()) paragraph(table.note);
}

void HtmlPage::plot(const Plot& plot) {
  body_ += fmt::format("<figure>{}</figure>\n", render(plot, false));
  has_plots_ = true;
}

std::string HtmlPage::finish() const {
  const std::string script =
      has_plots_ ? fmt::format("<script>\n{}</script>\n", plot_script()) : std::string();
  return fmt::format(
      "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n"
      "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n"
      "<title>{0}</title>\n<style>{1}{2}{3}</style>\n</head>\n<body><main>\n<h1>{0}</h1>\n{4}{5}"
      "</main>{6}</body>\n</html>\n",
      title_, kPageStyle, plot_style(), has_plots_ ? kCursorStyle : std::string_view(), origin_,
      body_, script);
}

}  // namespace rcs::report

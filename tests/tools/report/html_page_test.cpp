#include "tools/report/html_page.h"

#include <gmock/gmock.h>

namespace rcs::report {
namespace {

using testing::HasSubstr;
using testing::Not;

HtmlPage page() {
  return HtmlPage("Title <1>",
                  {"rcs report 'a b.log' -o p.html", "demo3.toml", "rcs 1.2", "today"});
}

TEST(HtmlPage, StatesWhatMadeIt) {
  const std::string text = page().finish();
  EXPECT_THAT(text, HasSubstr("<h1>Title &lt;1&gt;</h1>"));
  EXPECT_THAT(text, HasSubstr("rcs report 'a b.log' -o p.html</code>"));
  EXPECT_THAT(text, HasSubstr("configuration demo3.toml, rcs 1.2, today"));
}

TEST(HtmlPage, AVerdictIsVisible) {
  HtmlPage passed = page();
  passed.verdict(true, "3 of 3 drills");
  EXPECT_THAT(passed.finish(), HasSubstr("class=\"verdict pass\">Passed: 3 of 3 drills"));
  HtmlPage failed = page();
  failed.verdict(false, "2 of 3 drills");
  EXPECT_THAT(failed.finish(), HasSubstr("class=\"verdict fail\">Failed: 2 of 3 drills"));
}

TEST(HtmlPage, WithoutALimitThereIsNoVerdict) {
  HtmlPage none = page();
  none.without_verdict("No limit was set.");
  EXPECT_THAT(none.finish(), HasSubstr("class=\"verdict none\">No limit was set.</p>"));
}

TEST(HtmlPage, ATableIsExplainedBelowIt) {
  HtmlPage with = page();
  with.table(Table{{"a"}, {{"1"}}, "a: what <a> is"});
  EXPECT_THAT(with.finish(), HasSubstr("</table></div>\n<p>a: what &lt;a&gt; is</p>"));
}

TEST(HtmlPage, MomentsOpenTheViewerAtTheirTime) {
  HtmlPage with = page();
  with.moments("out/run.log", {{"begin of the outage", 60.04}, {"largest error", 97.5}});
  const std::string text = with.finish();
  EXPECT_THAT(text, HasSubstr("<code>rcs view out/run.log</code>"));
  EXPECT_THAT(
      text,
      HasSubstr("<a href=\"http://127.0.0.1:8765/#t=60.0&amp;log=run.log\">begin of the outage, "
                "60.0 s</a>, <a href=\"http://127.0.0.1:8765/#t=97.5&amp;log=run.log\">"));
  EXPECT_EQ(viewer_link("'a/my run&1.log'", 3.0),
            "http://127.0.0.1:8765/#t=3.0&log=my%20run%261.log");
}

TEST(HtmlPage, EveryStyledElementExists) {
  HtmlPage with = page();
  with.plot(Plot{});
  const std::string text = with.finish();
  EXPECT_THAT(text, HasSubstr("<figure><svg"));
  EXPECT_THAT(text, HasSubstr("figure svg{"));
}

std::size_t count_of(const std::string& text, const std::string& part) {
  std::size_t n = 0;
  for (std::size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++n;
  return n;
}

TEST(HtmlPage, OneScriptServesAllPlots) {
  HtmlPage with = page();
  EXPECT_THAT(with.finish(), Not(HasSubstr("<script"))) << "without a plot";
  Plot plot;
  plot.title = plot.x_label = "</script><script>alert(1)</script>";
  plot.series.push_back({"\"</script>", Colour::kBlue, SeriesStyle::kLine, {0, 1}, {0, 1}, {}});
  with.plot(plot);
  with.plot(Plot{});
  const std::string text = with.finish();
  EXPECT_EQ(count_of(text, "<script"), 1U) << "labels are escaped";
  EXPECT_EQ(count_of(text, "</script"), 1U);
  EXPECT_THAT(text, HasSubstr("data-label=\"&quot;&lt;/script&gt;\""));
  EXPECT_THAT(text, Not(HasSubstr("<!--")));
  for (const char* remote : {"src=", "@import", "url(h", "fetch(", "import("}) {
    EXPECT_THAT(text, Not(HasSubstr(remote)));
  }
}

}  // namespace
}  // namespace rcs::report

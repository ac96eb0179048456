#include "tools/rcs/cloud_match.h"

#include <cmath>

#include "tools/rcs/cpu_watch.h"

namespace rcs::tools {

double CloudMatch::total_ms() const {
  double total = 0.0;
  for (const auto& [stage, ms] : cpu_ms) total += ms;
  return total;
}

CloudMatch match_as_in_paper(const Points& model, const Points& data, const Pose& guess,
                             const sp::PaperParams& params) {
  CloudMatch m;
  CpuWatch watch;
  m.paper = sp::register_as_in_paper(model, data, guess, params);
  m.cpu_ms = {{"register", watch.stop_ms()}};
  const sp::PaperResult& r = *m.paper;
  m.stop = name_of(r.stop);
  m.good = r.stop == sp::PaperStop::kRelativeChange || r.stop == sp::PaperStop::kMeanDistance ||
           r.stop == sp::PaperStop::kLimitCycle;
  m.T_model_data = r.T_model_data;
  m.iterations = static_cast<int>(r.history.size());
  m.pairs = r.pairs;
  m.overlap = static_cast<double>(r.pairs) / static_cast<double>(data.size());
  m.mean_distance_of_pairs_m = r.mean_distance_m;
  return m;
}

CloudMatch match_planes(const Points& model, const Points& data, const Pose& guess,
                        const sp::CloudParams& params) {
  CloudMatch m;
  CpuWatch prepare;
  sp::CloudMatcher matcher(model, params);
  m.cpu_ms.emplace_back("prepare", prepare.stop_ms());
  CpuWatch search;
  m.wide = matcher.search(data, guess);
  m.cpu_ms.emplace_back("search", search.stop_ms());
  CpuWatch refine;
  m.planes = matcher.refine(data, m.wide->T_target_vehicle);
  m.cpu_ms.emplace_back("refine", refine.stop_ms());
  const sp::Registration& r = *m.planes;
  m.stop = name_of(r.stop);
  m.good = usable(r.stop);
  m.T_model_data = r.T_target_vehicle;
  m.iterations = m.wide->iterations + r.iterations;
  m.pairs = r.pairs;
  m.overlap = r.overlap;
  m.mean_distance_of_pairs_m = r.mean_distance_m;
  return m;
}

std::vector<float> closest_distances(const sp::KdTree& model, const Points& data,
                                     const Pose& T_model_data) {
  std::vector<float> distances_m;
  distances_m.reserve(data.size());
  const Mat3 R = T_model_data.rotation();
  for (std::size_t i = 0; i < data.size(); ++i) {
    const Vec3f p = (R * data[i].cast<double>() + T_model_data.p).cast<float>();
    distances_m.push_back(std::sqrt(model.closest(p).distance2_m2));
  }
  return distances_m;
}

}  // namespace rcs::tools

#include "tools/studies/cloud_match.h"

#include <cmath>
#include <numeric>

#include "tools/studies/cpu_time.h"

namespace rcs::studies {

namespace {

void take(const registration::Registration& r, CloudMatch* m) {
  m->planes = r;
  m->stop = name_of(r.stop);
  // A filter weights and gates a pose at the iteration limit; as a final result it is not usable.
  m->good = registration::usable(r.stop) && r.stop != registration::Stop::kMaxIterations;
  m->T_model_data = r.T_target_vehicle;
  m->iterations += r.iterations;
  m->pairs = r.pairs;
  m->overlap = r.overlap;
  m->mean_distance_of_pairs_m = r.mean_distance_m;
}

/// Every method also returns a pose for unrelated clouds, hence the check.
void verify(const Points& model, const Points& data, CloudMatch* m) {
  if (!m->good) return;
  CpuWatch watch;
  const registration::CloudParams params;
  m->verdict = registration::CloudMatcher(model, data, params).judge(m->T_model_data);
  m->cpu_ms.emplace_back("verify", watch.stop_ms());
  m->good = registration::accepted(*m->verdict, params);
  if (!registration::plausible(*m->verdict, params)) m->stop = kDisagreement;
}

enum class From { kGuess, kAnywhere };

CloudMatch match_from(From from, const Points& model, const Points& data, const Pose& guess,
                      const registration::CloudParams& params) {
  CloudMatch m;
  CpuWatch prepare;
  registration::CloudMatcher matcher(model, data, params);
  m.cpu_ms.emplace_back("prepare", prepare.stop_ms());
  CpuWatch search;
  std::vector<registration::Hypothesis> ranked =
      from == From::kGuess ? matcher.search(guess) : matcher.search_globally(guess);
  m.cpu_ms.emplace_back("search", search.stop_ms());
  CpuWatch refine;
  m.searched = matcher.conclude(std::move(ranked));
  m.cpu_ms.emplace_back("refine", refine.stop_ms());
  take(m.searched->best, &m);
  if (m.searched->ranked.empty()) m.T_model_data = guess;
  if (m.good) m.verdict = m.searched->verdict;
  if (m.good && !registration::plausible(*m.verdict, params)) m.stop = kDisagreement;
  m.good = m.good && m.searched->accepted;
  return m;
}

}  // namespace

double CloudMatch::total_ms() const {
  double total = 0.0;
  for (const auto& [stage, ms] : cpu_ms) total += ms;
  return total;
}

CloudMatch match_as_in_paper(const Points& model, const Points& data, const Pose& guess,
                             const registration::PaperParams& params) {
  CloudMatch m;
  CpuWatch watch;
  m.paper = registration::register_as_in_paper(model, data, guess, params);
  m.cpu_ms = {{"register", watch.stop_ms()}};
  const registration::PaperResult& r = *m.paper;
  m.stop = name_of(r.stop);
  m.good = r.stop == registration::PaperStop::kRelativeChange ||
           r.stop == registration::PaperStop::kMeanDistance ||
           r.stop == registration::PaperStop::kLimitCycle;
  m.T_model_data = r.T_model_data;
  m.iterations = static_cast<int>(r.history.size());
  m.pairs = r.pairs;
  m.overlap = static_cast<double>(r.pairs) / static_cast<double>(data.size());
  m.mean_distance_of_pairs_m = r.mean_distance_m;
  verify(model, data, &m);
  return m;
}

CloudMatch match_planes(const Points& model, const Points& data, const Pose& guess,
                        const registration::CloudParams& params) {
  return match_from(From::kGuess, model, data, guess, params);
}

CloudMatch match_globally(const Points& model, const Points& data, const Pose& guess,
                          const registration::CloudParams& params) {
  return match_from(From::kAnywhere, model, data, guess, params);
}

CloudMatch match_gicp(const Points& model, const Points& data, const Pose& guess,
                      const registration::GicpParams& params) {
  CloudMatch m;
  CpuWatch surfaces;
  const registration::GicpCloud model_cloud(model, params);
  const registration::GicpCloud data_cloud(data, params);
  m.cpu_ms.emplace_back("surfaces", surfaces.stop_ms());
  CpuWatch refine;
  const registration::Registration r =
      registration::register_gicp(model_cloud, data_cloud, guess, params);
  m.cpu_ms.emplace_back("refine", refine.stop_ms());
  take(r, &m);
  verify(model, data, &m);
  return m;
}

CloudMatch match_gicp_globally(const Points& model, const Points& data, const Pose& guess,
                               const registration::CloudParams& search,
                               const registration::GicpParams& params) {
  CloudMatch found = match_globally(model, data, guess, search);
  if (!found.good) return found;
  CloudMatch m = match_gicp(model, data, found.T_model_data, params);
  m.cpu_ms.insert(m.cpu_ms.begin(), found.cpu_ms.begin(), found.cpu_ms.end());
  m.iterations += found.iterations;
  m.searched = std::move(found.searched);
  return m;
}

ClosestPoints closest_points(const KdTree& model, const Points& data, const Pose& T_model_data) {
  ClosestPoints out;
  out.index.reserve(data.size());
  out.distance_m.reserve(data.size());
  const Mat3 R = T_model_data.rotation();
  for (std::size_t i = 0; i < data.size(); ++i) {
    const Vec3f p = (R * data[i].cast<double>() + T_model_data.p).cast<float>();
    const KdTree::Closest c = model.closest(p);
    out.index.push_back(c.index);
    out.distance_m.push_back(std::sqrt(c.distance2_m2));
  }
  return out;
}

double ClosestPoints::mean_m() const {
  const double sum = std::accumulate(distance_m.begin(), distance_m.end(), 0.0);
  return sum / static_cast<double>(distance_m.size());
}

}  // namespace rcs::studies

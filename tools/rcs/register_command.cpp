// rcs register

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "modules/sp/icp_paper.h"
#include "rcs/node/budget.h"
#include "tools/rcs/cloud_file.h"
#include "tools/rcs/command.h"
#include "tools/rcs/trajectory.h"

namespace rcs::tools {
namespace {

constexpr std::string_view kName = "register";

/// Sixteen numbers, row by row, of a rigid motion.
Result<Pose> parse_pose(const std::string& text) {
  const std::optional<std::vector<double>> v = parse_numbers(text);
  if (!v || v->size() != 16) return Error{"--guess: 16 numbers, row-major, are wanted"};
  const auto at = [&v](int row, int col) { return (*v)[static_cast<std::size_t>(4 * row + col)]; };
  Mat3 R;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) R(i, j) = at(i, j);
  }
  const bool last_row = at(3, 0) == 0.0 && at(3, 1) == 0.0 && at(3, 2) == 0.0 && at(3, 3) == 1.0;
  if ((R.transpose() * R - Mat3::Identity()).norm() > 1e-3 || R.determinant() < 0.0 || !last_row) {
    return Error{"--guess: no rigid motion: a rotation, a translation and 0 0 0 1 are wanted"};
  }
  return Pose{Quat(R).normalized(), Vec3(at(0, 3), at(1, 3), at(2, 3))};
}

double mean(const std::vector<float>& values) {
  double sum = 0.0;
  for (const float v : values) sum += v;
  return values.empty() ? 0.0 : sum / static_cast<double>(values.size());
}

/// The thread's CPU time since it was made.
class CpuWatch {
 public:
  CpuWatch() { clock_.start_cycle(); }
  [[nodiscard]] double stop_ms() {
    clock_.end_cycle();
    return 1e3 * seconds(clock_.used_cpu());
  }

 private:
  StageClock clock_;
};

class Register final : public Command {
 public:
  explicit Register(CLI::App* rcs)
      : Command(rcs->add_subcommand(
            "register", "Finds how one point cloud lies in another, by the paper's method")) {
    app()
        ->add_option("MODEL", model_, "point cloud: .pcd, .ply, .bin (KITTI) or .xyz [m]")
        ->required()
        ->check(CLI::ExistingFile);
    app()
        ->add_option("DATA", data_, "point cloud that is moved onto MODEL")
        ->required()
        ->check(CLI::ExistingFile);
    app()->add_option("--guess", guess_,
                      "\"16 numbers\", row-major: where DATA lies in MODEL, about; default: the "
                      "same place");
    app()
        ->add_option("--spacing", params_.spacing_m,
                     "the paper's D, the distance of neighbouring points [m]; default: measured")
        ->check(CLI::Range(0.001, 100.0));
    app()
        ->add_option("--max-iterations", params_.max_iterations)
        ->check(CLI::Range(1, 100000))
        ->capture_default_str();
    app()->add_flag("--as-printed", as_printed_, "with the paper's slips (see the footer)");
    app()->add_flag("--quaternion", quaternion_, "the motion by quaternions instead of by SVD");
    app()->add_flag("--json", json_, "the answer with every iteration, as JSON");
    app()->footer(
        "Madhavan & Messina, \"Iterative Registration of 3D LADAR Data for Autonomous "
        "Navigation\".\n"
        "As printed, the motion found from MODEL to DATA is applied to DATA, R may be a "
        "reflection,\n"
        "H sums over pairs that were not accepted, and mean and deviation are of all pairs.\n"
        "A small mean distance is no accuracy: look at the overlap, and hold it against another\n"
        "sensor. Status 0: it converged; 1: it did not, and why is told.\n"
        "Examples:\n"
        "  rcs register first.pcd second.pcd\n"
        "  rcs register 0000000000.bin 0000000001.bin --json\n"
        "  rcs register a.ply b.ply --guess \"1 0 0 2.5  0 1 0 0  0 0 1 0  0 0 0 1\"");
  }

  int run() override {
    Pose guess;
    if (!guess_.empty()) {
      const Result<Pose> parsed = parse_pose(guess_);
      if (!parsed) {
        fmt::print(stderr, "rcs register: {}\n", parsed.error().message);
        return kExitUsage;
      }
      guess = *parsed;
    }
    const Result<Cloud> model = read_cloud(model_, {});
    if (!model) return fail(kName, model.error());
    const Result<Cloud> data = read_cloud(data_, {});
    if (!data) return fail(kName, data.error());

    sp::PaperParams params = as_printed_ ? sp::PaperParams::literal() : sp::PaperParams{};
    params.spacing_m = params_.spacing_m;
    params.max_iterations = params_.max_iterations;
    if (quaternion_) params.solver = sp::MotionSolver::kQuaternion;
    CpuWatch watch;
    const sp::PaperResult result =
        sp::register_as_in_paper(model->points, data->points, guess, params);
    const double cpu_ms = watch.stop_ms();
    if (json_) {
      fmt::print("{}\n", to_json(*model, *data, result, cpu_ms).dump(2));
    } else {
      tell(*model, *data, result, cpu_ms);
    }
    const bool converged = result.stop == sp::PaperStop::kRelativeChange ||
                           result.stop == sp::PaperStop::kMeanDistance ||
                           result.stop == sp::PaperStop::kLimitCycle;
    return converged ? kExitOk
                     : fail(kName, Error{fmt::format("not converged: {}", name_of(result.stop))});
  }

 private:
  static double overlap(const sp::PaperResult& r) {
    const std::size_t n = r.distance_after_m.size();
    return n == 0 ? 0.0 : static_cast<double>(r.pairs) / static_cast<double>(n);
  }

  static nlohmann::json to_json(const Cloud& model, const Cloud& data, const sp::PaperResult& r,
                                double cpu_ms) {
    nlohmann::json T = nlohmann::json::array();
    const Eigen::Matrix4d m = r.T_model_data.matrix();
    for (int i = 0; i < 4; ++i) {
      for (int j = 0; j < 4; ++j) T.push_back(m(i, j));
    }
    nlohmann::json history = nlohmann::json::array();
    for (const sp::PaperIteration& it : r.history) {
      history.push_back({{"branch", name_of(it.branch)},
                         {"mu_m", it.mu_m},
                         {"sigma_m", it.sigma_m},
                         {"d_max_m", it.d_max_m},
                         {"pairs", it.pairs},
                         {"mean_distance_m", it.mean_distance_m},
                         {"moved_m", it.moved_m},
                         {"turned_rad", it.turned_rad}});
    }
    return {{"method", "paper"},
            {"T_model_data", T},
            {"stop", name_of(r.stop)},
            {"iterations", r.history.size()},
            {"model_points", model.points.size()},
            {"data_points", data.points.size()},
            {"left_out", {{"model", model.no_return}, {"data", data.no_return}}},
            {"spacing_m", r.spacing_m},
            {"pairs", r.pairs},
            {"overlap", overlap(r)},
            {"mean_distance_before_m", mean(r.distance_before_m)},
            {"mean_distance_after_m", r.mean_distance_m},
            {"mean_distance_after_all_m", mean(r.distance_after_m)},
            {"cpu_ms", cpu_ms},
            {"history", history}};
  }

  static void tell(const Cloud& model, const Cloud& data, const sp::PaperResult& r, double cpu_ms) {
    fmt::print("model {} points, data {} points; D {:.3f} m\n", model.points.size(),
               data.points.size(), r.spacing_m);
    fmt::print("stopped by {} after {} iterations, {:.1f} ms of CPU\n", name_of(r.stop),
               r.history.size(), cpu_ms);
    fmt::print("pairs {}, overlap {:.0f} %, mean distance before {:.1f} cm, after {:.1f} cm\n",
               r.pairs, 100.0 * overlap(r), 100.0 * mean(r.distance_before_m),
               100.0 * r.mean_distance_m);
    const Eigen::Matrix4d m = r.T_model_data.matrix();
    fmt::print("T_model_data:\n");
    for (int i = 0; i < 4; ++i) {
      fmt::print("{:12.6f} {:12.6f} {:12.6f} {:12.6f}\n", m(i, 0), m(i, 1), m(i, 2), m(i, 3));
    }
  }

  std::string model_;
  std::string data_;
  std::string guess_;
  sp::PaperParams params_;
  bool as_printed_ = false;
  bool quaternion_ = false;
  bool json_ = false;
};

}  // namespace

void add_register_command(CLI::App* rcs, Commands* commands) {
  commands->push_back(std::make_unique<Register>(rcs));
}

}  // namespace rcs::tools

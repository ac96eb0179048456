// rcs register

#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <numeric>

#include "tools/rcs/cloud_file.h"
#include "tools/rcs/cloud_match.h"
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

nlohmann::json row_major(const Eigen::MatrixXd& m) {
  nlohmann::json numbers = nlohmann::json::array();
  for (int i = 0; i < m.rows(); ++i) {
    for (int j = 0; j < m.cols(); ++j) numbers.push_back(m(i, j));
  }
  return numbers;
}

/// What only one method has to tell.
nlohmann::json more_of(const sp::PaperResult& r) {
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
  return {{"spacing_m", r.spacing_m},
          {"mean_distance_of_pairs_m", r.mean_distance_m},
          {"history", history}};
}

nlohmann::json more_of(const sp::Registration& r, const sp::WideAnswer& wide) {
  return {
      {"information", row_major(r.information)},
      {"observability", std::vector<double>(r.observability.data(), r.observability.data() + 6)},
      {"mean_distance_to_planes_m", r.mean_distance_m},
      {"search_score", wide.score}};
}

double mean(const std::vector<float>& values) {
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

class Register final : public Command {
 public:
  explicit Register(CLI::App* rcs)
      : Command(rcs->add_subcommand("register", "Finds how one point cloud lies in another")) {
    app()
        ->add_option("MODEL", model_, "point cloud: .pcd, .ply, .bin (KITTI) or .xyz [m]")
        ->required()
        ->check(CLI::ExistingFile);
    app()
        ->add_option("DATA", data_, "point cloud that is moved onto MODEL")
        ->required()
        ->check(CLI::ExistingFile);
    app()
        ->add_option("--method", method_,
                     "plane: voxels' distributions from afar, then point to plane; paper: Madhavan "
                     "and Messina's iterative registration")
        ->check(CLI::IsMember({"plane", "paper"}))
        ->capture_default_str();
    app()->add_option("--guess", guess_,
                      "\"16 numbers\", row-major: where DATA lies in MODEL, about; default: the "
                      "same place");
    app()
        ->add_option("--spacing", params_.spacing_m,
                     "paper: its D, the distance of neighbouring points [m]; default: measured")
        ->check(CLI::Range(0.001, 100.0));
    app()
        ->add_option("--max-iterations", params_.max_iterations, "paper")
        ->check(CLI::Range(1, 100000))
        ->capture_default_str();
    app()->add_flag("--as-printed", as_printed_, "paper: with its slips (see the footer)");
    app()->add_flag("--quaternion", quaternion_, "paper: motion by quaternions instead of by SVD");
    app()->add_flag("--json", json_, "the answer as JSON; paper: with every iteration");
    app()->footer(
        "plane finds its way from some metres and tens of degrees off, and says by how much it can "
        "be\ntrusted (information: 6 x 6, of x, y, z, roll, pitch, yaw of DATA).\n"
        "paper is Madhavan & Messina, \"Iterative Registration of 3D LADAR Data for Autonomous "
        "Navigation\".\n"
        "As printed, the motion found from MODEL to DATA is applied to DATA, R may be a "
        "reflection,\n"
        "H sums over pairs that were not accepted, and mean and deviation are of all pairs.\n"
        "A small mean distance is no accuracy: look at the overlap, and hold it against another\n"
        "sensor. Status 0: it converged; 1: it did not, and why is told.\n"
        "Examples:\n"
        "  rcs register first.pcd second.pcd\n"
        "  rcs register 0000000000.bin 0000000001.bin --method paper --json\n"
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
    if (model->points.empty() || data->points.empty()) {
      return fail(kName,
                  Error{fmt::format("{}: no points", model->points.empty() ? model_ : data_)});
    }

    sp::PaperParams params = as_printed_ ? sp::PaperParams::literal() : sp::PaperParams{};
    params.spacing_m = params_.spacing_m;
    params.max_iterations = params_.max_iterations;
    if (quaternion_) params.solver = sp::MotionSolver::kQuaternion;
    const CloudMatch answer =
        method_ == "paper" ? match_as_in_paper(model->points, data->points, guess, params)
                           : match_planes(model->points, data->points, guess, sp::CloudParams{});
    const sp::KdTree tree(model->points);
    const double before_m = mean(closest_distances(tree, data->points, guess));
    const double after_m = mean(closest_distances(tree, data->points, answer.T_model_data));
    if (json_) {
      fmt::print("{}\n", to_json(*model, *data, answer, before_m, after_m).dump(2));
    } else {
      tell(*model, *data, answer, before_m, after_m);
    }
    return answer.good ? kExitOk
                       : fail(kName, Error{fmt::format("not converged: {}", answer.stop)});
  }

 private:
  [[nodiscard]] nlohmann::json to_json(const Cloud& model, const Cloud& data, const CloudMatch& a,
                                       double before_m, double after_m) const {
    nlohmann::json cpu = nlohmann::json::object();
    for (const auto& [stage, ms] : a.cpu_ms) cpu[stage] = ms;
    cpu["total"] = a.total_ms();
    nlohmann::json out = {{"method", method_},
                          {"T_model_data", row_major(a.T_model_data.matrix())},
                          {"stop", a.stop},
                          {"iterations", a.iterations},
                          {"model_points", model.points.size()},
                          {"data_points", data.points.size()},
                          {"left_out", {{"model", model.no_return}, {"data", data.no_return}}},
                          {"pairs", a.pairs},
                          {"overlap", a.overlap},
                          {"mean_distance_before_m", before_m},
                          {"mean_distance_after_m", after_m},
                          {"cpu_ms", cpu}};
    if (a.paper) out.update(more_of(*a.paper));
    if (a.planes) out.update(more_of(*a.planes, *a.wide));
    return out;
  }

  static void tell(const Cloud& model, const Cloud& data, const CloudMatch& a, double before_m,
                   double after_m) {
    fmt::print("model {} points, data {} points\n", model.points.size(), data.points.size());
    fmt::print("{} after {} iterations; CPU", a.stop, a.iterations);
    for (const auto& [stage, ms] : a.cpu_ms) fmt::print(" {} {:.1f} ms", stage, ms);
    fmt::print(
        "\npairs {}, overlap {:.0f} %, mean distance to the closest point before {:.1f} cm, "
        "after {:.1f} cm\n",
        a.pairs, 100.0 * a.overlap, 100.0 * before_m, 100.0 * after_m);
    const Eigen::Matrix4d m = a.T_model_data.matrix();
    fmt::print("T_model_data:\n");
    for (int i = 0; i < 4; ++i) {
      fmt::print("{:12.6f} {:12.6f} {:12.6f} {:12.6f}\n", m(i, 0), m(i, 1), m(i, 2), m(i, 3));
    }
  }

  std::string model_;
  std::string data_;
  std::string method_ = "plane";
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

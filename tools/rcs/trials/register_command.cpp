// rcs register

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>
#include <optional>

#include "tools/base/files.h"
#include "tools/base/trajectory.h"
#include "tools/clouds/cloud_file.h"
#include "tools/rcs/command.h"
#include "tools/report/json_document.h"
#include "tools/report/match_picture.h"
#include "tools/studies/cloud_match.h"

namespace rcs::cli {
namespace {

constexpr std::string_view kRegisterName = "register";
constexpr double kMaxGuess_m = 1e6;  // per axis; clouds are smaller

/// Parses a rigid motion: sixteen numbers, row-major.
Result<Pose> parse_pose(const std::string& text) {
  const std::optional<std::vector<double>> v = tools::parse_numbers(text);
  if (!v || v->size() != 16) return Error{"--guess: expected 16 numbers, row-major"};
  const auto at = [&v](int row, int col) { return (*v)[static_cast<std::size_t>(4 * row + col)]; };
  Mat3 R;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) R(i, j) = at(i, j);
  }
  const bool last_row = at(3, 0) == 0.0 && at(3, 1) == 0.0 && at(3, 2) == 0.0 && at(3, 3) == 1.0;
  // The error of huge numbers is not a number.
  const bool rotation =
      (R.transpose() * R - Mat3::Identity()).norm() <= 1e-3 && R.determinant() > 0;
  if (!rotation || !last_row) {
    return Error{"--guess: not a rigid motion; expected a rotation, a translation and 0 0 0 1"};
  }
  const Vec3 translation(at(0, 3), at(1, 3), at(2, 3));
  if (translation.cwiseAbs().maxCoeff() > kMaxGuess_m) {
    return Error{fmt::format("--guess: expected a translation of -{0:g} to {0:g} m", kMaxGuess_m)};
  }
  return Pose{Quat(R).normalized(), translation};
}

report::Json row_major(const Eigen::MatrixXd& m) {
  report::Json numbers = report::Json::array();
  for (int i = 0; i < m.rows(); ++i) {
    for (int j = 0; j < m.cols(); ++j) numbers.push_back(m(i, j));
  }
  return numbers;
}

/// The results that are specific to a method.
report::Json more_of(const registration::PaperResult& r) {
  report::Json history = report::Json::array();
  for (const registration::PaperIteration& it : r.history) {
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

report::Json more_of(const registration::Registration& r) {
  return {
      {"information", row_major(r.information)},
      {"observability", std::vector<double>(r.observability.data(), r.observability.data() + 6)},
      {"mean_distance_to_planes_m", r.mean_distance_m}};
}

report::Json more_of(const registration::CloudRegistration& r) {
  report::Json ranked = report::Json::array();
  for (const registration::Hypothesis& h : r.ranked) {
    ranked.push_back(
        {{"T_model_data", row_major(h.T_target_vehicle.matrix())}, {"score", h.score}});
  }
  return {{"ambiguity", r.ambiguity}, {"hypotheses", ranked}};
}

/// R = Rz(yaw) Ry(pitch) Rx(roll).
Vec3 roll_pitch_yaw_deg(const Quat& q) {
  const Mat3 R = q.toRotationMatrix();
  return {degrees(std::atan2(R(2, 1), R(2, 2))),
          degrees(std::asin(std::clamp(-R(2, 0), -1.0, 1.0))), degrees(yaw_of(q))};
}

/// One sigma of x, y, z [m], roll, pitch, yaw [rad] of DATA; infinite for a component of an
/// unobserved direction.
Vec6 sigmas(const Mat6& information) {
  const Eigen::SelfAdjointEigenSolver<Mat6> eigen(information);
  const double least = 1e-9 * std::max(eigen.eigenvalues()[5], 1e-300);
  Vec6 variance = Vec6::Zero();
  for (int k = 0; k < 6; ++k) {
    const Vec6 part = eigen.eigenvectors().col(k).cwiseAbs2();
    if (eigen.eigenvalues()[k] > least) {
      variance += part / eigen.eigenvalues()[k];
      continue;
    }
    for (int i = 0; i < 6; ++i) {
      if (part[i] > 1e-3) variance[i] = std::numeric_limits<double>::infinity();
    }
  }
  return variance.cwiseSqrt();
}

std::string sigma_text(double sigma, const char* unit) {
  return std::isfinite(sigma) ? fmt::format("{:.3f} {}", sigma, unit) : std::string("unobserved");
}

report::Json numbers_of(const Vec3& v) { return {v.x(), v.y(), v.z()}; }

/// Parses "32,180". @return nullopt if malformed
std::optional<clouds::CloudShape> parse_shape(const std::string& text) {
  clouds::CloudShape shape;
  const char* const end = text.data() + text.size();
  const std::from_chars_result rows = std::from_chars(text.data(), end, shape.rows);
  if (rows.ec != std::errc() || rows.ptr == end || *rows.ptr != ',') return std::nullopt;
  const std::from_chars_result cols = std::from_chars(rows.ptr + 1, end, shape.cols);
  if (cols.ec != std::errc() || cols.ptr != end || shape.rows < 1 || shape.cols < 1) {
    return std::nullopt;
  }
  return shape;
}

report::Json more_of(const registration::Verdict& v) {
  report::Json agreement = {{"surfaces", v.agreement.surfaces},
                            {"overlap", v.agreement.overlap},
                            {"min_direction", v.agreement.least}};
  const Vec3& blind = v.agreement.undetermined;
  if (!blind.isZero()) agreement["undetermined_direction"] = numbers_of(blind);
  return {
      {"agreement", agreement},
      {"plausibility",
       {{"explained", v.plausibility.explained}, {"contradicted", v.plausibility.contradicted}}}};
}

class Register final : public Command {
 public:
  explicit Register(CLI::App* rcs)
      : Command(rcs->add_subcommand("register", "Register two point clouds")) {
    app()
        ->add_option("MODEL", model_, "point cloud: .pcd, .ply, .bin (KITTI) or .xyz [m]")
        ->required()
        ->check(CLI::ExistingFile);
    app()
        ->add_option("DATA", data_, "point cloud to be registered to MODEL")
        ->required()
        ->check(CLI::ExistingFile);
    app()
        ->add_option(
            "--method", method_,
            "plane: search by occupancy, then point to plane; paper: iterative registration "
            "by Madhavan and Messina; gicp: generalized ICP")
        ->check(CLI::IsMember({"plane", "paper", "gicp"}))
        ->capture_default_str();
    app()
        ->add_option(
            "--guess", guess_,
            "approximate T_model_data: 16 numbers, row-major, separated by commas; default: "
            "identity")
        ->type_name("NUMBERS");
    app()->add_flag("--global", global_,
                    "plane, gicp: search within --radius of the guess and over all headings");
    app()
        ->add_option("--radius", radius_m_, "--global: largest error of the guess [m]")
        ->check(CLI::Range(0.0, 100.0))
        ->capture_default_str();
    app()
        ->add_option("--organized", organized_,
                     "both files are range images of so many rows and columns, row by row")
        ->type_name("ROWS,COLS");
    app()
        ->add_option("--plot", plot_, "folder for before.svg, after.svg and histogram.svg")
        ->type_name("FOLDER");
    app()
        ->add_option("--spacing", params_.spacing_m,
                     "paper: D, the distance of neighbouring points [m]; default: measured")
        ->check(CLI::Range(0.001, 100.0));
    app()
        ->add_option("--max-iterations", params_.max_iterations, "paper: limit of iterations")
        ->check(CLI::Range(1, 100000))
        ->capture_default_str();
    app()->add_flag("--as-printed", as_printed_, "paper: as printed, with its errors (see below)");
    app()->add_flag("--quaternion", quaternion_, "paper: motion by quaternions instead of by SVD");
    app()->add_flag("--json", json_, "print the result as JSON; paper: with every iteration");
    app()->footer(
        "plane converges from initial errors of some metres and of any heading and estimates its\n"
        "uncertainty (information: 6 x 6, of x, y, z, roll, pitch, yaw of DATA). Each cloud is "
        "one\n"
        "scan, with its sensor at the origin.\n"
        "paper is Madhavan & Messina, \"Iterative Registration of 3D LADAR Data for Autonomous\n"
        "Navigation\". As printed, the motion found from MODEL to DATA is applied to DATA, R may "
        "be\n"
        "a reflection, H sums over pairs that were not accepted, and mean and deviation are of "
        "all\n"
        "pairs.\n"
        "gicp is Segal, Haehnel & Thrun, \"Generalized-ICP\", slower than plane; it is a "
        "reference\n"
        "for the other methods. It starts at the guess (--global: at the result of plane), "
        "requires\n"
        "initial errors below about 2 m and 10 deg, and its information assumes independent\n"
        "errors, which overestimates the information of real scans.\n"
        "The result of every method is checked: what is not ground in one cloud must lie on\n"
        "surfaces of the other, and not in free space of the other scan. The pose is ambiguous "
        "if\n"
        "another one explains the clouds nearly as well; along a tunnel and on a plain the\n"
        "translation is undetermined.\n"
        "Status 0: accepted; 1: rejected, with the reason.\n"
        "Examples:\n"
        "  rcs register first.pcd second.pcd\n"
        "  rcs register 0000000000.bin 0000000001.bin --method paper --json\n"
        "  rcs register first.pcd second.pcd --method gicp\n"
        "  rcs register first.pcd second.pcd --global --plot pictures\n"
        "  rcs register a.ply b.ply --guess 1,0,0,2.5,0,1,0,0,0,0,1,0,0,0,0,1");
  }

  int run() override {
    Pose guess;
    if (!guess_.empty()) {
      const Result<Pose> parsed = parse_pose(guess_);
      if (!parsed) return wrong_usage(parsed.error().message);
      guess = *parsed;
    }
    clouds::CloudShape shape;
    if (!organized_.empty()) {
      const std::optional<clouds::CloudShape> parsed = parse_shape(organized_);
      if (!parsed) return wrong_usage("--organized: expected ROWS,COLS, e.g. 32,180");
      shape = *parsed;
    }
    if (app()->count("--radius") > 0 && !global_) return wrong_usage("--radius requires --global");
    if (global_ && method_ == "paper") return wrong_usage("--method paper excludes --global");

    const Result<clouds::Cloud> model = read(model_, shape);
    if (!model) return fail(kRegisterName, model.error());
    const Result<clouds::Cloud> data = read(data_, shape);
    if (!data) return fail(kRegisterName, data.error());
    if (model->points.empty() || data->points.empty()) {
      return fail(kRegisterName,
                  Error{fmt::format("{}: no points", model->points.empty() ? model_ : data_)});
    }

    const studies::CloudMatch answer = match(model->points, data->points, guess);
    const KdTree tree(model->points);
    const studies::ClosestPoints before = studies::closest_points(tree, data->points, guess);
    const studies::ClosestPoints after =
        studies::closest_points(tree, data->points, answer.T_model_data);
    if (!plot_.empty()) {
      const Outcome drawn = draw(model->points, data->points, guess, answer, before, after);
      if (!drawn) return fail(kRegisterName, drawn.error());
    }
    if (json_) {
      fmt::print(
          "{}", report::json_document(kRegisterName, to_json(*model, *data, answer, before.mean_m(),
                                                             after.mean_m())));
    } else {
      print_results(*model, *data, answer, before.mean_m(), after.mean_m());
    }
    if (answer.good) return kExitOk;
    return negative(kRegisterName, Error{why_not(answer)});
  }

 private:
  static int wrong_usage(const std::string& why) {
    fmt::print(stderr, "rcs register: {}\n", why);
    return kExitUsage;
  }

  /// The time of a search tree grows with the square of the number of coincident points.
  static Result<clouds::Cloud> read(const std::string& path, const clouds::CloudShape& shape) {
    Result<clouds::Cloud> cloud = clouds::read_cloud(path, shape);
    if (!cloud) return cloud;
    if (const std::string skipped = clouds::skipped_text(*cloud); !skipped.empty()) {
      fmt::print(stderr, "rcs register: {}: {}\n", path, skipped);
    }
    if (const std::size_t dropped = clouds::drop_coincident(&cloud.value()); dropped > 0) {
      fmt::print(stderr, "rcs register: {}: {} coincident points dropped\n", path, dropped);
    }
    return cloud;
  }

  static std::string undetermined(const Vec3& direction) {
    Eigen::Index largest = 0;
    direction.cwiseAbs().maxCoeff(&largest);
    // The vector or its opposite, whichever has a positive largest entry; + 0.0: no "-0.00".
    const Vec3 d = direction[largest] < 0.0 ? Vec3(-direction) : direction;
    const auto shown = [&d](int k) { return std::round(100.0 * d[k]) / 100.0 + 0.0; };
    return fmt::format(
        "rejected: translation along ({:.2f} {:.2f} {:.2f}) is undetermined: almost no surfaces of "
        "DATA are perpendicular to that direction",
        shown(0), shown(1), shown(2));
  }

  static std::string why_not(const studies::CloudMatch& answer) {
    if (answer.searched && answer.searched->ranked.empty()) return "rejected: no pose was found";
    if (!answer.verdict) return fmt::format("not converged: {}", answer.stop);
    const registration::Plausibility& p = answer.verdict->plausibility;
    if (answer.stop == studies::kDisagreement) {
      const registration::CloudParams limits;
      return fmt::format(
          "rejected: at the result {:.0f} % of what is not ground lies on surfaces of the other "
          "cloud (explained), {:.0f} % in free space of the other scan (contradicted), and {:.0f} "
          "% of the surfaces agree in the direction of least agreement; required: explained at "
          "least {:.0f} % above contradicted, contradicted at most {:.2f} of explained, agreement "
          "at least {:.0f} %. The clouds do not overlap, or the error of the guess is too large",
          100.0 * p.explained, 100.0 * p.contradicted, 100.0 * answer.verdict->agreement.least,
          100.0 * limits.min_score, limits.max_contradicted, 100.0 * limits.min_least);
    }
    if (!answer.verdict->agreement.undetermined.isZero()) {
      return undetermined(answer.verdict->agreement.undetermined);
    }
    if (answer.stop != name_of(registration::Stop::kConverged)) {
      return fmt::format("not converged: {}", answer.stop);
    }
    return fmt::format(
        "rejected: ambiguous: another pose explains the clouds {:.2f} times as well (limit {:.2f})",
        answer.searched->ambiguity, answer.searched->max_ambiguity);
  }

  [[nodiscard]] registration::CloudParams search_params() const {
    registration::CloudParams params;
    params.global_radius_m = radius_m_;
    return params;
  }

  [[nodiscard]] studies::CloudMatch match(const Points& model, const Points& data,
                                          const Pose& guess) const {
    if (method_ == "paper") {
      registration::PaperParams params =
          as_printed_ ? registration::PaperParams::literal() : registration::PaperParams{};
      params.spacing_m = params_.spacing_m;
      params.max_iterations = params_.max_iterations;
      if (quaternion_) params.solver = registration::MotionSolver::kQuaternion;
      return studies::match_as_in_paper(model, data, guess, params);
    }
    if (method_ == "gicp") {
      return global_ ? studies::match_gicp_globally(model, data, guess, search_params(),
                                                    registration::GicpParams{})
                     : studies::match_gicp(model, data, guess, registration::GicpParams{});
    }
    return global_ ? studies::match_globally(model, data, guess, search_params())
                   : studies::match_planes(model, data, guess, registration::CloudParams{});
  }

  [[nodiscard]] Outcome draw(const Points& model, const Points& data, const Pose& guess,
                             const studies::CloudMatch& answer,
                             const studies::ClosestPoints& before,
                             const studies::ClosestPoints& after) const {
    const report::MatchView view = report::view_of(model, data, guess, answer.T_model_data);
    Outcome drawn =
        tools::write_text(plot_ + "/before.svg",
                          report::match_picture("Before", model, data, guess, before.index, view));
    if (drawn) {
      drawn = tools::write_text(
          plot_ + "/after.svg",
          report::match_picture("After", model, data, answer.T_model_data, after.index, view));
    }
    if (!drawn) return drawn;
    return tools::write_text(
        plot_ + "/histogram.svg",
        report::render(report::distance_histogram(before.distance_m, after.distance_m), true));
  }

  [[nodiscard]] report::Json to_json(const clouds::Cloud& model, const clouds::Cloud& data,
                                     const studies::CloudMatch& a, double before_m,
                                     double after_m) const {
    report::Json cpu = report::Json::object();
    for (const auto& [stage, ms] : a.cpu_ms) cpu[stage] = ms;
    cpu["total"] = a.total_ms();
    report::Json out = {{"method", method_},
                        {"T_model_data", row_major(a.T_model_data.matrix())},
                        {"translation_m", numbers_of(a.T_model_data.p)},
                        {"roll_pitch_yaw_deg", numbers_of(roll_pitch_yaw_deg(a.T_model_data.q))},
                        {"stop", a.stop},
                        {"iterations", a.iterations},
                        {"model_points", model.points.size()},
                        {"data_points", data.points.size()},
                        {"dropped_points", {{"model", model.no_return}, {"data", data.no_return}}},
                        {"pairs", a.pairs},
                        {"overlap", a.overlap},
                        {"mean_distance_before_m", before_m},
                        {"mean_distance_after_m", after_m},
                        {"cpu_ms", cpu}};
    if (a.verdict) out.update(more_of(*a.verdict));
    if (a.paper) out.update(more_of(*a.paper));
    if (a.planes) out.update(more_of(*a.planes));
    if (a.searched) out.update(more_of(*a.searched));
    out["accepted"] = a.good;
    return out;
  }

  static void print_results(const clouds::Cloud& model, const clouds::Cloud& data,
                            const studies::CloudMatch& a, double before_m, double after_m) {
    fmt::print("model {} points, data {} points\n", model.points.size(), data.points.size());
    fmt::print("{} after {} iterations; CPU", a.stop, a.iterations);
    for (const auto& [stage, ms] : a.cpu_ms) fmt::print(" {} {:.1f} ms", stage, ms);
    fmt::print(
        "\npairs {}, overlap {:.0f} %, mean distance to the closest point before {:.1f} cm, "
        "after {:.1f} cm\n",
        a.pairs, 100.0 * a.overlap, 100.0 * before_m, 100.0 * after_m);
    const Vec3& p = a.T_model_data.p;
    const Vec3 rpy = roll_pitch_yaw_deg(a.T_model_data.q);
    fmt::print(
        "translation {:.3f} {:.3f} {:.3f} m ({:.3f} m), roll pitch yaw {:.3f} {:.3f} {:.3f} deg\n",
        p.x(), p.y(), p.z(), p.norm(), rpy.x(), rpy.y(), rpy.z());
    if (a.planes) {
      const Vec6 s = sigmas(a.planes->information);
      fmt::print("one sigma: x {}, y {}, z {}, roll {}, pitch {}, yaw {}\n", sigma_text(s[0], "m"),
                 sigma_text(s[1], "m"), sigma_text(s[2], "m"), sigma_text(degrees(s[3]), "deg"),
                 sigma_text(degrees(s[4]), "deg"), sigma_text(degrees(s[5]), "deg"));
    } else {
      fmt::print("one sigma: not estimated by this method\n");
    }
    if (a.verdict) {
      const registration::Plausibility& found = a.verdict->plausibility;
      fmt::print(
          "check: {:.0f} % of what is not ground lies on surfaces of the other cloud, {:.0f} % "
          "in its free space\n",
          100.0 * found.explained, 100.0 * found.contradicted);
    }
    if (a.searched && a.searched->ambiguity > 0.0) {
      fmt::print("the second best pose explains the clouds {:.2f} times as well\n",
                 a.searched->ambiguity);
    }
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
  std::string organized_;
  std::string plot_;
  registration::PaperParams params_;
  bool as_printed_ = false;
  bool quaternion_ = false;
  bool global_ = false;
  double radius_m_ = registration::CloudParams{}.global_radius_m;
  bool json_ = false;
};

}  // namespace

void add_register_command(CLI::App* rcs, Commands* commands) {
  commands->push_back(std::make_unique<Register>(rcs));
}

}  // namespace rcs::cli

// tool_path: a site of the robot follows a path in space, by damped inverse kinematics.
#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <sstream>
#include <string_view>

#include "base/open_file.hpp"
#include "controllers/controller.hpp"
#include "controllers/model_map.hpp"
#include "controllers/parameters.hpp"
#include "model/sines.hpp"

namespace tandem {
namespace {

constexpr std::size_t kMostPlaces = 1'000'000;
constexpr std::uint64_t kMostPathBytes = std::uint64_t{128} << 20;
constexpr double kLargest_m = 100.0;  // of a coordinate
constexpr double kLongest_s = 3600.0;
constexpr double kNearest_s = 1e-4;  // between two places: a cycle passes few of them
constexpr double kDamping = 1e-3;    // [m] of the pseudo-inverse
constexpr double kHome_1_s = 5.0;    // rate at which what the path leaves free returns
constexpr double kReach_m = 0.02;    // that the site may miss its path by, at configuration
constexpr std::string_view kHeader = "time_s,x_m,y_m,z_m";

/// Where the site is to be at a time [m], from where the path begins.
struct Place {
  double time_s = 0.0;
  Eigen::Vector3d p_m = Eigen::Vector3d::Zero();
};

std::unexpected<Error> wrong_line(const std::string& file, int line, std::string message,
                                  std::string hint) {
  return std::unexpected(Error{.message = std::move(message),
                               .hint = std::move(hint),
                               .file = file,
                               .line = line,
                               .key = {}});
}

/// "1.5,0,-0.25,3" in full; false: it is something else.
bool read_row(const std::string& line, Place& place) {
  double values[4];
  const char* at = line.c_str();
  for (int i = 0; i < 4; ++i) {
    char* end = nullptr;
    values[i] = std::strtod(at, &end);
    if (end == at || !std::isfinite(values[i]) || *end != (i == 3 ? '\0' : ',')) return false;
    at = end + 1;
  }
  place = {values[0], {values[1], values[2], values[3]}};
  return true;
}

/// Errors, with file and line: a file that cannot be read; another header; a row that is not four
/// numbers; times that do not start at 0, do not grow by 0.1 ms, or are beyond an hour; a
/// coordinate beyond 100 m; one place or more than a million.
Result<std::vector<Place>> read_path(const std::string& file) {
  const Result<std::string> text = read_file(file, "is `path` right?", kMostPathBytes);
  if (!text) return std::unexpected(text.error());
  std::istringstream in(*text);
  const std::string wanted(kHeader);
  std::string line;
  const auto next = [&] {
    if (!std::getline(in, line)) return false;
    if (line.ends_with('\r')) line.pop_back();
    return true;
  };
  if (!next() || line != wanted) {
    return wrong_line(file, 1, "does not begin with the names of the columns",
                      "the first line is " + wanted);
  }
  std::vector<Place> places;
  for (int number = 2; next(); ++number) {
    Place place;
    if (!read_row(line, place)) {
      return wrong_line(file, number, "is not four numbers", "write " + wanted);
    }
    if (places.empty() && place.time_s != 0.0) {
      return wrong_line(file, number, "the first time is not 0", "let the path begin at 0 s");
    }
    if (!places.empty() && !(place.time_s > places.back().time_s)) {
      return wrong_line(file, number, "its time is not later than the one before",
                        "sort the rows by time");
    }
    if (!places.empty() && place.time_s < places.back().time_s + kNearest_s) {
      return wrong_line(file, number, "its time is less than 0.1 ms after the one before",
                        "leave places out; is `time_s` in seconds?");
    }
    if (place.time_s > kLongest_s) {
      return wrong_line(file, number, "its time is beyond an hour",
                        "cut the path into parts; is `time_s` in seconds?");
    }
    if (place.p_m.cwiseAbs().maxCoeff() > kLargest_m) {
      return wrong_line(file, number, "is more than 100 m away", "coordinates are in metres");
    }
    if (places.size() == kMostPlaces) {
      return wrong_line(file, number, "there are more than 1000000 places", "use fewer");
    }
    places.push_back(place);
  }
  if (places.size() < 2) {
    return wrong_line(file, 0, "has fewer than two places", "add rows of " + wanted);
  }
  return places;
}

/// Parameters: site, path (a CSV file), joints (all), scale (1), stop_at_end (false). The path
/// begins where the site is at the start. Joints return to where they began as far as the path
/// leaves them free.
class ToolPath : public Controller {
 public:
  Status configure(ControllerSetup& setup) override {
    TomlTable& parameters = setup.parameters;
    joints_ = joints_parameter(setup);
    for (const std::size_t joint : joints_) setup.claim(joint, hal::ControlMode::kPosition);
    const std::string site = parameters.text("site");
    const std::string path = parameters.text("path");
    scale_ = setup.parameter(
        "scale", {.min = 1e-3, .max = 1e3, .otherwise = 1, .doc = "of the path's coordinates"});
    stop_at_end_ = stop_at_end_parameter(setup);
    period_s_ = static_cast<double>(setup.period_ns) * 1e-9;
    robot_ = &setup.robot;
    if (parameters.has_errors()) return {};
    auto map = ModelMap::make(setup.robot, setup.kernels);
    if (!map) return std::unexpected(map.error());
    map_ = std::move(*map);
    kernels_ = setup.kernels;
    const auto index = site_index(*kernels_, site);
    if (!index) {
      parameters.error("site", index.error().message, index.error().hint);
      return {};
    }
    site_ = *index;
    const std::filesystem::path folder = parameters.folder();
    auto places = read_path((folder / path).lexically_normal().string());
    if (!places) return std::unexpected(places.error());
    places_ = std::move(*places);
    setup.plan(parameters, "path", places_.back().time_s);
    allocate();
    if (!setup.start_position_rad.empty()) check_reach(setup);
    return {};
  }

  void start(const hal::CycleTime& time, const hal::StateImage& state,
             hal::CommandImage& /*command*/) noexcept TANDEM_RT override {
    begin(state.position_rad());
    start_ns_ = time.time_ns;
  }

  Code update(const hal::CycleTime& time, const hal::StateImage& /*state*/,
              hal::CommandImage& command) noexcept TANDEM_RT override {
    const double t_s = static_cast<double>(time.time_ns - start_ns_) * 1e-9;
    (void)follow(t_s);
    for (std::size_t k = 0; k < joints_.size(); ++k) {
      command.position_rad()[joints_[k]] = reference_[joints_[k]];
      command.velocity_rad_s()[joints_[k]] = move_[static_cast<Eigen::Index>(k)] / period_s_;
    }
    return stop_at_end_.on() && t_s >= places_.back().time_s ? Code::kStopped : Code::kOk;
  }

  void archive(Archive& ar) override {
    ar(start_ns_, place_, reference_, home_, first_m_[0], first_m_[1], first_m_[2]);
  }

 private:
  void allocate() {
    const std::size_t nv = kernels_->nv;
    sines_ = model::Sines(*kernels_);
    q_.assign(kernels_->nq, 0.0);
    zero_.assign(nv, 0.0);
    pose_.assign(12 * kernels_->sites, 0.0);
    motion_.assign(6 * kernels_->sites, 0.0);
    jacobians_.assign(6 * nv * kernels_->sites, 0.0);
    reference_.assign(robot_->joints.size(), 0.0);
    home_ = reference_;
    J_.setZero(3, static_cast<Eigen::Index>(joints_.size()));
    move_.setZero(static_cast<Eigen::Index>(joints_.size()));
    back_ = move_;
    if (kernels_->floating_base != 0) q_[6] = 1.0;  // places are in the base's frame
  }

  void begin(std::span<const double> position_rad) noexcept TANDEM_RT {
    std::ranges::copy(position_rad, reference_.begin());
    std::ranges::copy(position_rad, home_.begin());
    place_ = 0;
    first_m_ = site_m();
  }

  /// Place of the site at the references, in the base's frame.
  Eigen::Vector3d site_m() noexcept TANDEM_RT {
    map_.positions_to_q(reference_, q_);
    sines_.take(q_.data());
    kernels_->site_twists_at(sines_.data(), q_.data(), zero_.data(), pose_.data(), motion_.data());
    return Eigen::Map<const Eigen::Vector3d>(&pose_[12 * site_ + 9]);
  }

  /// Through the places by cubics; at rest before the first and after the last.
  Eigen::Vector3d wanted_m(double t_s) noexcept TANDEM_RT {
    const std::size_t last = places_.size() - 1;
    while (place_ < last && t_s >= places_[place_ + 1].time_s) ++place_;
    const Eigen::Vector3d& origin = places_.front().p_m;
    if (place_ == last) return first_m_ + scale_ * (places_[last].p_m - origin);
    const Place &a = places_[place_], &b = places_[place_ + 1];
    const double h = b.time_s - a.time_s, u = std::max(0.0, (t_s - a.time_s) / h);
    const Eigen::Vector3d da = h * rate(place_), db = h * rate(place_ + 1);
    const double u2 = u * u, u3 = u2 * u;
    return first_m_ + scale_ * ((2 * u3 - 3 * u2 + 1) * a.p_m + (u3 - 2 * u2 + u) * da +
                                (3 * u2 - 2 * u3) * b.p_m + (u3 - u2) * db - origin);
  }
  /// Between its neighbours [m/s].
  [[nodiscard]] Eigen::Vector3d rate(std::size_t i) const noexcept TANDEM_RT {
    if (i == 0 || i + 1 == places_.size()) return Eigen::Vector3d::Zero();
    return (places_[i + 1].p_m - places_[i - 1].p_m) /
           (places_[i + 1].time_s - places_[i - 1].time_s);
  }

  /// One step of the references towards the path, no joint faster than it may be or out of range.
  /// @return what the site missed it by before [m]
  double follow(double t_s) noexcept TANDEM_RT {
    const Eigen::Vector3d error = wanted_m(t_s) - site_m();
    kernels_->site_jacobians_at(sines_.data(), q_.data(), jacobians_.data());
    const std::size_t nv = kernels_->nv;
    const double* J = &jacobians_[6 * nv * site_];
    for (std::size_t k = 0; k < joints_.size(); ++k) {
      const auto col = static_cast<Eigen::Index>(k);
      const std::size_t v = map_.v_index(joints_[k]);
      for (std::size_t row = 0; row < 3; ++row) {
        J_(static_cast<Eigen::Index>(row), col) = J[row * nv + v];
      }
      back_[col] = kHome_1_s * period_s_ * (home_[joints_[k]] - reference_[joints_[k]]);
    }
    Eigen::Matrix3d A = kDamping * kDamping * Eigen::Matrix3d::Identity();
    Eigen::Vector3d left = error;
    for (Eigen::Index k = 0; k < J_.cols(); ++k) {
      A += J_.col(k) * J_.col(k).transpose();
      left -= J_.col(k) * back_[k];
    }
    const Eigen::Vector3d pull = A.llt().solve(left);
    double share = 1.0;
    for (Eigen::Index k = 0; k < J_.cols(); ++k) {
      move_[k] = back_[k] + J_.col(k).dot(pull);
      const double most =
          period_s_ * robot_->joints[joints_[static_cast<std::size_t>(k)]].max_velocity_rad_s;
      if (std::abs(move_[k]) > most) share = std::min(share, most / std::abs(move_[k]));
    }
    for (std::size_t k = 0; k < joints_.size(); ++k) {
      const hal::DrivenJoint& joint = robot_->joints[joints_[k]];
      double& reference = reference_[joints_[k]];
      double& move = move_[static_cast<Eigen::Index>(k)];
      const double to = std::clamp(reference + share * move, joint.min_position_rad,
                                   std::max(joint.min_position_rad, joint.max_position_rad));
      move = to - reference;
      reference = to;
    }
    return error.norm();
  }

  /// The path is followed once, from the posture in which the experiment starts.
  void check_reach(ControllerSetup& setup) {
    begin(setup.start_position_rad);
    double worst = 0.0, worst_s = 0.0, t_s = 0.0;
    for (std::int64_t time_ns = 0; t_s < places_.back().time_s; time_ns += setup.period_ns) {
      t_s = static_cast<double>(time_ns) * 1e-9;  // as update() has it
      const double missed = follow(t_s);
      if (missed > worst) worst_s = t_s;
      worst = std::max(worst, missed);
    }
    if (!(worst > kReach_m)) return;
    char text[128];
    std::snprintf(text, sizeof text, "the site would be %.3f m beside its path at %.2f s", worst,
                  worst_s);
    setup.parameters.error("path", text,
                           "make `scale` smaller, name more `joints`, or start in another posture");
  }

  const hal::Robot* robot_ = nullptr;
  const tandem_kernels* kernels_ = nullptr;
  model::Sines sines_;  // of the references
  ModelMap map_;
  std::size_t site_ = 0;
  std::vector<std::size_t> joints_;
  std::vector<Place> places_;
  double scale_ = 1.0, period_s_ = 1e-3;
  Parameter stop_at_end_;
  std::vector<double> q_, zero_, pose_, motion_, jacobians_;
  Eigen::Matrix3Xd J_;
  Eigen::VectorXd move_, back_;  // (joints) in a cycle [rad or m]
  std::int64_t start_ns_ = 0;
  std::size_t place_ = 0;                 // the last that is past
  std::vector<double> reference_, home_;  // (all joints of the image)
  Eigen::Vector3d first_m_ = Eigen::Vector3d::Zero();
};

}  // namespace
}  // namespace tandem

TANDEM_CONTROLLER(tandem::ToolPath, "tool_path",
                  "Leads a site of the robot along a path in space, from a file.")

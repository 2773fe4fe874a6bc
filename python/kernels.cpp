// A robot's generated kernels for numpy: a state, or many of them in the rows of 2-D arrays.
// Layer: python.  Thread: any; the kernels run without the interpreter's lock.
#include <algorithm>
#include <cmath>
#include <initializer_list>

#include "base/bundled_files.hpp"
#include "python/arrays.hpp"
#include "robot/kernel_supply.hpp"

namespace tandem::python {
namespace {

/// An argument: numbers of `width` a state.
struct Argument {
  const char* name;
  py::object value;
  std::size_t width;
  bool optional = false;  ///< None stands for zeros
};

/// Arguments of a call, read and checked.
class States {
 public:
  /// Errors: an argument that is no array of finite numbers, or whose shape does not fit.
  States(std::initializer_list<Argument> arguments) {
    for (const Argument& one : arguments) take(one);
  }
  /// That the caller gave: 1 where every argument is a vector, none where arrays have no rows.
  [[nodiscard]] py::ssize_t count() const { return count_ < 0 ? 1 : count_; }
  /// Where argument `which` of `state` stands. An argument of one state serves all of them.
  [[nodiscard]] const double* at(std::size_t which, py::ssize_t state) const {
    const One& one = arguments_[which];
    return one.data + (one.many ? state * static_cast<py::ssize_t>(one.width) : 0);
  }
  /// An array for results of `shape` a state.
  [[nodiscard]] py::array_t<double> result(std::vector<py::ssize_t> shape) const {
    if (count_ >= 0) shape.insert(shape.begin(), count_);
    return py::array_t<double>(shape);
  }

 private:
  struct One {
    Doubles array;
    std::vector<double> zeros;
    const double* data;
    std::size_t width;
    bool many;
  };

  void take(const Argument& argument) {
    One one{{}, {}, nullptr, argument.width, false};
    if (argument.value.is_none() && argument.optional) {
      one.zeros.resize(std::max<std::size_t>(argument.width, 1));
      one.data = one.zeros.data();
      arguments_.push_back(std::move(one));
      return;
    }
    one.array = numbers_of(argument.name, argument.value);
    const auto width = static_cast<py::ssize_t>(argument.width);
    const py::ssize_t dimensions = one.array.ndim();
    one.many = dimensions == 2;
    if ((dimensions != 1 && dimensions != 2) || one.array.shape(dimensions - 1) != width) {
      raise_value(argument.name, "has the shape " + text_of(one.array) + ", wanted (" +
                                     std::to_string(width) + ",) or (N, " + std::to_string(width) +
                                     ")");
    }
    if (one.many && count_ >= 0 && one.array.shape(0) != count_) {
      raise_value(argument.name, "has " + std::to_string(one.array.shape(0)) +
                                     " rows, the arguments before it " + std::to_string(count_));
    }
    if (one.many) count_ = one.array.shape(0);
    one.data = one.array.data();
    for (py::ssize_t i = 0; i < one.array.size(); ++i) {
      if (std::isfinite(one.data[i])) continue;
      raise_value(argument.name, "element " + std::to_string(i % std::max<py::ssize_t>(width, 1)) +
                                     (one.many ? " of row " + std::to_string(i / width) : "") +
                                     " is not finite");
    }
    arguments_.push_back(std::move(one));
  }

  static std::string text_of(const py::array& array) {
    return py::str(array.attr("shape")).cast<std::string>();
  }

  std::vector<One> arguments_;
  py::ssize_t count_ = -1;  // no 2-D argument yet
};

/// The kernels of a robot. Immutable.
class Kernels {
 public:
  Kernels(const std::string& file, bool derivatives, bool build, const std::string& variant) {
    const Away away;
    auto made = made_of(file, derivatives, build, variant);
    const py::gil_scoped_acquire back;
    library_ = python::take(std::move(made));
  }

  [[nodiscard]] const tandem_kernels& table() const { return *library_.get(); }
  [[nodiscard]] std::vector<std::string> names(const char* const* names,
                                               std::uint32_t count) const {
    return {names, names + count};
  }

  /// Calls `kernel(state, result)` for each state, without the interpreter's lock, and looks for
  /// Ctrl-C now and then.
  template <class Call>
  static void for_each(const States& states, const Call& call) {
    constexpr py::ssize_t kPerTurn = 8192;
    for (py::ssize_t begin = 0; begin < states.count(); begin += kPerTurn) {
      if (begin > 0 && PyErr_CheckSignals() != 0) throw py::error_already_set();
      const Away away;
      const py::ssize_t end = std::min(begin + kPerTurn, states.count());
      for (py::ssize_t s = begin; s < end; ++s) call(s);
    }
  }
  void check_base(const py::object& q) const {
    if (table().floating_base == 0) return;
    const Doubles array = Doubles::ensure(q);
    const py::ssize_t rows = array.ndim() == 2 ? array.shape(0) : 1;
    for (py::ssize_t r = 0; r < rows; ++r) {
      const double* at = array.data() + r * table().nq + 3;
      const double norm = at[0] * at[0] + at[1] * at[1] + at[2] * at[2] + at[3] * at[3];
      if (std::abs(norm - 1.0) < 1e-6) continue;
      raise_value("q", "elements 3 to 6 are the base's quaternion (x y z w), and have the norm " +
                           std::to_string(std::sqrt(norm)) + ", wanted 1");
    }
  }

  py::array_t<double> forward_dynamics(const py::object& q, const py::object& v,
                                       const py::object& tau, const py::object& wrench) const {
    const tandem_kernels& k = table();
    const States in{
        {"q", q, k.nq}, {"v", v, k.nv}, {"tau", tau, k.nv}, {"wrench", wrench, wrenches(), true}};
    check_base(q);
    auto out = in.result({k.nv});
    double* to = out.mutable_data();
    for_each(in, [&](py::ssize_t s) {
      k.forward_dynamics(in.at(0, s), in.at(1, s), in.at(2, s), in.at(3, s), to + s * k.nv);
    });
    return out;
  }
  py::array_t<double> inverse_dynamics(const py::object& q, const py::object& v,
                                       const py::object& vdot, const py::object& wrench) const {
    const tandem_kernels& k = table();
    const States in{
        {"q", q, k.nq}, {"v", v, k.nv}, {"vdot", vdot, k.nv}, {"wrench", wrench, wrenches(), true}};
    check_base(q);
    auto out = in.result({k.nv});
    double* to = out.mutable_data();
    for_each(in, [&](py::ssize_t s) {
      k.inverse_dynamics(in.at(0, s), in.at(1, s), in.at(2, s), in.at(3, s), to + s * k.nv);
    });
    return out;
  }
  py::array_t<double> mass_matrix(const py::object& q) const {
    const tandem_kernels& k = table();
    const States in{{"q", q, k.nq}};
    check_base(q);
    auto out = in.result({k.nv, k.nv});
    double* to = out.mutable_data();
    for_each(in, [&](py::ssize_t s) { k.mass_matrix(in.at(0, s), to + s * k.nv * k.nv); });
    return out;
  }
  py::array_t<double> bias(const py::object& q, const py::object& v) const {
    const tandem_kernels& k = table();
    const States in{{"q", q, k.nq}, {"v", v, k.nv}};
    check_base(q);
    auto out = in.result({k.nv});
    double* to = out.mutable_data();
    for_each(in, [&](py::ssize_t s) { k.bias(in.at(0, s), in.at(1, s), to + s * k.nv); });
    return out;
  }
  py::array_t<double> energy(const py::object& q, const py::object& v) const {
    const tandem_kernels& k = table();
    const States in{{"q", q, k.nq}, {"v", v, k.nv}};
    check_base(q);
    auto out = in.result({2});
    double* to = out.mutable_data();
    for_each(in, [&](py::ssize_t s) { k.energy(in.at(0, s), in.at(1, s), to + 2 * s); });
    return out;
  }
  py::tuple center_of_mass(const py::object& q, const py::object& v) const {
    const tandem_kernels& k = table();
    const States in{{"q", q, k.nq}, {"v", v, k.nv}};
    check_base(q);
    auto c = in.result({3}), cdot = in.result({3}), jacobian = in.result({3, k.nv});
    double *at_c = c.mutable_data(), *at_cdot = cdot.mutable_data(),
           *at_j = jacobian.mutable_data();
    for_each(in, [&](py::ssize_t s) {
      k.center_of_mass(in.at(0, s), in.at(1, s), at_c + 3 * s, at_cdot + 3 * s,
                       at_j + 3 * k.nv * s);
    });
    return py::make_tuple(c, cdot, jacobian);
  }
  /// Poses (sites, 12) and twists (sites, 6).
  py::tuple site_twists(const py::object& q, const py::object& v) const {
    const tandem_kernels& k = table();
    const States in{{"q", q, k.nq}, {"v", v, k.nv}};
    check_base(q);
    auto poses = in.result({k.sites, 12}), twists = in.result({k.sites, 6});
    double *at_pose = poses.mutable_data(), *at_twist = twists.mutable_data();
    for_each(in, [&](py::ssize_t s) {
      k.site_twists(in.at(0, s), in.at(1, s), at_pose + 12 * k.sites * s,
                    at_twist + 6 * k.sites * s);
    });
    return py::make_tuple(poses, twists);
  }
  py::array_t<double> site_jacobians(const py::object& q) const {
    const tandem_kernels& k = table();
    const States in{{"q", q, k.nq}};
    check_base(q);
    auto out = in.result({k.sites, 6, k.nv});
    double* to = out.mutable_data();
    for_each(in,
             [&](py::ssize_t s) { k.site_jacobians(in.at(0, s), to + 6 * k.sites * k.nv * s); });
    return out;
  }
  using Derivatives = decltype(tandem_kernels::forward_dynamics_derivatives);
  py::tuple derivatives(Derivatives kernel, const char* third, const py::object& q,
                        const py::object& v, const py::object& w, const py::object& wrench) const {
    const tandem_kernels& k = table();
    if (kernel == nullptr) {
      raise(Error{.message = "these kernels have no derivatives",
                  .hint = "pass derivatives=True to Model, or write `derivatives = true` into "
                          "[model] of robot.toml",
                  .file = {},
                  .key = {}});
    }
    const States in{
        {"q", q, k.nq}, {"v", v, k.nv}, {third, w, k.nv}, {"wrench", wrench, wrenches(), true}};
    check_base(q);
    auto by_q = in.result({k.nv, k.nv}), by_v = in.result({k.nv, k.nv}),
         by_w = in.result({k.nv, k.nv});
    double *at_q = by_q.mutable_data(), *at_v = by_v.mutable_data(), *at_w = by_w.mutable_data();
    for_each(in, [&](py::ssize_t s) {
      const py::ssize_t at = s * k.nv * k.nv;
      kernel(in.at(0, s), in.at(1, s), in.at(2, s), in.at(3, s), at_q + at, at_v + at, at_w + at);
    });
    return py::make_tuple(by_q, by_v, by_w);
  }

 private:
  [[nodiscard]] std::size_t wrenches() const { return 6 * std::size_t{table().wrenches}; }

  static std::expected<model::KernelLibrary, Diagnostics> made_of(const std::string& file,
                                                                  bool derivatives, bool build,
                                                                  const std::string& variant) {
    const std::scoped_lock alone(reading());
    const Result<std::string> named = named_file(file, Bundled::kRobot);
    if (!named) return std::unexpected(Diagnostics{named.error()});
    auto robot = robot::read_robot(*named);
    if (!robot) return std::unexpected(robot.error());
    const bool declared =
        std::exchange(robot->spec.derivatives, robot->spec.derivatives || derivatives);
    using robot::MissingKernels;
    auto library = robot::supply_kernels(*robot, variant,
                                         build ? MissingKernels::kBuild : MissingKernels::kRefuse);
    if (!library && derivatives && !declared && !build) {  // the program builds what is declared
      return std::unexpected(Diagnostics{
          {.message = "there are no kernels of '" + robot->config.name + "' with derivatives",
           .hint = "let Model build them once (build=True), or write `derivatives = true` into "
                   "[model] of robot.toml, then: tandem model build",
           .file = *named,
           .key = {}}});
    }
    if (!library) return std::unexpected(Diagnostics{library.error()});
    return std::move(*library);
  }

  model::KernelLibrary library_;
};

}  // namespace

void add_kernels(py::module_& module) {
  using namespace py::literals;
  using O = const py::object&;
  py::class_<Kernels>(module, "Kernels", "A robot's generated kernels.")
      .def(py::init<const std::string&, bool, bool, const std::string&>(), "file"_a,
           "derivatives"_a = false, "build"_a = true, "variant"_a = "")
      .def_static("__new__", &made_whole)
      .def_property_readonly("robot", [](const Kernels& k) { return k.table().robot; })
      .def_property_readonly("variant", [](const Kernels& k) { return k.table().variant; })
      .def_property_readonly("nq", [](const Kernels& k) { return k.table().nq; })
      .def_property_readonly("nv", [](const Kernels& k) { return k.table().nv; })
      .def_property_readonly("floating_base",
                             [](const Kernels& k) { return k.table().floating_base != 0; })
      .def_property_readonly("mass_kg", [](const Kernels& k) { return k.table().mass_kg; })
      .def_property_readonly(
          "joints",
          [](const Kernels& k) { return k.names(k.table().joint_names, k.table().joints); })
      .def_property_readonly(
          "sites", [](const Kernels& k) { return k.names(k.table().site_names, k.table().sites); })
      .def_property_readonly(
          "wrenches",
          [](const Kernels& k) { return k.names(k.table().wrench_names, k.table().wrenches); })
      .def("forward_dynamics", &Kernels::forward_dynamics, "q"_a, "v"_a, "tau"_a,
           "wrench"_a = py::none())
      .def("inverse_dynamics", &Kernels::inverse_dynamics, "q"_a, "v"_a, "vdot"_a,
           "wrench"_a = py::none())
      .def("mass_matrix", &Kernels::mass_matrix, "q"_a)
      .def("bias", &Kernels::bias, "q"_a, "v"_a)
      .def("energy", &Kernels::energy, "q"_a, "v"_a)
      .def("center_of_mass", &Kernels::center_of_mass, "q"_a, "v"_a)
      .def("site_twists", &Kernels::site_twists, "q"_a, "v"_a)
      .def("site_jacobians", &Kernels::site_jacobians, "q"_a)
      .def(
          "forward_dynamics_derivatives",
          [](const Kernels& k, O q, O v, O tau, O wrench) {
            return k.derivatives(k.table().forward_dynamics_derivatives, "tau", q, v, tau, wrench);
          },
          "q"_a, "v"_a, "tau"_a, "wrench"_a = py::none())
      .def(
          "inverse_dynamics_derivatives",
          [](const Kernels& k, O q, O v, O vdot, O wrench) {
            return k.derivatives(k.table().inverse_dynamics_derivatives, "vdot", q, v, vdot,
                                 wrench);
          },
          "q"_a, "v"_a, "vdot"_a, "wrench"_a = py::none());
}

}  // namespace tandem::python

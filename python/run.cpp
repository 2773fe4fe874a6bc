// The class tandem._native.Run: what Python sees of a run that it steps.
// Layer: python.  Thread: as python/running.hpp.
#include <optional>

#include "hal/config/capabilities.hpp"
#include "python/running.hpp"

namespace tandem::python {
namespace {

/// Limits of every joint, by the names of hal::JointCapabilities.
py::dict limits_of(const runtime::Run& run) {
  const hal::Robot robot = hal::robot_of(run.experiment().robot);
  py::dict out;
  const auto add = [&](const char* name, double hal::JointCapabilities::*limit) {
    py::array_t<double> values(static_cast<py::ssize_t>(robot.joints.size()));
    for (std::size_t j = 0; j < robot.joints.size(); ++j)
      values.mutable_data()[j] = robot.joints[j].*limit;
    out[name] = std::move(values);
  };
  add("min_position_rad", &hal::JointCapabilities::min_position_rad);
  add("max_position_rad", &hal::JointCapabilities::max_position_rad);
  add("max_velocity_rad_s", &hal::JointCapabilities::max_velocity_rad_s);
  add("max_torque_Nm", &hal::JointCapabilities::max_torque_Nm);
  return out;
}

using Shared = std::shared_ptr<Running>;

py::list views_of(const Shared& of, const hal::Image& image, bool writeable) {
  return views(image.layout(), image.bytes().data(), -1, 0, keeper(of), writeable);
}

}  // namespace

void add_run(py::module_& module) {
  using namespace py::literals;
  py::class_<Running, Shared>(module, "Run", "A run that stands where its command is awaited.")
      .def(py::init([](const std::string& file, const std::string& control_all,
                       const Control& control_some, std::optional<std::uint64_t> seed,
                       std::optional<double> duration_s, std::optional<double> rate,
                       const std::string& scenario, const std::string& hal,
                       const std::string& on_fault, std::optional<std::uint32_t> delay_cycles,
                       const std::string& kernel_variant, bool build, const std::string& log) {
             runtime::Overrides o;
             o.seed = seed;
             o.duration_s = duration_s;
             o.rate = rate;
             o.scenario = scenario;
             o.hal = hal;
             o.on_fault = on_fault;
             o.delay_cycles = delay_cycles;
             o.kernel_variant = kernel_variant;
             o.no_build = !build;
             return std::make_shared<Running>(file, std::move(o), control_all, control_some, log);
           }),
           "experiment"_a, "control_all"_a, "control_some"_a, "seed"_a, "duration_s"_a, "rate"_a,
           "scenario"_a, "hal"_a, "on_fault"_a, "delay_cycles"_a, "kernel_variant"_a, "build"_a,
           "log"_a)
      .def_static("__new__", &made_whole)
      .def("step", &Running::step, "cycles"_a)
      .def("next", &Running::next)
      .def("save", &Running::save)
      .def("restore", &Running::restore, "snapshot"_a)
      .def("inject", &Running::inject, "scenario"_a)
      .def("ask", &Running::ask, "question"_a)
      .def("signals", &Running::signals)
      .def("texts", &Running::texts)
      .def("finish", &Running::finish)
      .def("close", &Running::close)
      .def("stop", &Running::stop, "category"_a)
      .def("reset_faults", &Running::reset_faults)
      .def("start", &Running::start)
      .def("faults", &faults_of)
      .def("result", &Running::result)
      .def("limits", [](const Running& r) { return limits_of(r.run()); })
      .def("state", [](const Shared& r) { return views_of(r, r->run().state(), false); })
      .def("command",
           [](const Shared& r) {
             return r->lead() != nullptr ? views_of(r, r->lead()->command(), true)
                                         : views_of(r, r->run().command(), false);
           })
      .def("sent", [](const Shared& r) { return views_of(r, r->run().command(), false); })
      .def("truth", [](const Shared& r) { return views_of(r, r->run().truth(), false); })
      .def("estimate",
           [](const Shared& r) {
             const bool any = r->run().experiment().estimation.any();
             return any ? views_of(r, r->run().estimate(), false) : py::list();
           })
      .def_property_readonly("over", &Running::over)
      .def_property_readonly("log", &Running::log_path)
      .def_property_readonly(
          "phase", [](const Running& r) { return hal::to_string(r.run().cycle().phase()); })
      .def_property_readonly("warnings",
                             [](const Running& r) {
                               std::vector<std::string> texts;
                               for (const Error& one : r.run().warnings())
                                 texts.push_back(one.to_string());
                               return texts;
                             })
      .def_property_readonly("robot_file",
                             [](const Running& r) { return r.run().experiment().robot_file; })
      .def_property_readonly("seed", [](const Running& r) { return r.run().experiment().seed; })
      .def_property_readonly("period_s",
                             [](const Running& r) {
                               const auto ns = r.run().experiment().loop.period_ns;
                               return static_cast<double>(ns) * 1e-9;
                             })
      .def_property_readonly("joints", [](const Running& r) {
        std::vector<std::string> names;
        for (const auto& joint : r.run().experiment().robot.joints) names.push_back(joint.name);
        return names;
      });
}

}  // namespace tandem::python

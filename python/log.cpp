// A run's log for numpy: its channels' messages as records, of which every field is a view.
// Layer: python.  Thread: one at a time per log; files are read without the interpreter's lock.
#include "log/log_file.hpp"

#include <cstring>
#include <limits>

#include "log/signal_name.hpp"
#include "log/unmeasured.hpp"
#include "python/arrays.hpp"

namespace tandem::python {
namespace {

/// A channel's messages, one behind the other, each aligned for its numbers.
struct Records {
  std::vector<double> block;  // doubles for their alignment
  std::vector<double> time_s;
  std::size_t stride = 0;  // bytes
};

Result<Records> read_records(const log::LogFile& file, const log::LoggedTopic& topic) {
  Records out;
  const std::size_t bytes = topic.layout.bytes();
  out.stride = (bytes + 7) / 8 * 8;
  out.block.resize(out.stride / 8 * topic.messages);
  out.time_s.reserve(topic.messages);
  auto* to = reinterpret_cast<std::byte*>(out.block.data());
  const Status done = file.for_each(topic.name, [&](std::int64_t time_ns, auto body) {
    if (out.time_s.size() == topic.messages) return;
    std::memcpy(to + out.stride * out.time_s.size(), body.data(), bytes);
    out.time_s.push_back(static_cast<double>(time_ns) / 1e9);
  });
  if (!done) return std::unexpected(done.error());
  return out;
}

/// What nobody had measured yet is no number: until the first message that has all of it.
Status forget_unmeasured(const log::LogFile& file, const log::LoggedTopic& topic, Records& out) {
  const auto unknown = log::Unmeasured::of(file, topic);
  if (!unknown) return std::unexpected(unknown.error());
  const auto fields = topic.layout.fields();
  auto* at = reinterpret_cast<std::byte*>(out.block.data());
  for (std::size_t row = 0; row < out.time_s.size(); ++row, at += out.stride) {
    bool all = true;
    for (std::size_t f = 0; f < fields.size(); ++f) {
      for (std::size_t i = 0; unknown->tells(f) && i < fields[f].count; ++i) {
        if (!unknown->is(f, i, {at, topic.layout.bytes()})) continue;
        all = false;
        const double none = std::numeric_limits<double>::quiet_NaN();
        std::memcpy(at + fields[f].offset + i * sizeof none, &none, sizeof none);
      }
    }
    if (all) break;
  }
  return {};
}

class Log {
 public:
  explicit Log(const std::string& path) : file_(opened(path)) {}

  [[nodiscard]] const log::LogFile& file() const { return file_; }

  /// (name, type, messages, first_s, last_s, fields) of each; a field is (name, element names).
  [[nodiscard]] py::list channels() const {
    py::list out;
    for (const log::LoggedTopic& topic : file_.topics()) {
      py::list fields;
      for (const hal::Field& field : topic.layout.fields()) {
        fields.append(py::make_tuple(field.name, element_names(field)));
      }
      out.append(py::make_tuple(topic.name, topic.type, topic.messages,
                                static_cast<double>(topic.first_ns) / 1e9,
                                static_cast<double>(topic.last_ns) / 1e9, fields));
    }
    return out;
  }

  /// (time_s, [(field, array (N, count), doc)]).
  [[nodiscard]] py::tuple read(const std::string& name) const {
    const log::LoggedTopic* topic = take(file_.require(name));
    if (topic->layout.fields().empty()) {
      raise(Error{.message = name + " has messages of the type " + topic->type +
                             ", which is not all numbers of a fixed size",
                  .hint = "its events are Log.events; `tandem log` reads the rest",
                  .file = file_.path(),
                  .key = {}});
    }
    auto records = std::make_shared<Records>();
    {
      Result<Records> read = [&]() -> Result<Records> {
        const Away away;
        Result<Records> all = read_records(file_, *topic);
        if (!all) return all;
        const Status known = forget_unmeasured(file_, *topic, *all);
        if (!known) return std::unexpected(known.error());
        return all;
      }();
      *records = take(std::move(read));
    }
    const auto count = static_cast<py::ssize_t>(records->time_s.size());
    const py::capsule owner = keeper(std::shared_ptr<const Records>(records));
    const auto* base = reinterpret_cast<const std::byte*>(records->block.data());
    py::list fields =
        views(topic->layout, base, count, static_cast<py::ssize_t>(records->stride), owner, false);
    py::array_t<double> time_s(count, records->time_s.data(), owner);
    time_s.attr("flags").attr("writeable") = false;
    return py::make_tuple(time_s, fields);
  }

  /// (time_s, cycle, kind, joint or "", text) of each.
  [[nodiscard]] py::list events() const {
    py::list out;
    if (file_.find("/tandem/event") == nullptr) return out;
    for (const log::EventText& one : take(file_.events())) {
      const auto joint = static_cast<std::size_t>(one.event.joint);
      const bool named = one.event.joint >= 0 && joint < file_.info().joints.size();
      out.append(py::make_tuple(static_cast<double>(one.event.time_ns) / 1e9, one.event.cycle,
                                log::to_string(one.event.kind),
                                named ? file_.info().joints[joint] : std::string(), one.text));
    }
    return out;
  }

 private:
  static log::LogFile opened(const std::string& path) {
    Result<log::LogFile> file = [&] {
      const Away away;
      return log::LogFile::open(path);
    }();
    return take(std::move(file));
  }

  [[nodiscard]] std::vector<std::string> element_names(const hal::Field& field) const {
    std::vector<std::string> names;
    for (std::size_t i = 0; i < field.count; ++i) {
      const std::string name = log::signal_name(field, i, file_.info());
      names.push_back(name.size() > field.name.size() ? name.substr(field.name.size() + 1) : name);
    }
    return names;
  }

  log::LogFile file_;
};

}  // namespace

void add_log(py::module_& module) {
  using namespace py::literals;
  py::class_<Log>(module, "LogFile", "A log, counted, with none of its numbers read.")
      .def(py::init<const std::string&>(), "path"_a)
      .def_static("__new__", &made_whole)
      .def_property_readonly("path", [](const Log& log) { return log.file().path(); })
      .def_property_readonly("robot", [](const Log& log) { return log.file().info().robot; })
      .def_property_readonly("joints", [](const Log& log) { return log.file().info().joints; })
      .def_property_readonly("info", [](const Log& log) { return log::to_map(log.file().info()); })
      .def_property_readonly("configuration",
                             [](const Log& log) { return log.file().info().configuration; })
      .def_property_readonly("result", [](const Log& log) { return log.file().result(); })
      .def_property_readonly("truncated", [](const Log& log) { return log.file().truncated(); })
      .def_property_readonly("parts",
                             [](const Log& log) {
                               std::vector<std::string> paths;
                               for (const auto& one : log.file().parts()) paths.push_back(one.path);
                               return paths;
                             })
      .def_property_readonly("damage", [](const Log& log) { return log.file().damage(); })
      .def_property_readonly("cut", [](const Log& log) { return log.file().cut_remark(); })
      .def_property_readonly("remarks", [](const Log& log) { return log.file().remarks(); })
      .def_property_readonly("data_sha256", [](const Log& log) { return log.file().data_sha256(); })
      .def("channels", &Log::channels)
      .def(
          "full_name",
          [](const Log& log, const std::string& name) { return log.file().full_name(name); },
          "name"_a)
      .def(
          "left_out",
          [](const Log& log, const std::string& topic, const std::string& field) {
            return log.file().left_out(topic, field);
          },
          "topic"_a, "field"_a = "")
      .def("read", &Log::read, "channel"_a)
      .def("events", &Log::events);
}

}  // namespace tandem::python

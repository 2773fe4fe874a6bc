// The module tandem._native: what it holds, its errors, and where the parts of Tandem are.
// Layer: python.  Thread: any that holds the interpreter's lock.
#include <dlfcn.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <chrono>
#include <filesystem>
#include <string_view>
#include <thread>

#include "base/nearest.hpp"
#include "base/process.hpp"
#include "python/arrays.hpp"

namespace tandem::python {
namespace {

PyObject* error_type = nullptr;    // tandem.Error; the module keeps it alive
PyObject* unknown_type = nullptr;  // tandem.UnknownName
std::atomic<bool> recalled{false};
std::atomic<int> threads_away{0};
std::thread::id ending_thread;  // once it is recalled

/// As Python has it for threads that want its lock when it has ended: they are seen no more. One
/// that raised an error instead would print it while the interpreter goes, which ends the process.
[[noreturn]] void stay_away() {
  const py::gil_scoped_release free;
  for (;;) ::pause();
}

[[noreturn]] void throw_as(PyObject* type, const std::string& text) {
  PyErr_SetString(type, text.c_str());
  throw py::error_already_set();
}

const char* code_of(hal::FieldType type) {
  switch (type) {
    case hal::FieldType::kF64: return "<f8";
    case hal::FieldType::kI64: return "<i8";
    case hal::FieldType::kU64: return "<u8";
    case hal::FieldType::kU32: return "<u4";
    case hal::FieldType::kU16: return "<u2";
    case hal::FieldType::kI8: return "i1";
    case hal::FieldType::kU8: return "u1";
  }
  return "u1";
}

/// Where bin/tandem would be: the module is PREFIX/lib/python3/dist-packages/tandem/_native….so.
std::string program_of_this_library() {
  Dl_info found{};
  if (::dladdr(reinterpret_cast<void*>(&program_of_this_library), &found) == 0) return {};
  std::error_code ignored;
  const auto file = std::filesystem::canonical(found.dli_fname, ignored);
  auto folder = file.parent_path();
  for (int i = 0; i < 4; ++i) folder = folder.parent_path();
  return (folder / "bin/tandem").string();
}

}  // namespace

Away::Counted::Counted() {
  if (is_recalled()) {
    if (std::this_thread::get_id() != ending_thread) stay_away();
    throw_as(error_type, "Python ends: nothing is begun any more");
  }
  ++threads_away;
}
Away::Counted::~Counted() { --threads_away; }

bool Away::is_recalled() noexcept { return recalled; }

void Away::recall_all() {
  ending_thread = std::this_thread::get_id();
  recalled = true;
  while (threads_away > 0) {
    const py::gil_scoped_release back;
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
}

void raise(const Error& error) {
  std::error_code ignored;
  const std::string text = error.to_string();
  if (error.file.empty() || std::filesystem::exists(error.file, ignored)) {
    throw_as(error_type, text);
  }
  const py::object missing = py::reinterpret_borrow<py::object>(PyExc_FileNotFoundError);
  PyErr_SetObject(missing.ptr(), py::make_tuple(ENOENT, text, error.file).ptr());
  throw py::error_already_set();
}

void raise(const Diagnostics& errors) {
  if (errors.size() == 1) raise(errors.front());
  std::string text;
  for (const Error& error : errors) text += (text.empty() ? "" : "\n") + error.to_string();
  throw_as(error_type, text);
}

void raise_value(const std::string& what, const std::string& message) {
  throw py::value_error(what + ": " + message);
}

void raise_unknown(const std::string& kind, const std::string& name,
                   const std::vector<std::string>& known) {
  const std::string hint = suggest(name, known);
  throw_as(unknown_type,
           "no such " + kind + " '" + name + "'" + (hint.empty() ? "" : " (" + hint + ")"));
}

Doubles numbers_of(const std::string& name, const py::object& value) {
  const py::array array = py::array::ensure(value);
  const char kind = array ? array.dtype().kind() : '?';  // of None it is 'O'
  if (std::string_view("biuf").find(kind) == std::string_view::npos) {
    raise_value(name, "is no array of numbers");
  }
  Doubles numbers = Doubles::ensure(array);
  if (!numbers) raise_value(name, "is no array of numbers");
  return numbers;
}

py::object made_whole(const py::handle& type, const py::args& arguments, const py::kwargs& named) {
  auto* of = reinterpret_cast<PyTypeObject*>(type.ptr());
  auto made = py::reinterpret_steal<py::object>(py::detail::make_new_instance(of));
  made.attr("__init__")(*arguments, **named);
  return made;
}

std::mutex& reading() {
  static std::mutex mutex;
  return mutex;
}

py::list views(const hal::Layout& layout, const std::byte* base, py::ssize_t records,
               py::ssize_t stride, const py::object& owner, bool writeable) {
  py::list out;
  for (const hal::Field& field : layout.fields()) {
    if (field.count == 0) continue;
    const py::dtype type(code_of(field.type));
    std::vector<py::ssize_t> shape{static_cast<py::ssize_t>(field.count)};
    std::vector<py::ssize_t> strides{type.itemsize()};
    if (records >= 0) {
      shape.insert(shape.begin(), records);
      strides.insert(strides.begin(), stride);
    }
    py::array array(type, shape, strides, base + field.offset, owner);
    if (!writeable) array.attr("flags").attr("writeable") = false;
    out.append(py::make_tuple(field.name, std::move(array), field.doc));
  }
  return out;
}

void add_errors(py::module_& module) {
  error_type = PyErr_NewExceptionWithDoc(
      "tandem.Error", "What Tandem refuses, in the words of its command line.", nullptr, nullptr);
  module.add_object("Error", error_type);
  const py::object bases = py::make_tuple(py::reinterpret_borrow<py::object>(error_type),
                                          py::reinterpret_borrow<py::object>(PyExc_KeyError),
                                          py::reinterpret_borrow<py::object>(PyExc_AttributeError));
  py::dict members;
  // A KeyError shows its message in quotes.
  members["__str__"] = py::reinterpret_borrow<py::object>(PyExc_Exception).attr("__str__");
  unknown_type = PyErr_NewExceptionWithDoc("tandem.UnknownName",
                                           "A joint, field, channel or site that is not there; the "
                                           "nearest name is in the message.",
                                           bases.ptr(), members.ptr());
  module.add_object("UnknownName", unknown_type);
  module.def(
      "unknown",
      [](const std::string& kind, const std::string& name, const std::vector<std::string>& known) {
        raise_unknown(kind, name, known);
      },
      py::arg("kind"), py::arg("name"), py::arg("known"),
      "Raises UnknownName with the nearest of the known names.");
}

}  // namespace tandem::python

PYBIND11_MODULE(_native, module) {
  module.doc() = "The C++ half of `tandem`; import tandem, not this.";
  module.attr("__version__") = TANDEM_VERSION;
  tandem::stand_for_program(tandem::python::program_of_this_library());
  tandem::python::add_errors(module);
  tandem::python::add_kernels(module);
  tandem::python::add_log(module);
  tandem::python::add_run(module);
  pybind11::module_::import("atexit").attr("register")(
      pybind11::cpp_function(&tandem::python::Away::recall_all));
}

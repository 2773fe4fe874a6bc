// What the module's parts share: numpy arrays, and the house's errors as Python's exceptions.
// Layer: python.  Thread: any that holds the interpreter's lock, unless said otherwise.
#pragma once

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <expected>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "base/result.hpp"
#include "hal/image.hpp"

namespace tandem::python {

namespace py = pybind11;

using Doubles = py::array_t<double, py::array::c_style | py::array::forcecast>;

/// tandem.Error, or FileNotFoundError where the file that is named is not there.
[[noreturn]] void raise(const Error& error);
/// The same of several: each has its line.
[[noreturn]] void raise(const Diagnostics& errors);
/// ValueError: "WHAT: message".
[[noreturn]] void raise_value(const std::string& what, const std::string& message);
/// tandem.UnknownName, which is a KeyError: "no such KIND 'x' (did you mean 'y'?)".
[[noreturn]] void raise_unknown(const std::string& kind, const std::string& name,
                                const std::vector<std::string>& known);

/// `value` as floating point. Error: text, complex numbers, None, and what is no array.
[[nodiscard]] Doubles numbers_of(const std::string& name, const py::object& value);

/// A class's __new__: __init__ is called at once, so that there is no object without its C++ half.
/// The second call, which Python makes, does nothing.
[[nodiscard]] py::object made_whole(const py::handle& type, const py::args& arguments,
                                    const py::kwargs& named);

/// The value, or an exception.
template <class T, class E>
T take(std::expected<T, E>&& result) {
  if (!result) raise(result.error());
  if constexpr (!std::is_void_v<T>) return std::move(*result);
}

/// Held while a robot's files are read and checked: that may be done by one thread at a time.
[[nodiscard]] std::mutex& reading();

/// While one lives, its thread is without the interpreter's lock, and the interpreter does not end:
/// a thread that wanted the lock back from one that ends would end the process.
/// Error: Python ends.
class Away {
 public:
  Away() = default;
  Away(const Away&) = delete;
  Away& operator=(const Away&) = delete;
  /// What takes long is to stop.
  [[nodiscard]] static bool is_recalled() noexcept;
  /// Lets nobody leave any more, and waits for those who are away.
  static void recall_all();

 private:
  struct Counted {
    Counted();
    ~Counted();
    Counted(const Counted&) = delete;
    Counted& operator=(const Counted&) = delete;
  };
  Counted counted_;  // first: until the lock is back
  py::gil_scoped_release free_;
};

/// Fields of an image, or of each of many in a row, as (name, array, doc): nothing is copied.
/// @param records  -1: one image, whose arrays have the shape (count); else (records, count)
/// @param owner    keeps `base` alive
[[nodiscard]] py::list views(const hal::Layout& layout, const std::byte* base, py::ssize_t records,
                             py::ssize_t stride, const py::object& owner, bool writeable);

/// An object that keeps a `shared_ptr` alive, for arrays that look into it.
template <class T>
[[nodiscard]] py::capsule keeper(std::shared_ptr<T> what) {
  return py::capsule(new std::shared_ptr<T>(std::move(what)),
                     [](void* kept) { delete static_cast<std::shared_ptr<T>*>(kept); });
}

void add_errors(py::module_& module);
void add_kernels(py::module_& module);
void add_log(py::module_& module);
void add_run(py::module_& module);

}  // namespace tandem::python

// Where the samples of a run's topics go: to DDS, or to whoever else shows them.
// Layer: dds.  Thread: whose topics they are.
#pragma once

#include <memory>
#include <string>

#include "base/result.hpp"
#include "dds/config.hpp"
#include "dds/raw_endpoint.hpp"
#include "dds/types.hpp"

namespace tandem::dds {

/// One topic, as long as this lives.
class Outlet {
 public:
  virtual ~Outlet() = default;
  /// Whether somebody would get a sample.
  [[nodiscard]] virtual bool wanted() const = 0;
  /// @param sample  of the type's C structure; good during the call
  /// @return false: it was not sent
  virtual bool write(const void* sample) = 0;
};

class Outlets {
 public:
  virtual ~Outlets() = default;
  /// @param topic  Config::topic_name()
  virtual Result<std::unique_ptr<Outlet>> open(const Type& type, const std::string& topic,
                                               const Qos& qos) = 0;
  /// Has the namespace and the rates.
  [[nodiscard]] virtual const Config& config() const = 0;
  /// "tandem_run"
  [[nodiscard]] virtual const std::string& node() const = 0;
};

}  // namespace tandem::dds

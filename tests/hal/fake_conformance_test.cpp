// The conformance suite on the fake backend: that the suite itself can be passed.
#include "tests/hal/conformance.hpp"
#include "tests/hal/fake_backend.hpp"

namespace tandem::hal::test {
namespace {

ConformanceRobot make_fake() {
  ConformanceRobot made;
  made.robot = fake_robot();
  auto backend = std::make_unique<FakeBackend>(made.robot);
  made.provoke_fault = [raw = backend.get()](std::size_t j) { raw->provoke_fault(j); };
  made.backend = std::move(backend);
  made.joint = 1;
  return made;
}

INSTANTIATE_TEST_SUITE_P(Fake, BackendConformance,
                         testing::Values(ConformanceCase{"fake", make_fake}),
                         [](const auto& made) { return made.param.name; });

}  // namespace
}  // namespace tandem::hal::test

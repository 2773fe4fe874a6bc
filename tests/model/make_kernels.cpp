// Builds the kernels of a reference robot: make_kernels ROBOT LIBRARY.
#include <cstdio>

#include "model/kernel_build.hpp"
#include "tests/model/reference.hpp"

int main(int argc, char** argv) {
  using namespace tandem::model;
  if (argc != 3) return 2;
  const ReferenceRobot& robot = reference_robot(argv[1]);
  const auto built =
      build_kernels(reference_tree(robot), reference_spec(robot),
                    {.library = argv[2], .compiler = {}, .jobs = 0, .progress = {}, .waiting = {}});
  if (built) return 0;
  std::puts(built.error().to_string().c_str());
  return 1;
}

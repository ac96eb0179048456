// Writes the IDL of all types that the mappings publish, and the list of the descriptors that idlc
// makes of it: ros2_idl OUT.idl OUT.inc

#include <cstdio>
#include <fstream>
#include <string>
#include <vector>

#include "rcs/ros2/schema.h"
#include "tests/ros2/all_types.h"

int main(int argc, char** argv) {
  if (argc != 3) return 2;
  std::vector<rcs::ros2::TypeDescription> types;
  rcs::test::for_each_type([&types](const auto* type) {
    rcs::ros2::describe<std::remove_const_t<std::remove_pointer_t<decltype(type)>>>(&types);
  });
  std::ofstream idl(argv[1]);
  idl << rcs::ros2::idl_text(types);
  std::ofstream list(argv[2]);
  list << rcs::ros2::descriptor_list(types);
  return idl.flush() && list.flush() ? 0 : 3;
}

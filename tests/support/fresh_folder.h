#pragma once
// A folder of the running test's own, empty.

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <string>

namespace rcs::test {

inline std::filesystem::path fresh_folder() {
  const testing::TestInfo* const info = testing::UnitTest::GetInstance()->current_test_info();
  std::filesystem::path folder =
      std::filesystem::path(testing::TempDir()) / (std::string(info->test_suite_name()) + "." +
                                                   info->name() + "." + std::to_string(::getpid()));
  std::filesystem::remove_all(folder);
  std::filesystem::create_directories(folder);
  return folder;
}

}  // namespace rcs::test

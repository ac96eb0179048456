#include "tools/rcs/list_option.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>

#include "tools/base/trajectory.h"

namespace rcs::cli {

CLI::Option* add_numbers(CLI::App* app, const std::string& name, std::vector<double>* values,
                         const std::string& form, double low, double high,
                         const std::string& text) {
  const auto count = static_cast<std::size_t>(1 + std::count(form.begin(), form.end(), ','));
  const auto read = [=](const std::string& word) {
    const std::optional<std::vector<double>> numbers = tools::parse_numbers(word);
    const bool valid = numbers && numbers->size() == count &&
                       std::all_of(numbers->begin(), numbers->end(),
                                   [&](double v) { return v >= low && v <= high; });
    if (!valid) {
      throw CLI::ValidationError(
          name, fmt::format("{}: expected {}, each in [{:g}, {:g}]", word, form, low, high));
    }
    *values = *numbers;
  };
  return app->add_option_function<std::string>(name, read, text)->type_name(form);
}

}  // namespace rcs::cli

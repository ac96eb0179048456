#pragma once
// Result of an operation on the outside world (files, parameters, sockets): a value or an error.

#include <string>
#include <utility>
#include <variant>

#include "rcs/base/check.h"

namespace rcs {

struct Error {
  std::string message;  ///< names the file, line, key, unit and allowed range if applicable
};

template <class T>
class [[nodiscard]] Result {
 public:
  Result(T value) : state_(std::move(value)) {}      // NOLINT(google-explicit-constructor)
  Result(Error error) : state_(std::move(error)) {}  // NOLINT(google-explicit-constructor)

  [[nodiscard]] bool ok() const { return std::holds_alternative<T>(state_); }
  explicit operator bool() const { return ok(); }

  [[nodiscard]] const T& value() const& {
    RCS_CHECK(ok());
    return *std::get_if<T>(&state_);
  }
  [[nodiscard]] T& value() & {
    RCS_CHECK(ok());
    return *std::get_if<T>(&state_);
  }
  [[nodiscard]] T&& value() && {
    RCS_CHECK(ok());
    return std::move(*std::get_if<T>(&state_));
  }
  const T& operator*() const& { return value(); }
  T& operator*() & { return value(); }
  const T* operator->() const { return &value(); }
  T* operator->() { return &value(); }

  [[nodiscard]] const Error& error() const {
    RCS_CHECK(!ok());
    return *std::get_if<Error>(&state_);
  }

 private:
  std::variant<T, Error> state_;
};

/// Result of an action without a value.
struct Done {};
using Outcome = Result<Done>;

}  // namespace rcs

#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "base/error.hpp"

namespace pliant::test {

/// What an InputError thrown by `action` says, one problem a line; "" where nothing is thrown.
template <class Action>
std::string complaint_of(Action&& action) {
  try {
    action();
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

}  // namespace pliant::test

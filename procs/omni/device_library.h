// A vendor's shared library that is used when it is installed and never needed to build.
//
//   const DeviceLibrary library("libHD.so", "the OpenHaptics device library");
//   library.find("hdStartScheduler", start_scheduler);   // a function pointer
//
// Stays loaded until the process ends: such libraries keep threads of their own.
#pragma once

#include <string>

namespace foresight {

class DeviceLibrary {
 public:
  /// `hint` says what to install. Throws UnavailableError when the library cannot be loaded.
  DeviceLibrary(const std::string& file, const std::string& hint);

  /// Throws UnavailableError when the library has no such function.
  template <class Function>
  void find(const char* symbol, Function*& function) const {
    function = reinterpret_cast<Function*>(find_symbol(symbol));
  }

 private:
  void* find_symbol(const char* symbol) const;

  std::string file_;
  void* handle_;
};

}  // namespace foresight

#include "procs/omni/device_library.h"

#include <dlfcn.h>

#include "common/errors.h"

namespace foresight {

DeviceLibrary::DeviceLibrary(const std::string& file, const std::string& hint)
    : file_(file), handle_(dlopen(file.c_str(), RTLD_NOW | RTLD_LOCAL)) {
  if (handle_ == nullptr) {
    throw UnavailableError(std::string(dlerror()) + "; install " + hint);
  }
}

void* DeviceLibrary::find_symbol(const char* symbol) const {
  void* address = dlsym(handle_, symbol);
  if (address == nullptr) {
    throw UnavailableError(file_ + ": has no function " + symbol + " (another version?)");
  }
  return address;
}

}  // namespace foresight

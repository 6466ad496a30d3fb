#include "procs/camera/process.h"

int main(int argc, char** argv) {
  return foresight::process_main<foresight::CameraProcess>(argc, argv);
}

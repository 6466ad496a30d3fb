#include "procs/wam_controller/process.h"

int main(int argc, char** argv) {
  return foresight::process_main<foresight::WamControllerProcess>(argc, argv);
}

#include "procs/omni/process.h"

int main(int argc, char** argv) {
  return foresight::process_main<foresight::OmniProcess>(argc, argv);
}

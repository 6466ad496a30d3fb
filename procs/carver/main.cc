#include "procs/carver/process.h"

int main(int argc, char** argv) {
  return foresight::process_main<foresight::CarverProcess>(argc, argv);
}

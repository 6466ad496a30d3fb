#include "procs/calibrator/process.h"

int main(int argc, char** argv) {
  return foresight::process_main<foresight::CalibratorProcess>(argc, argv);
}

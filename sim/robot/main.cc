#include "sim/robot/process.h"

int main(int argc, char** argv) {
  return foresight::process_main<foresight::sim::SimProcess>(argc, argv);
}

#include "procs/slam/process.h"

int main(int argc, char** argv) {
  return foresight::process_main<foresight::SlamProcess>(argc, argv);
}

#include "procs/link/process.h"

int main(int argc, char** argv) {
  return foresight::process_main<foresight::LinkProcess>(argc, argv);
}

#include "procs/mesher/process.h"

int main(int argc, char** argv) {
  return foresight::process_main<foresight::MesherProcess>(argc, argv);
}

#include "procs/renderer/process.h"

int main(int argc, char** argv) {
  return foresight::process_main<foresight::RendererProcess>(argc, argv);
}

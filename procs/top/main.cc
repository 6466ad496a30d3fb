#include "procs/top/process.h"

int main(int argc, char** argv) { return foresight::run_top(argc, argv); }

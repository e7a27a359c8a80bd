#include "program.hpp"

int main(int argc, char** argv) { return pliant::apps::run_program(argc, argv); }

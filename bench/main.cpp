// SPDX-License-Identifier: Apache-2.0
#include <cstdio>

#include <benchmark/benchmark.h>

int main(int argc, char** argv) {
#ifndef NDEBUG
  std::fputs("WARNING: assertions are on: these times mean nothing; use the release preset\n", stderr);
#endif
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 2;
  benchmark::RunSpecifiedBenchmarks();
}

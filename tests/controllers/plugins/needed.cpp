// What renewed.cpp needs with NEEDED: says which build of itself it is.
extern "C" const char* build_of_the_needed() {
#if BUILD == 1
  return "Build 1.";
#else
  return "Build 2.";
#endif
}

// A library that lies beside a controller, which needs it.
extern "C" int beside() { return 1; }
